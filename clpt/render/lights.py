"""Lights on their way to the device: their rows, how often each is chosen, and the dispatch text.

What is chosen is a row of `lights`: a lamp, a shape that is sampled as a whole, or one triangle of
an emissive mesh or cube. Infinite lights come first, for the rays that leave the scene.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.errors import SceneError
from clpt.records import LIGHT, SHAPE
from clpt.render import light_bounds, light_tree, shapes, spheres
from clpt.render.lamps import INFINITE, RECORDS, Sink, blank_row, brightness, lower_lamp
from clpt.render.memo import content
from clpt.render.triangle_means import triangle_means
from clpt.scene.lights import DirectionalArea, Light
from clpt.scene.shapes import Shape

APART = 6  # triangles that a light at a place of its own counts as, where a tree is thought of
INFINITE_SHARE = 0.5  # of the choices, where there are other lights too
FRONT, ALONG, BOTH = range(3)  # LightRow.way, see kernels/light/area.cl
BASES = {"spectral_envmap": "envmap", "image_spot": "spot"}  # whose functions a kind uses
KINDS = (*RECORDS, *shapes.RECORDS)  # LightRow.kind is a position in this tuple


@dataclass(frozen=True)
class Emitter:
    """A shape with an `emission`.

    shape_row: its row in `shapes`; vertices, faces, uvs: its triangles as `shapes.triangles` gave
    them, needed for a mesh and a cube; of `spheres`, vertices are their balls.
    """

    shape: Shape
    shape_row: int
    vertices: shapes.Points | None = None
    faces: shapes.Faces | None = None
    uvs: shapes.Points | None = None


@dataclass(frozen=True)
class LightRows:
    """The table `lights` and what follows from it.

    rows: structured (n,) of LIGHT.dtype; infinite: how many of them, the first ones, are infinite;
    kinds: those that occur, for `dispatch_text`; first: per emitter, its first row; whole: per
    emitter, whether that one row stands for all of it; visible: whether one is no delta light;
    two_sided: whether one shines from the back of its shape too; tree: the words of the tree that
    stand behind the rows, None where the alias table chooses.
    """

    rows: np.ndarray
    infinite: int
    kinds: tuple[str, ...]
    first: tuple[int, ...]
    whole: tuple[bool, ...]
    visible: bool
    two_sided: bool
    tree: NDArray[np.uint32] | None


class Block(NamedTuple):
    """The rows of one lamp or emitter, their power [W/nm], and where they shine."""

    rows: np.ndarray
    power: np.ndarray
    bounds: light_bounds.Bounds


def light_rows(
    lamps: Sequence[Light],
    emitters: Sequence[Emitter],
    tables: Sink,
    scene_radius: float,
    tree_from: int | None = None,
) -> LightRows:
    """Put the parameters of all lights into the tables, and make the rows of `lights`.

    scene_radius: of a sphere around the scene [m]; tree_from: the number of rows from which a tree
    chooses among them, or 1 / APART of it of lights at places. Raises SceneError for a light that
    has no place.
    """
    if tables.append("lamps", blank_row()) != 0:
        raise ValueError("`lamps` must be empty before the lights are put in")
    ordered = sorted(lamps, key=lambda lamp: lamp.kind not in INFINITE)
    infinite = sum(lamp.kind in INFINITE for lamp in ordered)
    blocks = [_lamp_block(lamp, tables, scene_radius) for lamp in ordered]
    blocks += [_emitter_block(emitter, tables) for emitter in emitters]
    first = np.cumsum([0, *(len(block.rows) for block in blocks)])[len(ordered) : -1]
    rows = np.concatenate([np.zeros(0, LIGHT.dtype), *(block.rows for block in blocks)])
    tree = None
    if len(rows):
        weights = _shared(np.concatenate([block.power for block in blocks]), infinite)
        same = content(weights)
        rows["pmf"], rows["keep"], rows["alias"] = tables.memo(alias_table, weights, by=(same,))
        apart = sum(bool(block.bounds.placed.any()) for block in blocks)
        if tree_from is not None and max(len(rows), APART * apart) >= tree_from:
            bounds = light_bounds.joined([block.bounds for block in blocks])
            by = same, content(*vars(bounds).values())
            tree = tables.memo(_tree_words, bounds, weights / weights.sum(), by=by)
    kinds = tuple(KINDS[i] for i in np.unique(rows["kind"]))
    return LightRows(
        rows=rows,
        infinite=infinite,
        kinds=kinds,
        first=tuple(int(i) for i in first),
        whole=tuple(_whole(emitter.shape) for emitter in emitters),
        visible=infinite > 0 or bool(((rows["shape"] >= 0) & (rows["way"] != ALONG)).any()),
        two_sided=bool((rows["way"] == BOTH).any()),
        tree=tree,
    )


def _tree_words(bounds: light_bounds.Bounds, pmf: np.ndarray) -> NDArray[np.uint32]:
    return light_tree.build(bounds, pmf).words()


def _whole(shape: Shape) -> bool:
    """Whether the shape is sampled as one light; a mesh and a cube are many."""
    return shape.kind in shapes.RECORDS


def _block(count: int, kind: str, params: ArrayLike, radiance: int, shape_row: int) -> np.ndarray:
    rows = np.zeros(count, LIGHT.dtype)
    rows["kind"], rows["params"] = KINDS.index(kind), params
    rows["radiance"], rows["shape"] = radiance, shape_row
    return rows


def _lamp_block(lamp: Light, tables: Sink, scene_radius: float) -> Block:
    """The row of a light that is not on a shape."""
    kind, at, radiance, power = lower_lamp(lamp, tables, scene_radius)
    row = _block(1, kind, at, radiance, -1)
    return Block(row, np.array([power]), light_bounds.of_lamp(lamp))


def _emitter_block(emitter: Emitter, tables: Sink) -> Block:
    """The rows of a shape that emits."""
    shape = emitter.shape
    emission = shape.emission
    along = isinstance(emission, DirectionalArea)
    way = ALONG if along else BOTH if emission.two_sided else FRONT
    value = emission.irradiance if along else emission.radiance
    radiance = tables.append("lamps", tables.emission_words(value))
    strength = {FRONT: np.pi, ALONG: 1.0, BOTH: 2.0 * np.pi}[way]
    if _whole(shape):
        at = tables.append("geometry", shapes.row(shape))
        rows = _block(1, shape.kind, at, radiance, emitter.shape_row)
        rows["way"] = way
        bounds = light_bounds.of_shape(shape, way == BOTH)
        return Block(rows, np.array([strength * shapes.area(shape) * brightness(value)]), bounds)
    if shape.kind in shapes.ONE_OF:
        return _balls_block(emitter, tables, way, radiance, strength * brightness(value))
    if emitter.vertices is None or emitter.faces is None:
        raise SceneError("its triangles are missing", where=shapes.where(shape))
    memo, corners = tables.memo, (emitter.vertices, emitter.faces)
    geometry = memo(shapes.triangle_rows, *corners)
    count, words = geometry.shape
    at = tables.append("geometry", geometry) + words * np.arange(count)
    rows = _block(count, "triangle", at, radiance, emitter.shape_row)
    rows["way"] = way
    bounds = memo(light_bounds.of_triangles, *corners, way == BOTH)
    bright = memo(triangle_means, value, emitter.uvs, emitter.faces)
    areas = memo(shapes.triangle_areas, *corners)
    return Block(rows, strength * areas * bright, bounds)


def _balls_block(emitter: Emitter, tables: Sink, way: int, radiance: int, strength: float) -> Block:
    """A row for each of many spheres; strength: what a square metre of them emits."""
    placed: Any = emitter.vertices
    geometry = spheres.rows(emitter.shape, placed)
    count, words = geometry.shape
    at = tables.append("geometry", geometry) + words * np.arange(count)
    rows = _block(count, "sphere", at, radiance, emitter.shape_row)
    rows["way"] = way
    areas = 4.0 * np.pi * placed[:, 3].astype(np.float64) ** 2
    return Block(rows, strength * areas, light_bounds.of_balls(placed))


def _shared(weights: np.ndarray, infinite: int) -> np.ndarray:
    """Weights with the infinite lights' share fixed where there are others; even if all are 0."""
    ours, others = weights[:infinite].sum(), weights[infinite:].sum()
    if not ours + others > 0.0:
        return np.ones_like(weights)
    if not (ours > 0.0 and others > 0.0):
        return weights
    shared = weights / others * (1.0 - INFINITE_SHARE)
    shared[:infinite] = weights[:infinite] / ours * INFINITE_SHARE
    return shared


