"""The house keeps its shape: who imports whom, what is public, where kernels stand.

Each rule is one test. It fails with every place that breaks the rule, and what to do there.
"""

from __future__ import annotations

import ast
import importlib
import importlib.util
import re
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from itertools import pairwise
from pathlib import Path

import pytest

import clpt
from bench import imports as graphs
from bench.python_files import full_name, read
from clpt.records import constant_files

ROOT = Path(__file__).resolve().parents[1]
PACKAGE, KERNELS = ROOT / "clpt", ROOT / "kernels"

BASE = {
    "arrays", "choices", "errors", "files", "images", "measured", "records",
    "spectra", "transforms", "version",
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
    "render": RENDERS | {"lenses", "geometry", "sky", "bvh"},
    "formats": BASE | {"lenses", "geometry", "scene"},
    "mie": BASE | {"scene"},
    "testing": BASE | {"scene", "device", "render"},
    "instruments": RENDERS | {"geometry"},
    "dataset": RENDERS,
    "view": RENDERS,
    "cluster": RENDERS,
    "bench": BASE | {"scene", "device", "bvh", "rays", "render", "formats"},
    "cli": RENDERS
    | {"lenses", "geometry", "mie", "bvh", "view", "cluster", "bench", "instruments"},
    "__main__": {"cli"},
}
OPENCL = {"device", "bvh", "denoise", "rays", "render"}  # only these import pyopencl
# clpt/render/<room>: arrows point down; rooms of one floor do not know each other.
FLOORS = (
    {"records", "options"}, {"camera", "film", "motion"}, {"scene_index"}, {"spectra"},
    {"textures"}, {"materials"}, {"geometry"}, {"lights"}, {"media"}, {"transport"}, {"flow"},
    {"wavefront"}, {"edit", "trials"}, {"makers"},
)  # fmt: skip
# clpt/cli/<room>: the same; commands stand on top of all.
FLOORS_OF_COMMANDS = (
    {"process"}, {"display", "console", "options"}, {"opening"}, {"files"}, {"plots"},
    {"render", "view"},
)  # fmt: skip
# What kinds share, by what a reader looks for.
SHARED = {
    "cameras", "core", "film", "integrator/steps", "lights", "materials", "media", "motion",
    "samplers", "shapes", "spectra", "textures", "tracing", "transport", "transport/guiding",
    "transport/photons",
}  # fmt: skip
SCRIPTS = ("scenes", "examples", "docs", "bench", "packaging")
KINDS = {
    "cameras/kinds", "lights/kinds", "materials/kinds", "media/kinds",
    "samplers/kinds", "shapes/kinds", "textures/kinds",
}  # fmt: skip
# kernels/<folder>: the folders that its files may include; generated text stands between them.
MAY_INCLUDE = {
    **dict.fromkeys(SHARED, SHARED | {"generated", "bvh"}),
    **dict.fromkeys(KINDS, SHARED),
    "integrator": SHARED | {"generated"},
    "bvh": {"bvh", "core", "generated", "tracing"},
    "stage": SHARED | {"generated", "bvh", "stage"},  # the loop is made of bounces
}
HAVE_KERNELS = {"stage", "bvh"}
NOT_IN_MEMORY = {"float3", "int3", "uint3", "bool", "size_t"}
# Names of kernel files, of other files of the repository, and of modules.
NAMED = r"(?<![\w/<>*])[\w/]+\.cl\b|\b(?:clpt|tests|bench|docs)/[\w/]+\.\w+|\bclpt(?:\.\w+)+"
# Modules from whose imports, at whatever distance, none leads to pyopencl.
PLAIN = (
    "scene", "lenses", "geometry", "sky", "formats", "spectra", "layout", "transforms", "images",
)  # fmt: skip


def modules() -> list[Path]:
    """The Python files of the package."""
    return sorted(PACKAGE.rglob("*.py"))


def kernel_files() -> list[Path]:
    """The OpenCL files."""
    return sorted(KERNELS.rglob("*.cl"))


