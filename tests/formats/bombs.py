"""Small files that ask for much, and a process of its own that reads them within limits.

A generator of BOMBS writes its files into a folder and returns the one to load. `python -m
tests.formats.bombs FILE` loads a file and prints what came of it, as JSON.
"""

from __future__ import annotations

import gzip
import io
import json
import os
import resource
import struct
import subprocess
import sys
import time
import zipfile
import zlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
MEMORY, SECONDS = 1 << 30, 10  # what reading one may take, of the processor
GIGA = 1 << 30
Bomb = Callable[[Path], Path]


def _xml(folder: Path, body: str, name: str = "bomb.xml") -> Path:
    return _text(folder / name, f'<scene version="3.0.0">{body}</scene>')


def _text(path: Path, content: str) -> Path:
    path.write_text(content)
    return path


def _bytes(path: Path, content: bytes) -> Path:
    path.write_bytes(content)
    return path


def _json(folder: Path, **parts: Any) -> Path:
    base = {"camera": {"type": "perspective"}, "film": {"width": 8, "height": 8}}
    return _text(folder / "bomb.json", json.dumps({**base, **parts}))


def _pbrt(folder: Path, body: str) -> Path:
    return _text(folder / "bomb.pbrt", f"WorldBegin\n{body}")


# Mitsuba


def xml_defaults(folder: Path) -> Path:
    """Values of variables that double, then many that each hold the longest one."""
    values = ["x" * 64, *(f"$a{i}$a{i}" for i in range(17))]
    doubled = "".join(f'<default name="a{i}" value="{one}"/>' for i, one in enumerate(values))
    return _xml(
        folder, doubled + "".join(f'<default name="b{i}" value="${{a17}}{i}"/>' for i in range(900))
    )


def xml_long_variable(folder: Path) -> Path:
    """A long word behind $ whose beginnings are all looked up."""
    return _xml(folder, '<default name="a" value="1"/><string name="$' + "b" * 3_000_000 + '"/>')


def xml_includes(folder: Path) -> Path:
    """Files that include the next one several times."""
    for i in range(14):
        _xml(folder, f'<include filename="i{i + 1}.xml"/>' * 8, f"i{i}.xml")
    _xml(folder, "", "i14.xml")
    return _xml(folder, '<include filename="i0.xml"/>')


def xml_same_include(folder: Path) -> Path:
    """One file of many shapes, included often."""
    _xml(folder, '<shape type="sphere"/>' * 2000, "many.xml")
    return _xml(folder, '<include filename="many.xml"/>' * 3000)


def xml_references(folder: Path) -> Path:
    """Materials that each hold the one before twice."""
    made = ['<bsdf type="diffuse" id="d0"/>']
    made += [
        f'<bsdf type="blendbsdf" id="d{i}"><float name="weight" value="0.5"/>'
        f'<ref id="d{i - 1}"/><ref id="d{i - 1}"/></bsdf>'
        for i in range(1, 60)
    ]
    return _xml(folder, "".join(made) + '<shape type="sphere"><ref id="d59"/></shape>')


def xml_serialized(folder: Path) -> Path:
    """A mesh of zeros that deflate has packed to a thousandth."""
    count = 60_000_000
    pack = zlib.compressobj(9)
    head = struct.pack("<I", 0x1000) + b"a mesh\0" + struct.pack("<QQ", count, 1)
    body = pack.compress(head) + b"".join(pack.compress(bytes(1 << 22)) for _ in range(175))
    mesh = struct.pack("<HH", 0x041C, 4) + body + pack.flush()
    _bytes(folder / "zeros.serialized", mesh + struct.pack("<QI", 0, 1))
    return _xml(
        folder,
        '<shape type="serialized"><string name="filename" value="zeros.serialized"/></shape>',
    )


def xml_same_mesh(folder: Path) -> Path:
    """One file of a mesh, read for each of many shapes."""
    points = "".join(f"v {i} {i % 7} 0\n" for i in range(20_000))
    faces = "".join(f"f {i} {i + 1} {i + 2}\n" for i in range(1, 19_998))
    _text(folder / "m.obj", points + faces)
    shape = '<shape type="obj"><string name="filename" value="m.obj"/></shape>'
    return _xml(folder, shape * 5000)


# pbrt