def alias_table(
    weights: ArrayLike,
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.int32]]:
    """Return pmf, keep and alias (n,) to choose a row by its weight (Vose 1991).

    Row i of n, chosen evenly, is kept with probability keep[i], else alias[i] is taken.
    """
    weights = np.asarray(weights, np.float64)
    pmf = weights / weights.sum()
    left = (pmf * len(pmf)).tolist()
    keep, alias = [1.0] * len(left), list(range(len(left)))
    small = [i for i, p in enumerate(left) if p < 1.0]
    large = [i for i, p in enumerate(left) if p >= 1.0]
    while small and large:
        i, j = small.pop(), large[-1]
        keep[i], alias[i] = left[i], j
        left[j] -= 1.0 - left[i]
        if left[j] < 1.0:
            small.append(large.pop())
    return pmf.astype(np.float32), np.array(keep, np.float32), np.array(alias, np.int32)


def virtual_files() -> dict[str, str]:
    """Return generated/light/<kind>.cl per kind: its struct, its loader and its functions."""
    made = {
        f"generated/light/{kind}.cl": f'{record.row_text()}#include "light/{kind}.cl"\n'
        for kind, record in RECORDS.items()
    }
    for kind, base in BASES.items():
        name = f"generated/light/{kind}.cl"
        made[name] = f'#include "generated/light/{base}.cl"\n{made[name]}'
    return made