def keep(rule: str, broken: Iterable[str]) -> None:
    """Fail with all places where a rule is broken; rule: also says what to do."""
    if places := list(broken):
        pytest.fail("\n  ".join([f"{rule}. Broken {len(places)} times:", *places]), pytrace=False)


def imports(path: Path) -> Iterator[tuple[str, str]]:
    """The modules that a file imports, anywhere in it, with full names; each with its place."""
    for name, line in graphs.imports(path).items():
        yield name, f"{path.relative_to(ROOT)}:{line}"


def kernels(broken: Callable[[str, str], Iterable[tuple[int, str]]]) -> Iterator[str]:
    """Ask each kernel file, by its folder and text, for positions of what is wrong, and what."""
    for path in kernel_files():
        text = path.read_text(encoding="utf-8")
        for position, wrong in broken(folder_of(path.relative_to(KERNELS).as_posix()), text):
            line = text.count("\n", 0, position) + 1
            yield f"{path.relative_to(ROOT)}:{line}: {wrong}"


def folder_of(name: str) -> str:
    """The folder of a kernel file: "lights/kinds" of lights/kinds/spot.cl; "generated" has one."""
    folder = name.rpartition("/")[0]
    return "generated" if folder.startswith("generated") else folder


def part_of(name: str) -> str | None:
    """The part of clpt that a full name belongs to: "render" of clpt.render.flow.programs."""
    parts = name.split(".")
    return parts[1] if parts[0] == "clpt" and len(parts) > 1 else None


def test_every_part_has_a_row() -> None:
    parts = {p.name.removesuffix(".py") for p in PACKAGE.iterdir() if not p.name.startswith(".")}
    assert parts - {"__init__", "__pycache__", "py.typed"} == MAY_IMPORT.keys()


def test_imports_follow_the_direction() -> None:
    parts = {path.name.removesuffix(".py") for path in PACKAGE.iterdir()}

    def broken() -> Iterator[str]:
        for path in modules():
            own = part_of(full_name(path, ROOT))
            for name, place in imports(path) if own in MAY_IMPORT else ():
                other = part_of(name)
                if other in parts - MAY_IMPORT[own] - {own}:
                    yield f"{place}: {own} imports {other} ({name})"

    keep("a part imports only those that MAY_IMPORT lists: move what it needs down", broken())


@pytest.mark.parametrize(
    ("part", "floors"), [("render", FLOORS), ("cli", FLOORS_OF_COMMANDS)], ids=["render", "cli"]
)
def test_rooms_know_only_lower_floors(part: str, floors: tuple[set[str], ...]) -> None:
    below = {
        room: {room}.union(*floors[:floor]) for floor, rooms in enumerate(floors) for room in rooms
    }

    def broken() -> Iterator[str]:
        for path in modules():
            parts = path.relative_to(PACKAGE).with_suffix("").parts
            if parts[0] != part or parts[1] not in below:
                continue
            for name, place in imports(path):
                if name.startswith(f"clpt.{part}.") and name.split(".")[2] not in below[parts[1]]:
                    yield f"{place}: {parts[1]} imports {name}"

    keep("a room of a part imports only rooms of lower floors", broken())


