"""Compilers of three vendors' GPUs: what each says of a program's text.

NVIDIA's OpenCL front end is part of its driver; clang stands for it, and NVIDIA's own assembler
makes the instructions. AMD's is clang. Intel's `ocloc` is Intel's own.
"""

from __future__ import annotations

import dataclasses
import functools
import os
import re
import shutil
import struct
import subprocess
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from clpt.device import native_programs

FOLDER = "GPU_COMPILERS"  # the variable that names where they were unpacked
PLACES = ("usr/lib/llvm-19/bin", "usr/bin", "nvidia/*/bin", "usr/lib/clc")
LANGUAGE = ("-x", "cl", "-cl-std=CL1.2", "-O3", "-w", "-nogpulib")
ROUGHLY = ("-mllvm", "-nvptx-prec-divf32=1", "-Dsqrt=__nvvm_sqrt_approx_f")
SECONDS = 300.0  # after which a compiler counts as hung


class CompilerError(RuntimeError):
    """A compiler refused a text, crashed or took too long."""


@dataclass(frozen=True)
class Figures:
    """What became of a program.

    registers: of 32 bits a work-item; Intel's of 32 bytes a hardware thread. stack: private memory
    [bytes]; spilled: [bytes] a work-item, AMD's and Intel's registers. occupancy: groups of 32 or
    64 work-items at once on a scheduler (NVIDIA: a multiprocessor); Intel's: work-items a hardware
    thread. size: of the instructions [bytes]; memory, arithmetic, special: instructions in the
    text, not how often they run; -1 without a disassembler. seconds: of compilation.
    """

    registers: int
    stack: int
    spilled: int
    occupancy: int
    size: int
    memory: int
    arithmetic: int
    special: int
    seconds: float


@dataclass(frozen=True)
class Vendor:
    """A vendor's compilers; tools: what must be found; compile: of a text, in a folder."""

    name: str
    devices: tuple[str, ...]
    tools: tuple[str, ...]
    compile: Callable[[str, str, Path, tuple[int, ...]], Figures]

    @property
    def missing(self) -> list[str]:
        """What cannot be found."""
        return [name for name in self.tools if find(name) is None]

    def only(self, devices: tuple[str, ...]) -> Vendor:
        """The vendor with these of its devices; all, where none is named."""
        chosen = tuple(name for name in self.devices if not devices or name in devices)
        return dataclasses.replace(self, devices=chosen)

    def figures(self, text: str, device: str, limits: tuple[int, ...] = ()) -> Figures:
        """Compile a text; limits: of registers, to try. Raises CompilerError."""
        with tempfile.TemporaryDirectory() as folder:
            Path(folder, "k.cl").write_text(text, encoding="utf-8")
            return self.compile(text, device, Path(folder), limits)


@functools.lru_cache
def find(name: str) -> Path | None:
    """A compiler or library: of the folder that GPU_COMPILERS names, or installed."""
    for place in PLACES if (root := os.environ.get(FOLDER)) else ():
        for path in sorted(Path(str(root)).glob(f"{place}/{name}")):
            return path
    if name.endswith(".bc"):
        installed = Path("/usr/lib/clc", name)
        return installed if installed.exists() else None
    found_in_path = shutil.which(name) or shutil.which(f"{name}-19")
    return Path(found_in_path) if found_in_path else None