def dispatch_text(
    kinds: Iterable[str], textured: bool = False, two_sided: bool = False, tree: bool = False
) -> str:
    """Return the functions over all lights, for the kinds in the scene (`LightRows.kinds`).

    textured: some emission is a texture, so that triangles need the uv of their mesh; two_sided:
    some shape emits from its back too; tree: the rows are followed by a tree that chooses among
    them. It includes the files of `virtual_files`, here and in clpt.render.shapes.

    light_sample(scene, p, side, pick, u, lambdas)  chooses a light and a direction to it
    light_pdf(scene, row, p, wi, t, n)              of it, [1/sr], for a ray that met a shape
    light_shows(scene, row, front)                  whether the side of a shape that was met emits
    infinite_light(scene, row, side, d, lambdas, ...)  radiance and pdf of one infinite light
    infinite_gather(scene, side, d, pdf, lambdas)   what they all add to a path that left the scene
    """
    present = [kind for kind in KINDS if kind in set(kinds)]
    lamps = [kind for kind in present if kind in RECORDS]
    surfaces = [kind for kind in present if kind in shapes.RECORDS]
    includes = ["lib/surface_flags.cl", "lib/shape.cl", "lib/light.cl", "lib/mis.cl"]
    includes += ["lib/light_choice.cl"]
    includes += [f"generated/light/{kind}.cl" for kind in lamps]
    includes += [f"generated/shape/{kind}.cl" for kind in surfaces]
    includes += ["light/area.cl"] if surfaces else []
    parts = [f"#define LIGHT_ROW_WORDS {LIGHT.words}", f"#define SHAPE_ROW_WORDS {SHAPE.words}"]
    parts += [f"#define LIGHT_{kind.upper()} {KINDS.index(kind)}" for kind in present]
    parts += [f'#include "{name}"' for name in includes]
    parts += _tree_text() if tree else []
    parts.append(_sides_text(two_sided))
    parts += _sample_text(lamps, surfaces, textured, two_sided, tree)
    parts += _pdf_text(surfaces, tree)
    parts += _infinite_text([kind for kind in lamps if kind in INFINITE])
    return "\n".join(parts) + "\n"


def case_text(kind: str, only: bool, body: Sequence[str]) -> list[str]:
    """Lines that do `body` where the light `l` is of a kind, under the mask `m`; `only`: always."""
    if only:
        rows = ["mask m = (integer)(-1);", *body]
        return ["    {", *(f"        {line}" for line in rows), "    }"]
    head = ["    {", f"        mask m = l.kind == LIGHT_{kind.upper()};", "        if (any(m)) {"]
    return [*head, *(f"            {line}" for line in body), "        }", "    }"]


def row_text(kind: str) -> str:
    """The kind's parameters of the light `l`; other lanes read the first row, see `blank_row`."""
    table = "lamps" if kind in RECORDS else "geometry"
    return f"{kind}_row(scene.{table}, sel_i(m, l.params, (integer)(0)))"


def point_text(kind: str, uv: str) -> list[str]:
    """Lines that set `point`, what a texture sees, where the light `l` is a shape of a kind."""
    if kind not in ("triangle", "sphere"):
        place = "v3(0.0f, 0.0f, 0.0f)"
        return [f"point = texture_point_sel(m, texture_point({uv}, {place}), point);"]
    made = f"area_{kind}_point(scene, shape, sel_i(m, row, shape.light), {uv})"
    return [
        "integer at = sel_i(m, l.shape, (integer)(0)) * SHAPE_ROW_WORDS;",
        "ShapeRow shape = shape_row_row(scene.shapes, at);",
        f"point = texture_point_sel(m, {made}, point);",
    ]