def test_a_circle_is_found() -> None:
    assert graphs.circle({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == []
    assert graphs.circle({"a": {"b"}, "b": {"c", "d"}, "c": set(), "d": {"b"}}) == ["b", "d", "b"]


def test_no_modules_import_each_other() -> None:
    """No circle of imports, those inside functions and for type checking included."""
    found = graphs.circle(graphs.graph(by_name=False))
    assert not found, "a circle of imports: " + " -> ".join(found)


def test_who_imports_pyopencl() -> None:
    keep(
        f"only {', '.join(sorted(OPENCL))} import pyopencl: take what is needed from clpt.device",
        (
            place
            for path in modules()
            if part_of(full_name(path, ROOT)) not in OPENCL
            for name, place in imports(path)
            if name.split(".")[0] == "pyopencl"
        ),
    )


def test_data_does_not_need_opencl() -> None:
    """No chain of imports leads from plain data to pyopencl."""
    links, paths = graphs.graph(by_name=False), graphs.modules()
    uses = {
        module
        for module, path in paths.items()
        if any(name.split(".")[0] == "pyopencl" for name, _ in imports(path))
    }

    def broken() -> Iterator[str]:
        for part in PLAIN:
            chains = [[name] for name in links if f"{name}.".startswith(f"clpt.{part}.")]
            seen = {"clpt", *(name for (name,) in chains)}
            while chains:  # the shortest first
                chain = chains.pop(0)
                if chain[-1] in uses:
                    yield " -> ".join([*chain, "pyopencl"])
                    break
                chains += ([*chain, name] for name in sorted(links[chain[-1]] - seen))
                seen |= links[chain[-1]]

    keep("plain data is read without OpenCL: cut the chain of imports", broken())


def test_the_library_never_prints() -> None:
    keep(
        "the library never prints: log, or return what is to be told",
        (
            f"{path.relative_to(ROOT)}:{line}"
            for path in modules()
            if "cli" not in path.parts
            and path.name != "__main__.py"
            and not path.name.startswith("make_")
            for line in read(path, ROOT).prints
        ),
    )


def test_nobody_changes_the_filters_of_warnings() -> None:
    """They belong to the whole process: another thread's warning would become an error."""
    keep(
        "no module imports `warnings`: log instead",
        (place for path in modules() for name, place in imports(path) if name == "warnings"),
    )


def test_public_names() -> None:
    """`__all__` is sorted, names what is there, and all that the front page imports on purpose."""
    assert clpt.__all__ == sorted(clpt.__all__)
    assert len(set(clpt.__all__)) == len(clpt.__all__)
    tree = ast.parse((PACKAGE / "__init__.py").read_text(encoding="utf-8"))
    imported = {  # where their types are read
        alias.asname or alias.name: (node.module.removeprefix("clpt."), alias.name)
        for top in tree.body
        if isinstance(top, ast.If)
        for node in top.body
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("clpt.")
        for alias in node.names
    }
    assert set(clpt.__all__) == imported.keys() and imported == clpt._HOMES
    for name in clpt.__all__:
        assert hasattr(clpt, name)
        assert getattr(clpt, name).__doc__ or name == "__version__"


def test_the_front_page_is_imported_as_it_is_used() -> None:
    """`clpt.render` is the function, whoever imports the package of that name."""
    code = """
import sys, clpt
assert "numpy" not in sys.modules
from clpt.render.film import layers
import clpt.render.options
assert callable(clpt.render) and clpt.render is clpt.render.__globals__["render"]
assert clpt.rays.Accel is clpt.Accel and "Scene" in dir(clpt)
assert not hasattr(clpt, "nothing") and not hasattr(clpt, "_nothing")
from clpt import images, render, Renderer
assert callable(render) and images.write is clpt.write_image
"""
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_kernel_files_begin_with_their_purpose() -> None:
    keep(
        "a kernel file begins with a comment that says what it is for",
        kernels(lambda _, text: [] if text.startswith("/*") else [(0, text.splitlines()[0])]),
    )


def test_kernel_files_include_in_their_direction() -> None:
    """And, wherever they are, the numbers that clpt.records declares."""
    numbers = constant_files()

    def broken(folder: str, text: str) -> Iterator[tuple[int, str]]:
        for found in re.finditer(r'#include "([^"]+)"', text):
            if folder_of(found[1]) not in MAY_INCLUDE[folder] and found[1] not in numbers:
                yield found.start(), f"{folder}/ includes {found[1]}"

    keep("a kernel file includes only folders that MAY_INCLUDE lists", kernels(broken))


def test_kernels_stand_where_host_code_looks_for_them() -> None:
    def broken(folder: str, text: str) -> Iterator[tuple[int, str]]:
        if folder not in HAVE_KERNELS:
            yield from ((f.start(), f[0]) for f in re.finditer(r"\bkernel void \w*", text))

    keep(f"kernels stand only in {', '.join(sorted(HAVE_KERNELS))}", kernels(broken))


def test_kernel_files_keep_to_the_language() -> None:
    """No double; nothing in memory whose size a compiler chooses; pragmas only in shared files."""

    def broken(folder: str, text: str) -> Iterator[tuple[int, str]]:
        code = without_comments(text)
        yield from ((f.start(), "double") for f in re.finditer(r"\bdouble\b", code))
        if folder in KINDS | {"integrator"}:
            yield from ((f.start(), "#pragma") for f in re.finditer("#pragma", code))
        for found in re.finditer(r"global\s+(?:const\s+)?(\w+)\s*\*", code):
            if found[1] in NOT_IN_MEMORY:
                yield found.start(), f"{found[1]} in memory"

    rule = "kernels have no double, no #pragma in a kind, and in memory no type of unknown size"
    keep(rule, kernels(broken))


def test_stages_are_named_as_no_function() -> None:
    """A GPU's stage is a kernel of its name in a program of all functions that it includes."""
    texts = "\n".join(without_comments(path.read_text("utf-8")) for path in kernel_files())
    functions = set(re.findall(r"^inline [\w ]*?\b(\w+)\(", texts, re.MULTILINE))
    assert "gather" in functions
    stages = set(re.findall(r"^STAGE\((\w+)\)", texts, re.MULTILINE))
    keep("a stage has another name than all functions", sorted(stages & functions))


def test_comments_of_kernels_name_what_exists() -> None:
    """Kernel files as `folder/file.cl`, others by their path, modules by their full name."""

    def broken(_: str, text: str) -> Iterator[tuple[int, str]]:
        for comment in re.finditer(r"/\*.*?\*/", text, re.DOTALL):
            for found in re.finditer(NAMED, comment[0]):
                if not exists(found[0]):
                    yield comment.start() + found.start(), found[0]

    keep("a comment names files and modules that exist", kernels(broken))


def test_lines_of_kernels() -> None:
    """120 columns at most; the backslashes of a macro stand below each other."""

    def broken(_: str, text: str) -> Iterator[tuple[int, str]]:
        position = 0
        for line, after in pairwise([*text.splitlines(), ""]):
            if len(line) > 120:
                yield position, f"{len(line)} columns"
            position += len(line) + 1
            if line.endswith("\\") and after.endswith("\\") and len(line) != len(after):
                yield position, "its backslash does not stand below the one before"

    keep("lines of kernels have 120 columns, and the backslashes of a macro one", kernels(broken))


def without_comments(text: str) -> str:
    """The text with blanks in the place of comments, so that all positions stay."""
    return re.sub(r"/\*.*?\*/", lambda c: re.sub(r"[^\n]", " ", c[0]), text, flags=re.DOTALL)


def exists(name: str) -> bool:
    """Whether there is the kernel file, the file or the module that a comment names."""
    if name.startswith("clpt."):
        module = ROOT.joinpath(*name.split("."))
        inside = module.parent.with_suffix(".py")  # of a module: the name that it must have
        if inside.is_file():
            return bool(re.search(rf"\b{module.name}\b", inside.read_text("utf-8")))
        return module.is_dir() or module.with_suffix(".py").is_file()
    if name.endswith(".cl"):
        return name.startswith("generated/") or (KERNELS / name.removeprefix("kernels/")).is_file()
    return (ROOT / name).is_file()


def test_scripts_import_names_that_are_there() -> None:
    """Programs that no test runs, such as those that generate scenes, follow what moves."""
    missing = []
    for script in sorted(f for room in SCRIPTS for f in (ROOT / room).rglob("*.py")):
        for node in ast.walk(ast.parse(script.read_text("utf-8"))):
            if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "clpt":
                missing += [f"{script.relative_to(ROOT)}: {name}" for name in _missing(node)]
    assert missing == []


def _missing(node: ast.ImportFrom) -> list[str]:
    """Return the names that an import of a script does not get."""
    assert node.module is not None
    if importlib.util.find_spec(node.module) is None:
        return [node.module]
    module = importlib.import_module(node.module)
    names = [alias.name for alias in node.names if not hasattr(module, alias.name)]
    return [n for n in names if importlib.util.find_spec(f"{node.module}.{n}") is None]
