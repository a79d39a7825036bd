"""The figures of the house may only fall; and what `bench.house` counts, on small checkouts."""

from __future__ import annotations

from pathlib import Path

import pytest

from bench import house, imports, kernel_files, python_files, walks

# `python -m bench.house` measures these. Lower a bound when its figure has fallen; --bounds prints
# the table. A size in lines may be raised for a feature that is worth it.
BOUNDS = {
    "functions over 60 lines": 0,
    "functions over 40 lines": 12,
    "lines of the longest function": 54,
    "functions with 8 or more parameters": 5,
    "parameters of a function, most": 10,
    "#if, #ifdef, #ifndef and #elif in kernels": 170,
    "lines of the longest kernel function": 50,
    "#if of a kernel function, most": 3,
    "kernel functions over 60 lines": 0,
    "compile-time flags of a scene": 44,
    "fields of a record of features, most": 10,
    "getattr(": 54,
    ": Any": 250,
    "aliases of array types outside clpt/arrays.py": 0,
    "rooms in circles of imports": 0,
    "stays of a scene from render() to the tables": 32,
    "rooms of these stays": 18,
    "lines of Python": 103_817,
    "lines of OpenCL": 24_572,
    "words of README.md": 1_200,
    "docstrings that begin with What, Of, How, Those, The same": 0,
    "lines of accumulate of Cornell's box": 196,
    "lines of shade_diffuse of Cornell's box": 1_864,
}
SHOWN = 12  # places of a figure that has risen


def test_figures_only_fall() -> None:
    found = house.figures()
    assert [figure.name for figure in found] == list(BOUNDS)
    risen = []
    for figure in found:
        if figure.value > BOUNDS[figure.name]:
            risen += [f"{figure.name}: {BOUNDS[figure.name]:,} before, now {figure.value:,}"]
            risen += [f"  {place}" for place in figure.where[:SHOWN]]
    if risen:
        asked = "figures of the house rose: write it shorter (bounds stand in tests/test_house.py)"
        pytest.fail("\n  ".join([asked, *risen]), pytrace=False)


def checkout(root: Path, files: dict[str, str]) -> Path:
    """Write files by their paths, and an empty __init__.py to each folder of clpt without one."""
    for name, text in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    for folder in {f.parent for f in (root / "clpt").rglob("*.py")} | {root / "clpt"}:
        (folder / "__init__.py").touch()
    return root


def test_a_circle_of_rooms_is_found(tmp_path: Path) -> None:
    """A folder is one room: what is in it imports as the folder; names of modules count too."""
    root = checkout(
        tmp_path,
        {
            "clpt/lights/lamp.py": "from clpt.shapes.ball import radius",
            "clpt/shapes/disk.py": "def area():\n    from .. import motion",
            "clpt/shapes/ball.py": "radius = 1.0",
            "clpt/motion.py": "import importlib\nimportlib.import_module('clpt.lights.lamp')",
            "clpt/scene.py": "from clpt.lights import lamp",
        },
    )
    circle = ["clpt.lights", "clpt.motion", "clpt.shapes"]
    assert imports.circles(imports.rooms(root)["clpt"]) == [circle]
    (figure,) = house.circles(root)
    assert (figure.value, figure.where) == (3, (", ".join(circle),))
    assert not imports.circle(imports.graph(root, by_name=False))
    assert not imports.circle(imports.graph(root))  # of modules there is none


@pytest.mark.parametrize("called", ["import_module(f'clpt.{kind}')", "__import__('clpt.a')"])
def test_imports_by_name_are_imports(tmp_path: Path, called: str) -> None:
    root = checkout(tmp_path, {"clpt/a.py": "", "clpt/b.py": f"kind = 'a'\n{called}"})
    assert "clpt.a" in imports.graph(root)["clpt.b"]
    assert imports.graph(root, by_name=False)["clpt.b"] == set()


def test_functions_are_measured(tmp_path: Path) -> None:
    """self is no parameter; decorators are no lines of a function."""
    body = "        pass\n"
    text = (
        "class A:\n    @property\n    def long(self):\n" + body * 60
        + "    def wide(self, a, b, c, /, d, e, f, *more, g, h, **rest):\n" + body * 40
        + "    def short(self, a, b, c, d, e, f, g):\n" + body * 39
    )  # fmt: skip
    figures = {f.name: f for f in house.functions(checkout(tmp_path, {"clpt/a.py": text}))}
    assert figures["functions over 60 lines"].where == ("clpt/a.py:3 long",)
    assert figures["functions over 40 lines"].where == (
        "clpt/a.py:3 long: 61",
        "clpt/a.py:64 wide: 41",
    )
    assert figures["lines of the longest function"].value == 61
    assert figures["functions with 8 or more parameters"].where == ("clpt/a.py:64 wide",)
    assert figures["parameters of a function, most"].value == 8