def pbrt_textures(folder: Path) -> Path:
    """Textures that each hold the one before twice."""
    mixes = "".join(
        f'Texture "t{i}" "spectrum" "mix" "texture tex1" "t{i - 1}" "texture tex2" "t{i - 1}"\n'
        for i in range(1, 60)
    )
    return _pbrt(
        folder,
        f'Texture "t0" "spectrum" "constant" "rgb value" [1 1 1]\n{mixes}'
        'Material "diffuse" "texture reflectance" "t59"\nShape "sphere"\n',
    )


def pbrt_materials(folder: Path) -> Path:
    """Materials that each hold the one before twice."""
    mixes = "".join(
        f'MakeNamedMaterial "m{i}" "string type" "mix" "string materials" '
        f'["m{i - 1}" "m{i - 1}"] "float amount" [.5]\n'
        for i in range(1, 60)
    )
    return _pbrt(
        folder,
        f'MakeNamedMaterial "m0" "string type" "diffuse"\n{mixes}NamedMaterial "m59"\n'
        'Shape "sphere"\n',
    )


def pbrt_chain(folder: Path) -> Path:
    """Textures in each other, many deep."""
    scales = "".join(
        f'Texture "t{i}" "float" "scale" "texture tex" "t{i - 1}" "float scale" 0.5\n'
        for i in range(1, 2000)
    )
    return _pbrt(
        folder,
        f'Texture "t0" "float" "fbm"\n{scales}'
        'Material "diffuse" "texture displacement" "t1999"\nShape "sphere"\n',
    )


def pbrt_includes(folder: Path) -> Path:
    """Files that include the next one several times."""
    for i in range(24):
        _text(folder / f"{i}.pbrt", f'Include "{i + 1}.pbrt"\n' * 4)
    _text(folder / "24.pbrt", 'Shape "sphere"\n')
    return _pbrt(folder, 'Include "0.pbrt"')


def pbrt_numbers(folder: Path) -> Path:
    """One file of many numbers, included often."""
    _text(folder / "n.pbrt", 'Shape "sphere" "float none" [' + "0 " * 1_000_000 + "]\n")
    return _pbrt(folder, 'Include "n.pbrt"\n' * 2000)


def pbrt_gzip(folder: Path) -> Path:
    """Blanks that gzip has packed to a thousandth."""
    file = io.BytesIO()
    with gzip.GzipFile(fileobj=file, mode="wb") as stream:
        for _ in range(500):
            stream.write(b" " * (1 << 21))
    return _bytes(folder / "bomb.pbrt.gz", file.getvalue())


def pbrt_gzip_that_lies(folder: Path) -> Path:
    """The same in two members, of which the last tells a small size."""
    pbrt_gzip(folder)
    data = (folder / "bomb.pbrt.gz").read_bytes()
    return _bytes(folder / "bomb.pbrt.gz", data + gzip.compress(b"\n"))


def pbrt_subdivision(folder: Path) -> Path:
    """Many triangles, ten times subdivided."""
    points = " ".join(f"{i} {i % 7} {i % 3}" for i in range(3000))
    faces = " ".join(f"{i} {i + 1} {i + 2}" for i in range(2998))
    levels = '"integer levels" 10'
    shape = f'Shape "loopsubdiv" {levels} "point3 P" [{points}] "integer indices" [{faces}]\n'
    return _pbrt(folder, shape)


# scene.json


def json_blends(folder: Path) -> Path:
    """Materials that each hold the one before twice."""
    made: dict[str, Any] = {"m0": {"type": "diffuse"}}
    for i in range(1, 60):
        pair = {"first": f"m{i - 1}", "second": f"m{i - 1}"}
        made[f"m{i}"] = {"type": "blend", "weight": 0.5, **pair}
    return _json(folder, materials=made, shapes=[{"type": "rectangle", "material": "m59"}])


def json_nested(folder: Path) -> Path:
    """Lists in lists, many deep."""
    return _text(folder / "bomb.json", '{"camera": ' + "[" * 200_000)


def json_nested_materials(folder: Path) -> Path:
    """Materials in each other, written out, as deep as JSON is read."""
    made: dict[str, Any] = {"type": "diffuse"}
    for _ in range(180):
        made = {"type": "mask", "material": made}
    return _json(folder, shapes=[{"type": "rectangle", "material": made}])


def _metal(folder: Path, page: str) -> Path:
    _text(folder / "metal.yml", page)
    metal = {"type": "conductor", "metal": {"file": "metal.yml"}}
    return _json(folder, shapes=[{"type": "rectangle", "material": metal}])


