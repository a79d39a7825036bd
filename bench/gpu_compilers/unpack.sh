#!/bin/sh
# Unpacks compilers of three vendors' GPUs into a folder, for bench.gpu_compilers. Nothing is
# installed: no OpenCL platform appears, and removing the folder removes them. For Debian 12.
#
#     sh bench/gpu_compilers/unpack.sh FOLDER && export GPU_COMPILERS=FOLDER
set -e
folder=${1:?name a folder}
mkdir -p "$folder/packages"
folder=$(cd "$folder" && pwd)
cd "$folder/packages"
apt-get download clang-19 libclang-cpp19 libclang-common-19-dev libllvm19 llvm-19 libclc-19 \
    libclc-19-dev intel-opencl-icd libigc1 libigdfcl1 libigdgmm12 libopencl-clang14 libllvmspirvlib14
python3 -m pip download --no-deps nvidia-cuda-nvcc nvidia-cuda-nvdisasm
for package in *.deb; do dpkg -x "$package" "$folder"; done
for wheel in *.whl; do python3 -m zipfile -e "$wheel" "$folder"; done
chmod +x "$folder"/nvidia/*/bin/*
# Intel's compiler looks for its disassembler under this name.
ln -sf libiga64.so.1 "$folder/usr/lib/x86_64-linux-gnu/libiga64.so"
