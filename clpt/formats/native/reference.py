"""The reference of scene.json as a page, made from the dataclasses' own declarations.

`python -m clpt.formats.native.reference` writes it to docs/scene_format.md.
"""

from __future__ import annotations

import dataclasses
import inspect
import json
import sys
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from clpt import spectra
from clpt.files import output_files
from clpt.formats.native import forms
from clpt.formats.native.shape_files import FILES
from clpt.formats.native.spectra import RERADIATIONS, SPECTRA
from clpt.scene import KINDS, integrators, materials, shapes, textures
from clpt.scene.params import Kind, defaults, params

INTRODUCTION = """# scene.json

A scene is a JSON file, or an object in Python. Each `type` on this page is a dataclass of
`clpt.scene`. Each parameter is a field of the dataclass. Begin a file with `"$schema": ADDRESS`.
`clpt scenes --schema` prints the ADDRESS. Then your editor knows all names and limits.

```json
{
  "camera": {"type": "perspective", "fov": 40,
             "to_world": {"look_at": {"origin": [0, 1, 5], "target": [0, 1, 0], "up": [0, 1, 0]}}},
  "film": {"width": 640, "height": 480},
  "materials": {"red": {"type": "diffuse", "reflectance": [0.6, 0.05, 0.04]}},
  "shapes": [{"type": "sphere", "center": [0, 1, 0], "material": "red"},
             {"type": "mesh", "file": "teapot.ply", "material": {"type": "dielectric"}}],
  "lights": [{"type": "constant", "radiance": "D65"}]
}
```

```python
from clpt.scene import Film, Scene, cameras, lights, materials, shapes
from clpt.transforms import look_at

red = materials.Diffuse(reflectance=(0.6, 0.05, 0.04))
glass = materials.Dielectric()
scene = Scene(
    camera=cameras.Perspective(fov=40, to_world=look_at([0, 1, 5], [0, 1, 0], [0, 1, 0])),
    film=Film(width=640, height=480),
    shapes=[
        shapes.Sphere(center=(0, 1, 0), material=red),
        shapes.Mesh.from_trimesh(teapot, material=glass),
    ],
    lights=[lights.Constant(radiance="D65")],
)
```

## A scene

| key | meaning |
| --- | --- |
| `camera` | a [camera](#cameras); the only key that a scene must have |
| `film` | size, mode and filter: see [film](#film) |
| `integrator` | how paths of light are found: [integrators](#integrators) |
| `sampler` | the source of random numbers: [samplers](#samplers) |
| `materials` | name -> [material](#materials); shapes refer to them by name |
| `media` | name -> [medium](#media); shapes and cameras refer to them by name |
| `groups` | name -> a list of shapes; an [instance](#instance) places all of them |
| `shapes` | a list of [shapes](#shapes) |
| `lights` | a list of [lights](#lights); an area light is the `emission` of a shape |
| `spp` | samples of a pixel |
| `noise` | a pixel gets no more samples below this noise, such as 0.02; `spp` is then the most |
| `seed` | of the random numbers |
| `name` | a name for people, and for files of pictures |

Lengths are in metres, angles in degrees, wavelengths in nm. Names of files are relative to the
scene file. An unknown key is an error. So is a number outside its limits. The message names the
file, the line and the path of the value.

## Values

**Transforms** (`to_world`) are a 4x4 matrix in rows, or a list of steps. The first step of the list
is applied first. Steps are `{"translate": [x, y, z]}`, `{"scale": s}` or `{"scale": [x, y, z]}`,
`{"rotate": {"axis": [x, y, z], "angle": degrees}}`,
`{"look_at": {"origin": ..., "target": ..., "up": ...}}`. `to_uv` is a 3x3 matrix, or steps in the
plane of u and v.

**Spectra** are a number (the same at every wavelength), `[r, g, b]` in linear Rec. 709, a name, or
an object. Reflectances, emissions and factors may also be `"#rrggbb"`: a colour in sRGB, as colour
pickers show it. The meaning of a number or a colour depends on the role of the parameter:

| role | number | `[r, g, b]` | name | a table beyond its ends |
| --- | --- | --- | --- | --- |
| reflectance | even | a smooth reflectance of that colour (Jakob and Hanika 2019) | - | 0 |
| emission | D65 times the number: white light | D65 times such a spectrum | an illuminant | 0 |
| index | even | a smooth unbounded spectrum | a glass or liquid | its end values |
| factor | even | a smooth unbounded spectrum | - | 0 |
| coefficient | even | a smooth unbounded spectrum | - | its end values |
| quantity | even | a smooth unbounded spectrum | - | its end values |

The illuminant `"E"` has the same power at every wavelength. It looks pink beside D65. The limits of
a number hold for a table at every wavelength from 200 to 2000 nm. An index must be above 0 at every
wavelength of the film. Tables of named metals end at 1100 nm and keep their end values beyond. The
illuminants A and D65 end at 830 nm and are 0 beyond. Beyond its bands a spectral image of
reflectances keeps its end values, and a spectral image of light is 0.
"""