def yaml_aliases(folder: Path) -> Path:
    """Lists that each hold the one before nine times."""
    lists = "".join(f"a{i}: &a{i} [{','.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 9))
    return _metal(folder, f"a0: &a0 [x,x,x,x,x,x,x,x,x]\n{lists}DATA:\n  - type: *a8\n")


def yaml_nested(folder: Path) -> Path:
    """Lists in lists, many deep."""
    return _metal(folder, "DATA: " + "[" * 5000)


def _spheres(folder: Path) -> Path:
    return _json(folder, shapes=[{"type": "spheres", "file": "s.npz"}])


def npz_zeros(folder: Path) -> Path:
    """Arrays of zeros that deflate has packed to a thousandth."""
    head = io.BytesIO()
    shape = {"descr": "<f4", "fortran_order": False, "shape": (GIGA // 12, 3)}
    np.lib.format.write_array_header_1_0(head, shape)
    with (
        zipfile.ZipFile(folder / "s.npz", "w", zipfile.ZIP_DEFLATED) as made,
        made.open("centers.npy", "w", force_zip64=True) as member,
    ):
        member.write(head.getvalue())
        for _ in range(256):
            member.write(bytes(1 << 22))
    return _spheres(folder)


def npz_header(folder: Path) -> Path:
    """An array whose header tells of more than there is."""
    head = io.BytesIO()
    shape = {"descr": "<f8", "fortran_order": False, "shape": (1 << 40, 3)}
    np.lib.format.write_array_header_1_0(head, shape)
    with zipfile.ZipFile(folder / "s.npz", "w") as made:
        made.writestr("centers.npy", head.getvalue())
    return _spheres(folder)


def png_header(folder: Path) -> Path:
    """An image of 16 bits whose header tells of 177 million pixels."""

    def chunk(name: bytes, data: bytes) -> bytes:
        check = struct.pack(">I", zlib.crc32(name + data))
        return struct.pack(">I", len(data)) + name + data + check

    head = chunk(b"IHDR", struct.pack(">2I5B", 13_300, 13_300, 16, 2, 0, 0, 0))
    rows = chunk(b"IDAT", zlib.compress(bytes(1 << 20)))
    _bytes(folder / "wood.png", b"\x89PNG\r\n\x1a\n" + head + rows + chunk(b"IEND", b""))
    wood = {"type": "diffuse", "reflectance": {"type": "bitmap", "image": "wood.png"}}
    return _json(folder, shapes=[{"type": "rectangle", "material": wood}])


# glTF


def _gltf(folder: Path, **parts: Any) -> Path:
    base = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}]}
    return _text(folder / "bomb.gltf", json.dumps({**base, "nodes": [{"mesh": 0}], **parts}))


def _without_data(count: int, kind: str = "VEC3") -> dict[str, Any]:
    return {"componentType": 5126, "count": count, "type": kind}


def gltf_accessors(folder: Path) -> Path:
    """Accessors without data, each below any limit of one."""
    primitives = [{"attributes": {"POSITION": i}} for i in range(40)]
    accessors = [_without_data(30_000_000)] * 40
    return _gltf(folder, meshes=[{"primitives": primitives}], accessors=accessors)


def gltf_shared_accessor(folder: Path) -> Path:
    """One accessor without data, of many primitives."""
    primitives = [{"attributes": {"POSITION": 0}} for _ in range(5000)]
    return _gltf(folder, meshes=[{"primitives": primitives}], accessors=[_without_data(300_000)])


def gltf_targets(folder: Path) -> Path:
    """One accessor without data, of many morph targets."""
    targets = [{"POSITION": 0}] * 20_000
    mesh = {
        "primitives": [{"attributes": {"POSITION": 0}, "targets": targets}],
        "weights": [1] * 20_000,
    }
    return _gltf(folder, meshes=[mesh], accessors=[_without_data(3_000_000)])


def gltf_instances(folder: Path) -> Path:
    """A billion copies, whose places are an accessor without data."""
    placed = {"attributes": {"TRANSLATION": 1}}
    node = {"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": placed}}
    data = "data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"
    return _gltf(
        folder,
        nodes=[node],
        extensionsUsed=["EXT_mesh_gpu_instancing"],
        meshes=[{"primitives": [{"attributes": {"POSITION": 0}}]}],
        buffers=[{"byteLength": 36, "uri": data}],
        bufferViews=[{"buffer": 0, "byteLength": 36}],
        accessors=[{**_without_data(3), "bufferView": 0}, _without_data(1 << 30)],
    )


