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
    "arrays", "budget", "child_processes", "colour", "errors", "host_memory", "images",
    "input_files", "layout", "measured", "numpy_files", "output_files", "records", "spectra",
    "spectral_exr", "tev", "text", "transforms", "version",
}  # fmt: skip
RENDERS = BASE | {"scene", "device", "denoise", "render", "formats"}
# What a part may import of the others; itself always. Every part has a row.
MAY_IMPORT = {
    **dict.fromkeys(BASE, BASE),
    "lenses": BASE,
    "scene": BASE | {"lenses"},
    "geometry": BASE | {"scene"},
    "sky": BASE | {"scene"},
    "device": BASE,
    "bvh": BASE | {"device"},
    "denoise": BASE | {"scene", "device"},
    "rays": BASE | {"device", "bvh"},
    "trimesh_ray": BASE | {"device", "rays"},
    "render": BASE | {"lenses", "scene", "geometry", "sky", "device", "bvh", "denoise"},
    "formats": BASE | {"lenses", "geometry", "scene"},
    "mie": BASE | {"scene"},
    "testing": BASE | {"scene", "device", "render"},
    "view": RENDERS,
    "cluster": RENDERS,
    "benchmark": BASE | {"scene", "device", "bvh", "rays", "render", "formats"},
    "cli": RENDERS | {"lenses", "geometry", "mie", "bvh", "view", "cluster", "benchmark"},
    "__main__": {"cli"},
}
OPENCL = {"device", "bvh", "denoise", "rays", "render"}  # only these import pyopencl
# clpt/render/<room>: arrows point down; rooms of one floor do not know each other.
FLOORS = ({"contract"}, {"analysis"}, {"lowering", "codegen"}, {"wavefront"}, {"editing", "film"})
# What kinds share, by what a reader looks for.
SHARED = {
    "colour", "core", "denoising", "film", "guiding", "interface", "lighting", "merging", "optics",
    "path", "spectrum", "texturing", "tracing",
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
    text = path.read_text(encoding="utf-8")
    return imports_of(text, path.relative_to(ROOT).with_suffix("").parts)


def imports_of(text: str, inside: tuple[str, ...]) -> Iterator[tuple[str, list[str]]]:
    """The same of the text of a module; inside: the parts of its full name."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            yield from ((alias.name, []) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            package = ".".join(inside[: len(inside) - node.level]) if node.level else ""
            base = ".".join(part for part in (package, node.module or "") if part)
            yield base, [alias.name for alias in node.names]
        elif isinstance(node, ast.Call) and node.args:
            called = getattr(node.func, "id", getattr(node.func, "attr", ""))
            name = beginning(node.args[0]) if called in ("import_module", "__import__") else ""
            if name:
                yield name, []


def beginning(name: ast.expr) -> str:
    """What is known of a module's name: all of "a.b", "a.b" of f"a.b.{c}", nothing of f"{c}.d"."""
    if isinstance(name, ast.JoinedStr) and name.values:
        return beginning(name.values[0]).rpartition(".")[0]
    return name.value if isinstance(name, ast.Constant) and isinstance(name.value, str) else ""


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


def test_every_part_has_a_row() -> None:
    parts = {p.name.removesuffix(".py") for p in PACKAGE.iterdir() if not p.name.startswith(".")}
    assert parts - {"__init__", "__pycache__", "py.typed"} == MAY_IMPORT.keys()


@pytest.mark.parametrize("path", modules(), ids=lambda p: str(p.relative_to(ROOT)))
def test_imports_follow_the_direction(path: Path) -> None:
    own = part_of(".".join(path.relative_to(ROOT).with_suffix("").parts))
    if own == "__init__":
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


def test_imports_by_name_are_found() -> None:
    text = """
def late():
    import_module("clpt.view.widget")
    importlib.import_module(f"clpt.formats.{kind}").load
    __import__("clpt.tev")
    import_module(f"{here}.read")
    open("clpt.scene")
"""
    found = [name for name, _ in imports_of(text, ("clpt", "one"))]
    assert sorted(found) == ["clpt.formats", "clpt.tev", "clpt.view.widget"]


def import_graph() -> dict[str, set[str]]:
    """The modules of the package that each of them imports, anywhere in it and by name too."""
    paths = module_names()
    graph: dict[str, set[str]] = {}
    for name in sorted(paths):
        taken = [(base, part) for base, parts in statements(paths[name]) for part in parts or [""]]
        targets = {f"{b}.{part}" if f"{b}.{part}" in paths else b for b, part in taken}
        graph[name] = (targets & paths.keys()) - {name}
    return graph


def test_no_modules_import_each_other() -> None:
    """No circle of imports, those inside functions and for type checking included."""
    found = circle(import_graph())
    assert not found, "a circle of imports: " + " -> ".join(found)


def rooms_of(graph: dict[str, set[str]], package: str) -> dict[str, set[str]]:
    """The graph of the folders and modules that are directly in a package."""
    depth = package.count(".") + 2
    rooms: dict[str, set[str]] = {}
    for name in graph:
        if name.startswith(f"{package}."):
            own = ".".join(name.split(".")[:depth])
            inside = [other for other in graph[name] if other.startswith(f"{package}.")]
            rooms.setdefault(own, set()).update(".".join(o.split(".")[:depth]) for o in inside)
    return {room: others - {room} for room, others in rooms.items()}


def test_a_circle_of_folders_is_found() -> None:
    graph = {"p.a.x": {"p.b.x"}, "p.a.y": set(), "p.b.x": set(), "p.b.y": {"p.c"}, "p.c": set()}
    assert not circle(rooms_of(graph, "p"))
    graph["p.c"] = {"p.a.y"}
    assert not circle(graph)
    assert circle(rooms_of(graph, "p")) == ["p.a", "p.b", "p.c", "p.a"]


def test_no_folders_import_each_other() -> None:
    """In each package what its folders and modules import is a graph without circles."""
    graph = import_graph()
    packages = {name.rpartition(".")[0] for name in graph} - {""}
    found = [circle(rooms_of(graph, package)) for package in sorted(packages)]
    assert not any(found), "\n".join(" -> ".join(one) for one in found if one)


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
        "sky",
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
        if not (alias.asname or alias.name).startswith("_")
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