ENDING = """## How this page is made

`python -m clpt.formats.native.reference` makes it from the dataclasses in `clpt/scene`. Examples of
kinds have the defaults of some parameters. [The JSON Schema](../scenes/schema.json) is made of the
same declarations.
"""
EXAMPLE = 3  # parameters that the example of a kind has at most
HEADINGS = {
    "camera": "Cameras", "shape": "Shapes", "material": "Materials", "texture": "Textures",
    "medium": "Media", "phase": "Phase functions",
    "light": "Lights", "integrator": "Integrators", "sampler": "Samplers", "filter": "Filters",
}  # fmt: skip


MITSUBA = {  # elements of kinds whose plugin there has the same name and parameters
    **dict.fromkeys(
        (materials.Diffuse, materials.Dielectric, materials.ThinDielectric,
         materials.RoughDielectric, materials.Conductor, materials.RoughConductor,
         materials.Plastic, materials.RoughPlastic, materials.Principled,
         materials.PrincipledThin, materials.Grating),
        "bsdf",
    ),
    textures.Checkerboard: "texture",
}  # fmt: skip


def text() -> str:
    """Return the page as the published file has it."""
    parts = [INTRODUCTION, *_spectra()]
    for category, heading in HEADINGS.items():
        parts += [f"## {heading}\n", *(_kind(category, cls) for cls in KINDS[category])]
        if category == "integrator":
            parts += ["## Film\n", _summary(integrators.Film), _table(integrators.Film)]
        if category == "material":
            parts += ["## Layers\n", _summary(materials.Layer), _table(materials.Layer)]
    return "\n".join([*parts, ENDING])


def _spectra() -> list[str]:
    """Return the paragraphs on objects and names that stand for spectra."""
    file = "the same from a file of columns, or a page of refractiveindex.info (.yml, .csv)"
    rows = [
        "| object | what it is |",
        "| --- | --- |",
        '| `{"values": [[nm, value], ...]}` | a table, linear between its rows |',
        f'| `{{"file": "name"}}` | {file} |',
    ]
    rows += _typed_rows(SPECTRA)
    names = {
        "Illuminants": spectra.illuminants(),
        "Glasses and liquids": spectra.glasses(),
        'Metals (`"metal": name` or `{"file": name}`)': spectra.metals(),
    }
    lists = [
        f"{role}: {', '.join(f'`{name}`' for name in known)}." for role, known in names.items()
    ]
    return ["\n".join(rows) + "\n", "\n\n".join(lists) + "\n", *_reradiations()]


def _reradiations() -> list[str]:
    """Return the paragraphs on objects that stand for fluorescence."""
    file = "a measured BFC matrix (whose diagonal is a spectrum of the same `file`), or a table"
    rows = ["| object | what it is |", "| --- | --- |", f'| `{{"file": "name"}}` | {file} |']
    rows += _typed_rows(RERADIATIONS)
    return [
        "## Re-radiation\n",
        "See [fluorescence](spectral.md#fluorescence).\n",
        "\n".join(rows) + "\n",
    ]


def _typed_rows(classes: Mapping[str, type]) -> list[str]:
    """Return the rows of a table of objects that have a type."""
    rows = []
    for name, cls in classes.items():
        keys = "".join(f', "{field.name}": ...' for field in dataclasses.fields(cls))
        rows.append(f'| `{{"type": "{name}"{keys}}}` | {_first_line(cls)} |')
    return rows


def _kind(category: str, cls: type[Kind]) -> str:
    blocks = [_blocks(*both, xml(cls)) for both in example(cls)]
    shown = "\n".join([_summary(cls) + _picture(category, cls), *blocks])
    return f"### `{cls.kind}`\n\n{shown}\n{_table(cls)}"


def example(cls: type[Kind]) -> list[tuple[str, str]]:
    """Return a kind as scene.json and Python have it, with the defaults of some parameters.

    Empty for a kind that is nothing without a file or a group.
    """
    if cls in FILES or cls is shapes.Instance:
        return []
    chosen = _chosen(cls)
    arguments = ", ".join(f"{name}={value!r}" for name, value in chosen.items())
    code = f"{cls.__module__.split('.')[2]}.{cls.__name__}({arguments})"
    return [(json.dumps({"type": cls.kind, **chosen}), code)]