def gltf_copies(folder: Path) -> Path:
    """Many nodes that each show a mesh of many primitives."""
    data = "data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"
    count = 3000
    return _gltf(
        folder,
        scenes=[{"nodes": list(range(count))}],
        nodes=[{"mesh": 0}] * count,
        meshes=[{"primitives": [{"attributes": {"POSITION": 0}}] * count}],
        buffers=[{"byteLength": 36, "uri": data}],
        bufferViews=[{"buffer": 0, "byteLength": 36}],
        accessors=[{**_without_data(3), "bufferView": 0}],
    )


def gltf_draco(folder: Path, method: int = 1) -> Path:
    """A mesh of Draco's whose head tells of a billion triangles."""
    huge = b"\x80\x80\x80\x80\x04"
    head = b"DRACO\x02\x02\x01" + bytes([method]) + b"\0\0"
    data = head + (b"\0" + huge * 2 if method else huge * 2) + bytes(64)
    _bytes(folder / "m.bin", data)
    packed = {"bufferView": 0, "attributes": {"POSITION": 0}}
    primitive = {
        "attributes": {"POSITION": 0},
        "extensions": {"KHR_draco_mesh_compression": packed},
    }
    return _gltf(
        folder,
        extensionsUsed=["KHR_draco_mesh_compression"],
        meshes=[{"primitives": [primitive]}],
        buffers=[{"byteLength": len(data), "uri": "m.bin"}],
        bufferViews=[{"buffer": 0, "byteLength": len(data)}],
        accessors=[_without_data(3)],
    )


def gltf_draco_sequential(folder: Path) -> Path:
    """The same, of Draco's other method."""
    return gltf_draco(folder, 0)


