"""The house keeps its shape: who imports whom, what is public, where kernels stand."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest

import clpt

ROOT = Path(__file__).resolve().parents[1]
PACKAGE, KERNELS = ROOT / "clpt", ROOT / "kernels"

BASE = {
    "budget", "child_processes", "colour", "errors", "host_memory", "images", "input_files",
    "layout", "measured", "numpy_files", "output_files", "records", "spectra", "text", "transforms",
    "spectral_exr", "tev", "version",
}  # fmt: skip
# What a part may import of the others; itself always.
MAY_IMPORT = {
    **dict.fromkeys(BASE, BASE),
    "lenses": BASE,
    "geometry": BASE,
    "scene": BASE | {"lenses"},
    "device": BASE,
    "bvh": BASE | {"device"},
    "denoise": BASE | {"scene", "device"},
    "rays": BASE | {"device", "bvh"},
    "trimesh_ray": BASE | {"device", "rays"},
    "render": BASE | {"lenses", "scene", "device", "bvh", "denoise"},
    "formats": BASE | {"lenses", "geometry", "scene"},
    "mie": BASE | {"scene"},
    "view": BASE | {"scene", "device", "denoise", "render", "formats"},
    "benchmark": BASE | {"scene", "device", "bvh", "rays", "render", "formats"},
}
OPENCL = {"device", "bvh", "denoise", "rays", "render"}  # only these import pyopencl
# clpt/render/<room>: arrows point down; rooms of one floor do not know each other.
FLOORS = ({"contract"}, {"lowering", "codegen"}, {"wavefront"}, {"editing", "film"})
# What kinds share, by what a reader looks for.
SHARED = {
    "colour", "core", "denoising", "film", "guiding", "interface", "lighting", "media", "merging",
    "optics", "path", "spectrum", "steps", "surface", "texturing", "tracing",
}  # fmt: skip
KINDS = {"bsdf", "phase", "camera", "emission", "light", "medium", "sampler", "shape", "texture"}
# kernels/<folder>: the folders that its files may include; generated text stands between them.
MAY_INCLUDE = {
    **dict.fromkeys(SHARED, SHARED | {"generated", "bvh"}),
    **dict.fromkeys(KINDS, SHARED),
    "integrator": SHARED | {"generated"},
    "bvh": {"bvh", "core", "generated", "tracing"},
    "motion": {"core", "generated", "bvh"},
    "stage": SHARED | {"generated", "bvh"},
}


def modules() -> list[Path]:
    """The Python files of the package."""
    return sorted(PACKAGE.rglob("*.py"))


def statements(path: Path) -> Iterator[tuple[str, list[str]]]:
    """The imports of a file, anywhere in it: a module's full name, and the names taken from it."""
    inside = path.relative_to(ROOT).with_suffix("").parts
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((alias.name, []) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            package = ".".join(inside[: len(inside) - node.level]) if node.level else ""
            base = ".".join(part for part in (package, node.module or "") if part)
            yield base, [alias.name for alias in node.names]


def imports(path: Path) -> set[str]:
    """The modules that a file imports, anywhere in it, with full names."""
    return {
        name
        for base, taken in statements(path)
        for name in (base, *(f"{base}.{part}" for part in taken))
    }


def module_names() -> dict[str, Path]:
    """The modules of the package by their full names; a package is its __init__."""
    names = {".".join(path.relative_to(ROOT).with_suffix("").parts): path for path in modules()}
    return {name.removesuffix(".__init__"): path for name, path in names.items()}


def circle(graph: dict[str, set[str]]) -> list[str]:
    """A circle of a graph, its first node again at the end; empty if there is none."""
    done: set[str] = set()
    for start in graph:
        path: list[str] = []
        open_ = [iter([start])]
        while open_:
            if (node := next(open_[-1], None)) is None:
                open_.pop()
                done |= set(path[-1:])
                del path[-1:]
            elif node in path:
                return [*path[path.index(node) :], node]
            elif node not in done:
                path.append(node)
                open_.append(iter(sorted(graph[node])))
    return []


def part_of(name: str) -> str | None:
    """The part of clpt that a full name belongs to: "render" of clpt.render.lowering.scene."""
    parts = name.split(".")
    return parts[1] if parts[0] == "clpt" and len(parts) > 1 else None


@pytest.mark.parametrize("path", modules(), ids=lambda p: str(p.relative_to(ROOT)))
def test_imports_follow_the_direction(path: Path) -> None:
    own = part_of(".".join(path.relative_to(ROOT).with_suffix("").parts))
    if own not in MAY_IMPORT:
        return
    parts = {p.name.removesuffix(".py") for p in PACKAGE.iterdir()}
    found = {part_of(name) for name in imports(path)} & parts
    wrong = found - MAY_IMPORT[own] - {own, None}
    assert not wrong, f"{own} imports {', '.join(sorted(wrong))}"


@pytest.mark.parametrize("path", modules(), ids=lambda p: str(p.relative_to(ROOT)))
def test_rooms_of_render_know_only_lower_floors(path: Path) -> None:
    parts = path.relative_to(ROOT).with_suffix("").parts
    rooms = [room for floor in FLOORS for room in floor]
    if parts[:2] != ("clpt", "render") or parts[2] not in rooms:
        return
    own = next(i for i, floor in enumerate(FLOORS) if parts[2] in floor)
    known = {parts[2]}.union(*FLOORS[:own])
    found = {name.split(".")[2] for name in imports(path) if name.startswith("clpt.render.")}
    assert not found - known, f"{parts[2]} imports {', '.join(sorted(found - known))}"


def test_a_circle_is_found() -> None:
    assert circle({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == []
    assert circle({"a": {"b"}, "b": {"c", "d"}, "c": set(), "d": {"b"}}) == ["b", "d", "b"]


def test_no_modules_import_each_other() -> None:
    """No circle of imports, those inside functions and for type checking included."""
    paths = module_names()
    graph: dict[str, set[str]] = {}
    for name in sorted(paths):
        taken = [(base, part) for base, parts in statements(paths[name]) for part in parts or [""]]
        targets = {f"{b}.{part}" if f"{b}.{part}" in paths else b for b, part in taken}
        graph[name] = targets & paths.keys()
    assert not circle(graph), "a circle of imports: " + " -> ".join(circle(graph))


@pytest.mark.parametrize("path", modules(), ids=lambda p: str(p.relative_to(ROOT)))
def test_who_imports_pyopencl(path: Path) -> None:
    own = part_of(".".join(path.relative_to(ROOT).with_suffix("").parts))
    if own not in OPENCL:
        assert not any(name.split(".")[0] == "pyopencl" for name in imports(path))


@pytest.mark.parametrize(
    "name",
    [
        "scene",
        "lenses",
        "geometry",
        "formats",
        "spectra",
        "layout",
        "transforms",
        "images",
        "spectral_exr",
    ],
)
def test_data_does_not_need_opencl(name: str) -> None:
    """No chain of imports leads from plain data to pyopencl."""
    seen: set[str] = set()
    open_ = [f"clpt.{name}"]
    while open_:
        module = open_.pop()
        if module in seen or module == "clpt":
            continue
        seen.add(module)
        base = ROOT.joinpath(*module.split("."))
        path = base / "__init__.py" if base.is_dir() else base.with_suffix(".py")
        if path.is_file():
            open_ += [m for m in imports(path) if m.split(".")[0] in ("clpt", "pyopencl")]
    assert not any(m.split(".")[0] == "pyopencl" for m in seen)


@pytest.mark.parametrize("path", modules(), ids=lambda p: str(p.relative_to(ROOT)))
def test_the_library_never_prints(path: Path) -> None:
    if "cli" in path.parts or path.name == "__main__.py" or path.name.startswith("make_"):
        return
    calls = [
        n for n in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if isinstance(n, ast.Call)
    ]
    assert not any(isinstance(c.func, ast.Name) and c.func.id == "print" for c in calls)


def test_public_names() -> None:
    """`__all__` is sorted, names what is there, and all that the front page imports on purpose."""
    assert clpt.__all__ == sorted(clpt.__all__)
    assert len(set(clpt.__all__)) == len(clpt.__all__)
    tree = ast.parse((PACKAGE / "__init__.py").read_text(encoding="utf-8"))
    imported = {
        alias.asname or alias.name
        for node in tree.body
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("clpt")
        for alias in node.names
    }
    assert set(clpt.__all__) == imported | {"__version__"}
    for name in clpt.__all__:
        assert hasattr(clpt, name)
        assert getattr(clpt, name).__doc__ or name == "__version__"


def kernel_files() -> list[Path]:
    """The OpenCL files."""
    return sorted(KERNELS.rglob("*.cl"))


@pytest.mark.parametrize("path", kernel_files(), ids=lambda p: str(p.relative_to(KERNELS)))
def test_kernel_files(path: Path) -> None:
    """A comment first; includes in their direction; kernels only in stage/, motion/ and bvh/."""
    text = path.read_text(encoding="utf-8")
    assert text.startswith("/*"), "a kernel file begins with what it is for"
    folder = path.relative_to(KERNELS).parts[0]
    included = {name.split("/")[0] for name in re.findall(r'#include "([^"]+)"', text)}
    wrong = included - MAY_INCLUDE[folder]
    assert not wrong, f"{folder}/ includes {', '.join(sorted(wrong))}/"
    if re.search(r"\bkernel void\b", text):
        assert folder in ("stage", "bvh", "motion")
    code = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
    if folder in KINDS | {"integrator"}:
        assert "#pragma" not in code
    assert "double" not in re.findall(r"\w+", code)
    in_memory = re.findall(r"global\s+(?:const\s+)?(\w+)\s*\*", code)
    assert not {"float3", "int3", "uint3", "bool", "size_t"} & set(in_memory)


@pytest.mark.parametrize("path", kernel_files(), ids=lambda p: str(p.relative_to(KERNELS)))
def test_comments_of_kernels_name_what_exists(path: Path) -> None:
    """Kernel files as `folder/file.cl`, others by their path, modules by their full name."""
    comments = " ".join(re.findall(r"/\*.*?\*/", path.read_text(encoding="utf-8"), re.DOTALL))
    for name in re.findall(r"(?<![\w/<>*])[\w/]+\.cl\b", comments):
        file = KERNELS / name.removeprefix("kernels/")
        assert file.is_file() or name.startswith("generated/"), name
    for name in re.findall(r"\b(?:clpt|tests|bench|docs)/[\w/]+\.\w+", comments):
        assert (ROOT / name).is_file(), name
    for name in re.findall(r"\bclpt(?:\.\w+)+", comments):
        module = ROOT.joinpath(*name.split("."))
        inside = module.parent.with_suffix(".py")  # of a module: the name that it must have
        there = module.is_dir() or module.with_suffix(".py").is_file()
        assert there or re.search(rf"\b{module.name}\b", inside.read_text("utf-8")), name


@pytest.mark.parametrize("path", kernel_files(), ids=lambda p: str(p.relative_to(KERNELS)))
def test_lines_of_kernels(path: Path) -> None:
    """120 columns at most; the backslashes of a macro stand below each other."""
    lines = path.read_text(encoding="utf-8").splitlines()
    assert max(map(len, lines)) <= 120
    for line, after in pairwise(lines):
        if line.endswith("\\") and after.endswith("\\"):
            assert len(line) == len(after), after


@pytest.mark.parametrize("path", modules(), ids=lambda p: str(p.relative_to(PACKAGE)))
def test_nobody_changes_the_filters_of_warnings(path: Path) -> None:
    """They belong to the whole process: another thread's warning would become an error."""
    assert "warnings" not in imports(path)