def xml(cls: type[Kind]) -> str:
    """Return the same as an element of Mitsuba's, empty where it has no plugin of that name."""
    if cls not in MITSUBA:
        return ""
    lines = [f'<{MITSUBA[cls]} type="{cls.kind.replace("_", "")}">']
    if "distribution" in params(cls):  # Mitsuba has another default
        lines.append(f'    <string name="distribution" value="{defaults(cls)["distribution"]}"/>')
    for name, value in _chosen(cls).items():
        number = params(cls)[name].role.name == "real" or name.endswith("_ior")
        tag = "float" if number else "spectrum"
        lines.append(f'    <{tag} name="{name}" value="{value:g}"/>')
    return "\n".join([*lines, f"</{MITSUBA[cls]}>"])


def _chosen(cls: type[Kind]) -> dict[str, Any]:
    """Return the parameters that an example shows, with their defaults."""
    default, annotated = defaults(cls), vars(cls).get("__annotations__", {})
    plain = {n: default[n] for n in params(cls) if n in annotated and _is_plain(default[n])}
    return dict(list(plain.items())[:EXAMPLE])


def _is_plain(value: object) -> bool:
    """Return whether a value is numbers, which files and Python write alike."""
    each = value if isinstance(value, tuple) else (value,)
    return bool(each) and all(type(number) in (int, float) for number in each)


def _blocks(text: str, code: str, element: str) -> str:
    """Return blocks of JSON, Python and Mitsuba's XML, which the site shows as tabs."""
    blocks = {"json": text, "python": code, "xml": element}
    return "\n".join(f"```{name}\n{block}\n```\n" for name, block in blocks.items() if block)


def _picture(category: str, cls: type[Kind]) -> str:
    """Return the kind's picture and its caption, if `docs.pictures` has a picture."""
    caption = _captions().get(f"{category}/{cls.kind}")
    if caption is None:
        return ""
    shown = f"![{category} {cls.kind}](pictures/kinds/{category}/{cls.kind}.webp)"
    return f"\n{shown}\n\n*{caption}*\n"


@cache
def _captions() -> dict[str, str]:
    file = Path(__file__).parents[3] / "docs" / "pictures" / "kinds" / "captions.json"
    return json.loads(file.read_text("utf-8"))


def _summary(cls: type) -> str:
    return inspect.cleandoc(cls.__doc__ or "") + "\n"


def _first_line(cls: type) -> str:
    return _summary(cls).split("\n\n")[0].strip().replace("\n", " ").replace("|", "\\|")


def _table(cls: type[Kind]) -> str:
    """The parameters of a kind."""
    default, declared = defaults(cls), params(cls)
    if not declared and not cls.shorthands:
        return "It has no parameters.\n"
    rows = ["| parameter | accepts | default | meaning |", "| --- | --- | --- | --- |"]
    if (file := FILES.get(cls)) is not None:
        rows.append(f"| `file` | {file.accepts} | - | {file.meaning} |")
    for name, param in declared.items():
        unit = f" [{param.unit}]" if param.unit else ""
        shown = _shown(default[name])
        rows.append(f"| `{name}` | {forms.words(param)} | {shown} | {param.doc}{unit} |")
    for shorthand in cls.shorthands:
        stands = " and ".join(f"`{name}`" for name in shorthand.stands_for)
        for name, param in shorthand.arguments.items():
            unit = f" [{param.unit}]" if param.unit else ""
            meaning = f"stands for {stands}: {param.doc}{unit}"
            rows.append(f"| `{name}` | {forms.words(param)} | - | {meaning} |")
    return "\n".join(rows) + "\n"


def _shown(value: object) -> str:
    if value is None:
        return "-"
    if isinstance(value, np.ndarray):
        return "identity" if value.ndim == 2 else f"{value.flat[0]:g}"
    if isinstance(value, Kind):
        return f"`{value.kind}`"
    if isinstance(value, tuple) and value and isinstance(value[0], Kind):
        return ", ".join(_shown(entry) for entry in value)
    if isinstance(value, tuple) and value and isinstance(value[0], str):
        return "all"
    if isinstance(value, float):
        return f"{value:.6g}"
    return f"`{json.dumps(value)}`" if value != "" else "-"


if __name__ == "__main__":
    target = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/scene_format.md")
    output_files.write_text(target, text())