def run(folder: Path, tool: str, *args: str) -> str:
    """Return what a compiler says; raises CompilerError."""
    root = os.environ.get(FOLDER)
    libraries = {"LD_LIBRARY_PATH": f"{root}/usr/lib/x86_64-linux-gnu"} if root else {}
    try:
        done = subprocess.run(
            [str(find(tool)), *args], cwd=folder, env={**os.environ, **libraries}, text=True,
            capture_output=True, timeout=SECONDS, check=False, errors="replace",
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        raise CompilerError(f"{tool} took more than {SECONDS:.0f} s") from None
    said = done.stdout + done.stderr
    if done.returncode:
        raise CompilerError(f"{tool} ended with {done.returncode}: {said.strip()[-600:]}")
    return said


# Instructions in an assembly text, and what they do, by their names.
SASS_NAME = re.compile(r"^\s+/\*[0-9a-f]{4,}\*/\s+(?:@!?U?P\w+ )?\s*(\w+)", re.MULTILINE)
AMD_NAME = re.compile(r"^\s+([vsfgbd]\w+)", re.MULTILINE)
GEN_NAME = re.compile(r"^(?:\([^)]*\))?\s+([a-z]\w*)[\w.]* \(", re.MULTILINE)
SASS = (
    re.compile(r"^(LD[GLS]?|ST[GLS]?|ATOM[GS]?|RED|TEX|TLD|TXQ|SU)$"),
    re.compile(r"^(MUFU)$"),
    re.compile(
        r"^([FHID](ADD|MUL|FMA|MAD|SET|SETP|MNMX|SEL|ABS|CMP|ADD3|SWZADD|CHK|MNMX3)|U?IADD3?"
        r"|U?IMAD|U?ISETP|U?LOP3|U?SHF|U?LEA|SEL|POPC|FLO|BREV|I2F|F2I|F2F|I2I|FRND|PRMT|BMSK|SGXT"
        r"|VABSDIFF|PLOP3|IMNMX|VIADD\w*|VIMNMX|VIADDMNMX|IABS|LOP|SHL|SHR|BFE|BFI|I2FP)$"
    ),
)
AMD = (
    re.compile(r"^(global|flat|buffer|scratch|ds)_"),
    re.compile(r"^v_(s_)?(rcp|rsq|sqrt|exp|log|sin|cos)_"),
    re.compile(r"^v_(?!mov|readlane|readfirstlane|writelane|nop|swap)"),
)
GEN = (
    re.compile(r"^send"),
    re.compile(r"^math"),
    re.compile(
        r"^(add3?|addc|subb?|mul|mac\w*|mach|mad\w*|cmpn?|c?sel|and|or|xor|not|shl|shr|asr|rol|ror"
        r"|bf\w+|lzd|fb[hl]|cbit|frc|rnd\w|avg|dp4a?|bfn|srnd)$"
    ),
)


def counted(names: Iterable[str], kinds: tuple[re.Pattern[str], ...]) -> tuple[int, int, int]:
    """How many instructions are of memory, of arithmetic, of special functions."""
    instructions = Counter(names)
    counts = [0, 0, 0]
    for name, count in instructions.items():
        for number, kind in enumerate(kinds):
            if kind.match(name):
                counts[number] += count
                break
    return counts[0], counts[2], counts[1]


def size_of(elf: bytes, section: str = ".text") -> int:
    """Bytes of an ELF file's sections of instructions."""
    (table,) = struct.unpack_from("<Q", elf, 0x28)
    step, count, names = struct.unpack_from("<HHH", elf, 0x3A)
    heads = [struct.unpack_from("<IIQQQQ", elf, table + step * i) for i in range(count)]
    start = heads[names][4]
    total = 0
    for head in heads:
        name = elf[start + head[0] : elf.index(b"\0", start + head[0])].decode()
        total += head[5] if name == section or name.startswith(f"{section}.") else 0
    return total


# Warps that a multiprocessor has room for; its registers are 65,536, given out in 256s.
WARPS = {"sm_75": 32, "sm_80": 64, "sm_86": 48, "sm_89": 48, "sm_90": 64}


def nvidia(text: str, device: str, folder: Path, limits: tuple[int, ...]) -> Figures:
    """Compile by clang to PTX for the oldest device, and by NVIDIA's assembler for this device.

    Divisions and roots are as exact as OpenCL C asks, 2.5 and 3 ulp: exact operations are calls.
    """
    began = time.perf_counter()
    (folder / "k.ptx").write_text(_ptx(text), encoding="utf-8")

    def build(limit: int) -> tuple[str, tuple[int, int]]:
        limited = ("-maxrregcount", str(limit)) if limit else ()
        out = f"k{limit or ''}.cubin"
        said = run(folder, "ptxas", "-v", "-O3", f"-arch={device}", *limited, "k.ptx", "-o", out)
        (folder / f"{out}.txt").write_text(said, encoding="utf-8")
        return out, native_programs.registers_used(said)

    cubin, _ = native_programs.with_fewest_registers(limits, build)
    seconds = time.perf_counter() - began
    said = (folder / f"{cubin}.txt").read_text(encoding="utf-8")
    counts = (-1, -1, -1)
    if find("nvdisasm"):
        lines = run(folder, "nvdisasm", "-c", cubin)
        counts = counted(SASS_NAME.findall(lines), SASS)
    used, spilled = native_programs.registers_used(said)
    return Figures(
        used,
        most(r"(\d+) bytes stack frame", said),
        spilled,
        min(WARPS[device], 65536 // (256 * -(-used // 8))),
        size_of((folder / cubin).read_bytes()),
        *counts,
        round(seconds, 2),
    )


def fits(text: str, device: str) -> int:
    """Return the fewest registers, in eights, that NVIDIA's assembler needs without spills.

    By default it takes more than it needs; `-cl-nv-maxrregcount` limits a driver.
    """
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "k.ptx").write_text(_ptx(text), encoding="utf-8")
        build = ("ptxas", "-v", "-O3", f"-arch={device}", "k.ptx", "-o", "k.cubin", "-maxrregcount")
        few, enough = 2, 32  # eights
        while few < enough:
            middle = (few + enough) // 2
            said = run(Path(folder), *build, str(min(8 * middle, 255)))
            spills = most(r"(\d+) bytes spill stores", said) > 0
            few, enough = (middle + 1, enough) if spills else (few, middle)
        return 8 * few


@functools.cache
def _ptx(text: str) -> str:
    """PTX of a text, once for all devices."""
    library = str(find("nvptx64--nvidiacl.bc"))
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "k.cl").write_text(text, encoding="utf-8")
        linked = ("-Xclang", "-mlink-builtin-bitcode", "-Xclang", library)
        target = ("-target", "nvptx64-nvidia-nvcl", "-march=sm_75")
        run(
            Path(folder),
            "clang",
            *target,
            *LANGUAGE,
            *ROUGHLY,
            *linked,
            "-S",
            "-o",
            "k.ptx",
            "k.cl",
        )
        return Path(folder, "k.ptx").read_text(encoding="utf-8")