def _tree_text() -> list[str]:
    """Nodes of the tree over lights, and how one goes down in it."""
    node = light_tree.NODE
    child = next(member.word for member in node.members if member.name == "child")
    return [
        node.row_text(),
        f"#define LIGHT_NODE_WORDS {node.words}",
        f"#define LIGHT_NODE_CHILD {child}",
        '#include "lib/light_tree.cl"',
    ]


def _sides_text(two_sided: bool) -> str:
    """Whether the side of a shape that a ray met emits; most scenes need not look at the row."""
    if not two_sided:
        return "#define light_shows(scene, row, front) (front)"
    return (
        "inline mask light_shows(Scene scene, integer row, mask front)\n{\n"
        f"    return front | (light_at(scene, max_i(row, (integer)(0))).way == {BOTH});\n}}"
    )


def _sample_text(
    lamps: list[str], surfaces: list[str], textured: bool, two_sided: bool, tree: bool
) -> list[str]:
    only = len(lamps) + len(surfaces) == 1
    head = (
        "LightSample light_sample(Scene scene, vec3 p, vec3 side, real pick, vec2 u, "
        "Wavelengths lambdas)"
    )
    if not lamps and not surfaces:
        return [f"inline {head} {{ return light_nothing(); }}"]
    number = "FEW_LIGHTS ? &u.x : &pick"
    if tree:
        chosen = ["real pmf;", f"integer row = light_tree_pick(scene, p, {number}, &pmf);"]
    else:
        chosen = [f"integer row = light_pick(scene, {number});"]
    lines = [
        f"inline {head}",
        "{",
        *(f"    {line}" for line in chosen),
        "    LightRow l = light_at(scene, row);",
        "    LightSample s = light_nothing();",
    ]
    for kind in lamps:
        seen = "side" if kind in INFINITE else "p"
        sampled = f"{kind}_sample({row_text(kind)}, scene, {seen}, u, lambdas)"
        lines += case_text(kind, only, [f"s = light_sel(m, {sampled}, s);"])
    if surfaces:
        lines += [
            "    ShapeSample q = shape_sample_nothing();",
            "    TexturePoint point = texture_point_nowhere();",
        ]
    for kind in surfaces:
        body = [f"ShapeSample r = {kind}_sample({row_text(kind)}, p, u);"]
        body += point_text(kind, "r.uv") if textured else []
        lines += case_text(kind, only, [*body, "q = shape_sample_sel(m, r, q);"])
    if two_sided:
        lines.append(f"    q = area_turned(q, l.way == {BOTH});")
    if surfaces:
        lines += [
            "    point.p = madd3(q.wi, q.t, p);",
            "    Spectrum le = emission_load(scene, l.radiance, point, lambdas);",
            "    s = light_sel(l.shape >= 0, area_sample(q, le), s);",
        ]
    return [*lines, f"    return light_chosen(s, {'pmf' if tree else 'l.pmf'});", "}"]


def _pdf_text(surfaces: list[str], tree: bool) -> list[str]:
    lines = [
        "inline real light_pdf(Scene scene, integer row, vec3 p, vec3 wi, real t, vec3 n)",
        "{",
        "    LightRow l = light_at(scene, row);",
        "    real pdf = 0.0f;",
    ]
    for kind in surfaces:
        body = f"pdf = sel(m, {kind}_pdf({row_text(kind)}, p, wi, t, n), pdf);"
        lines += case_text(kind, len(surfaces) == 1, [body])
    pmf = "light_tree_pmf(scene, row, p)" if tree else "l.pmf"
    return [*lines, f"    return pdf * {pmf};", "}"]


def _infinite_text(kinds: list[str]) -> list[str]:
    """`row` is the same in all lanes."""
    if not kinds:
        return []
    lines = [
        "inline void infinite_light(Scene scene, int row, vec3 side, vec3 d, Wavelengths lambdas,",
        "                           Spectrum *radiance, real *pdf)",
        "{",
        "    LightRow l = light_at(scene, (integer)(row));",
        "    *radiance = spectrum_of(0.0f);",
        "    *pdf = 0.0f;",
    ]
    for kind in kinds:
        body = [
            f"{RECORDS[kind].name} light = {row_text(kind)};",
            f"*radiance = spectrum_sel(m, {kind}_radiance(light, scene, d, lambdas), *radiance);",
            f"*pdf = sel(m, {kind}_pdf(light, scene, side, d) * l.pmf, *pdf);",
        ]
        lines += case_text(kind, len(kinds) == 1, body)
    return [*lines, "}", '#include "lib/infinite.cl"']