def gltf_meshopt(folder: Path) -> Path:
    """A view that tells of a gigabyte of vertices in few bytes."""
    count, stride = 1 << 26, 16
    blocks = count // 256
    stream = b"\xa1" + b"\xaa" * (blocks * stride // 4) + bytes(stride + stride // 4)
    _bytes(folder / "m.bin", stream)
    packed = {
        "buffer": 0, "byteLength": len(stream), "byteStride": stride, "count": count,
        "mode": "ATTRIBUTES",
    }  # fmt: skip
    view = {
        "buffer": 1,
        "byteLength": count * stride,
        "byteStride": stride,
        "extensions": {"EXT_meshopt_compression": packed},
    }
    return _gltf(
        folder,
        extensionsUsed=["EXT_meshopt_compression"],
        meshes=[{"primitives": [{"attributes": {"POSITION": 0}}]}],
        buffers=[{"byteLength": len(stream), "uri": "m.bin"}, {"byteLength": count * stride}],
        bufferViews=[view],
        accessors=[{**_without_data(count), "bufferView": 0}],
    )


# Meshes and densities


def ply_gzip(folder: Path) -> Path:
    """A mesh of zeros that gzip has packed to a thousandth."""
    head = (
        "ply\nformat binary_little_endian 1.0\nelement vertex 90000000\nproperty float x\n"
        "property float y\nproperty float z\nelement face 0\n"
        "property list uchar int vertex_indices\nend_header\n"
    )
    file = io.BytesIO()
    with gzip.GzipFile(fileobj=file, mode="wb") as stream:
        stream.write(head.encode())
        for _ in range(515):
            stream.write(bytes(1 << 21))
    return _bytes(folder / "bomb.ply", file.getvalue())


def ply_count(folder: Path) -> Path:
    """A head that tells of ten billion vertices."""
    return _text(
        folder / "bomb.ply",
        "ply\nformat ascii 1.0\nelement vertex 10000000000\nproperty float x\nproperty float y\n"
        "property float z\nelement face 10000000000\nproperty list uchar int vertex_indices\n"
        "end_header\n0 0 0\n",
    )


def stl_count(folder: Path) -> Path:
    """A head that tells of four billion triangles."""
    return _bytes(folder / "bomb.stl", bytes(80) + b"\xff\xff\xff\xff" + bytes(500))


def off_count(folder: Path) -> Path:
    """A head that tells of two billion vertices and faces."""
    return _text(folder / "bomb.off", "OFF\n2000000000 2000000000 0\n0 0 0\n")


def nvdb_box(folder: Path) -> Path:
    """A small grid that tells of a large box."""
    from tests.formats.test_volumes import GRID, ROOT, file_bytes

    data = bytearray(GRID)
    struct.pack_into("<6i", data, ROOT, 0, 0, 0, 1023, 1023, 1023)
    return _bytes(folder / "bomb.nvdb", file_bytes({"density": bytes(data)}))


def nvdb_packed(folder: Path) -> Path:
    """A grid of zeros that deflate has packed to a thousandth."""
    from tests.formats.test_volumes import file_bytes

    return _bytes(folder / "bomb.nvdb", file_bytes({"density": bytes(700 << 20)}, codec=1))


def vol_size(folder: Path) -> Path:
    """A head that tells of a large box."""
    head = struct.pack("<3sB5i6f", b"VOL", 3, 1, 30_000, 30_000, 30_000, 1, 0, 0, 0, 1, 1, 1)
    return _bytes(folder / "bomb.vol", head + bytes(64))


BOMBS: dict[str, Bomb] = {
    bomb.__name__: bomb
    for bomb in (
        xml_defaults, xml_long_variable, xml_includes, xml_same_include, xml_references,
        xml_serialized, xml_same_mesh, pbrt_textures, pbrt_materials, pbrt_chain, pbrt_includes,
        pbrt_numbers, pbrt_gzip, pbrt_gzip_that_lies, pbrt_subdivision, json_blends, json_nested,
        json_nested_materials, yaml_aliases, yaml_nested, npz_zeros, npz_header, png_header,
        gltf_accessors, gltf_shared_accessor, gltf_targets, gltf_instances, gltf_copies, gltf_draco,
        gltf_draco_sequential, gltf_meshopt, ply_gzip, ply_count, stl_count, off_count, nvdb_box,
        nvdb_packed, vol_size,
    )
}  # fmt: skip


def read_within(files: Sequence[Path], memory: int = MEMORY, seconds: int = SECONDS) -> list[Any]:
    """Return what came of each file, read and lowered in a process that has so much.

    memory: [bytes] above what the process has before; seconds: of the processor.
    """
    command = [sys.executable, "-m", "tests.formats.bombs", str(memory), str(seconds)]
    # One thread of each library's pool: their stacks count as memory.
    single = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        [*command, *map(str, files)],
        cwd=ROOT,
        env={**os.environ, **single},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return [json.loads(line) for line in done.stdout.splitlines()]


def _one(path: Path, memory: int, seconds: int) -> dict[str, Any]:
    """Load a file in a fork of this process."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        with os.fdopen(writing, "w") as out:
            out.write(json.dumps(_result(path, memory, seconds)))
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading) as told:
        text = told.read()
    _, status, used = os.wait4(child, 0)
    made = json.loads(text) if text else {"kind": f"status {status}", "message": ""}
    return {
        "file": path.name,
        **made,
        "mebibytes": used.ru_maxrss >> 10,
        "seconds": round(used.ru_utime + used.ru_stime, 2),
    }


def _result(path: Path, memory: int, seconds: int) -> dict[str, str]:
    import clpt
    from clpt.render.flow.scene_to_tables import lower

    pages = int(Path("/proc/self/statm").read_text().split()[0])
    have = pages * os.sysconf("SC_PAGE_SIZE")
    resource.setrlimit(resource.RLIMIT_AS, (have + memory,) * 2)
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 1))
    try:
        lower(clpt.load(path))
    except BaseException as error:
        return {"kind": type(error).__name__, "message": str(error)}
    return {"kind": "", "message": ""}


def main() -> None:
    """Read the files that are named, each in a process of its own."""
    import clpt.formats.framing
    import clpt.formats.gltf
    import clpt.formats.mitsuba
    import clpt.formats.native
    import clpt.formats.pbrt.scenes
    import clpt.render.flow.scene_to_tables  # noqa: F401

    memory, seconds = map(int, sys.argv[1:3])
    for name in sys.argv[3:]:
        began = time.perf_counter()
        made = _one(Path(name), memory, seconds)
        print(json.dumps({**made, "elapsed": round(time.perf_counter() - began, 2)}), flush=True)


if __name__ == "__main__":
    main()