def test_kernel_functions_are_measured(tmp_path: Path) -> None:
    """Brackets and conditions of comments and macros do not count."""
    text = (
        "/* real f() {\n * #if A */\n#define B { \n#ifdef C\nreal g(real a) { return a; } // {\n"
        "#endif\n\ninline global const uint *long_one(uint a,\n    uint b)\n{\n"
        "    #if D\n    if (a) { b = 1u; }\n    #elif E\n    #else\n    #endif\n}\n"
    )
    path = tmp_path / "a.cl"
    path.write_text(text, encoding="utf-8")
    found = [(f.name, f.line, f.lines, f.conditions) for f in kernel_files.functions(path)]
    assert found == [("g", 5, 1, 0), ("long_one", 8, 9, 2)]
    assert kernel_files.conditions("#ifdef A\n # ifndef B\n#if C\n#elif D\n#else\n#endif\n") == 4


def test_a_scene_is_followed(tmp_path: Path) -> None:
    """By names, through rooms that hand on what others have, into classes; types are no calls."""
    root = checkout(
        tmp_path,
        {
            "clpt/render/one_call.py": "from clpt.render import Renderer\n"
            "def render(scene: Scene | str): return Renderer(scene).tables\n",
            "clpt/render/__init__.py": "from clpt.render.renderer import Renderer\n",
            "clpt/render/renderer.py": "from clpt.render import steps\n"
            "class Renderer:\n"
            "    def __init__(self, scene: Scene): self.look()\n"
            "    def look(self):\n        x: Unseen = steps.lower(self)\n"
            "class Unseen:\n    def __init__(self, scene: Scene): pass\n",
            "clpt/render/steps.py": "def lower(index): return camera(index), lights(1)\n"
            "def camera(index): return index.scene.camera\n"
            "def lights(count: int): return DeviceScene\n"
            "def never(scene: Scene): pass\n",
        },
    )
    assert walks.stays(root) == [
        "clpt/render/one_call.py render",
        "clpt/render/renderer.py __init__",
        "clpt/render/steps.py camera",
    ]
    stays, rooms = house.ways(root)
    assert (stays.value, rooms.value) == (3, 3)


def test_features_types_and_sizes_are_measured(tmp_path: Path) -> None:
    fields = "class {}:\n    a: Any\n    b: int = 0\n    c = 0\n".format
    root = checkout(
        tmp_path,
        {
            "clpt/render/records/film.py": fields("Camera") + "    d: int\n" + fields("Film"),
            "clpt/render/flags.py": fields("Other") + "    d: int\n    e: int\n",
            "clpt/a.py": "Floats = NDArray[np.float64]\nWords: TypeAlias = NDArray[int]\n"
            "def f(a: Anything):\n    x = NDArray[int]\n    return getattr(a, 'x')\n",
            "clpt/arrays.py": "Floats = NDArray[np.float64]\n",
            "kernels/a.cl": "int a;\nint b;\n",
            "README.md": "Three small words.\n",
        },
    )
    figures = {f.name: f for measure in (house.types, house.sizes) for f in measure(root)}
    assert figures[": Any"].value == 3
    assert figures["getattr("].where == ("clpt/a.py",)
    aliases = figures["aliases of array types outside clpt/arrays.py"]
    assert aliases.where == ("clpt/a.py:1 Floats", "clpt/a.py:2 Words")
    assert figures["lines of Python"].value == 5 + 1 + 9 + 6
    assert figures["lines of OpenCL"].value == 2
    assert figures["words of README.md"].value == 3
    most = [f for f in house.features(root) if f.name.startswith("fields")]
    assert [(f.value, f.where[0]) for f in most] == [(3, "clpt/render/records/film.py Camera: 3")]


def test_docstrings_that_lean_on_others_are_found(tmp_path: Path) -> None:
    text = (
        '"""The same for spheres."""\nclass A:\n    """Whatever is there."""\n'
        '    def f(self):\n        """What stands behind that:\n\n        more."""\n'
        '        def g():\n            """Howl, and offer."""\n'
    )
    (figure,) = house.words(checkout(tmp_path, {"clpt/a.py": text}))
    assert figure.where == (
        "clpt/a.py:1 the module: The same for spheres.",
        "clpt/a.py:5 f: What stands behind that:",
    )
    assert python_files.DEPENDENT.match("Those of them")