def amd(text: str, device: str, folder: Path, limits: tuple[int, ...]) -> Figures:
    """By clang, whose remarks tell what a kernel takes; the text itself limits registers."""
    began = time.perf_counter()
    library = str(find(f"{device}-amdgcn-mesa-mesa3d.bc"))
    said = run(
        folder, "clang", "-target", "amdgcn-mesa-mesa3d", f"-mcpu={device}", *LANGUAGE,
        "-Xclang", "-mlink-builtin-bitcode", "-Xclang", library,
        "-Rpass-analysis=kernel-resource-usage", "-c", "-o", "k.o", "k.cl",
    )  # fmt: skip
    seconds = time.perf_counter() - began
    counts = (-1, -1, -1)
    if find("llvm-objdump"):
        lines = run(folder, "llvm-objdump", "-d", "--no-show-raw-insn", "k.o")
        counts = counted(AMD_NAME.findall(lines), AMD)
    return Figures(
        most(r"\bVGPRs: (\d+)", said),
        most(r"ScratchSize \[bytes/lane\]: (\d+)", said),
        most(r"VGPRs Spill: (\d+)", said),  # scalars spill to vector registers
        least(r"Occupancy \[waves/SIMD\]: (\d+)", said),
        size_of((folder / "k.o").read_bytes()),
        *counts,
        round(seconds, 2),
    )


def intel(text: str, device: str, folder: Path, limits: tuple[int, ...]) -> Figures:
    """By `ocloc`; what a kernel takes stands in its binary's patch tokens. It takes no limit."""
    began = time.perf_counter()
    options = ("-options", "-cl-std=CL1.2", "-out_dir", "made", "-output", "k")
    said = run(folder, "ocloc", "compile", "-file", "k.cl", "-device", device, *options)
    seconds = time.perf_counter() - began
    (binary,) = (folder / "made").glob("k*.bin")
    run(folder, "ocloc", "disasm", "-file", str(binary), "-device", device, "-dump", "out")
    tokens = (folder / "out" / "PTM.txt").read_text(encoding="utf-8", errors="replace")
    environment, private = words(tokens, 23), words(tokens, 38)
    counts = (-1, -1, -1)
    if assembly := list((folder / "out").glob("*.asm")):
        lines = "".join(path.read_text(errors="replace") for path in assembly)
        counts = counted(GEN_NAME.findall(lines), GEN)
    return Figures(
        max(row[20] for row in environment),
        max((row[3] for row in private), default=0),
        most(r"spilled around (\d+)", said),
        min(row[3] for row in environment),
        most(r"KernelUnpaddedSize (\d+)", tokens),
        *counts,
        round(seconds, 2),
    )


def words(tokens: str, number: int) -> list[list[int]]:
    """The words of a binary's patch tokens of a number, each."""
    rows = re.findall(rf"Token {number}\n\s*4 Size \d+\n\s*Hex ([0-9a-f ]+)", tokens)
    listed = []
    for row in rows:
        data = bytes(int(byte, 16) for byte in row.split())
        listed.append(list(struct.unpack(f"<{len(data) // 4}I", data[: len(data) // 4 * 4])))
    return listed


def most(pattern: str, said: str) -> int:
    """Return the largest number of a compiler's report over kernels; 0 without numbers."""
    return max(map(int, re.findall(pattern, said)), default=0)


def least(pattern: str, said: str) -> int:
    """Return the smallest number of a compiler's report over kernels; 0 without numbers."""
    return min(map(int, re.findall(pattern, said)), default=0)


VENDORS = (
    Vendor(
        "NVIDIA", ("sm_89", "sm_75", "sm_90"), ("clang", "ptxas", "nvptx64--nvidiacl.bc"), nvidia
    ),
    Vendor(
        "AMD", ("gfx1100", "gfx906", "gfx1030"), ("clang", "gfx1100-amdgcn-mesa-mesa3d.bc"), amd
    ),
    Vendor("Intel", ("dg2", "tgllp"), ("ocloc",), intel),
)
