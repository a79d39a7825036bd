"""Kernel text of shapes: their structs, and the intersection of rays with analytic shapes."""

from __future__ import annotations

from clpt.geometry.shape_records import ANALYTIC, ONE_OF, ROWS, VALUES
from clpt.records import SHAPE
from clpt.render.records import Features
from clpt.render.records.dispatch import Case, Function, active, function

_FIRST = next(m.word for m in ROWS["curve"].members if m.name == "first")


def virtual_files(features: Features) -> dict[str, str]:
    """Return the structs of points of shapes, and generated/shape/<kind>.cl for each kind.

    Such a file has the kind's struct, its loader and its functions.
    """
    files = {f"generated/{record.snake_name}.cl": record.select_text() for record in VALUES}
    many = not features.lights.few
    structs = {kind: record.row_text(many and kind == "triangle") for kind, record in ROWS.items()}
    structs |= {
        kind: f'#include "generated/shape/{single}.cl"\n' for kind, single in ONE_OF.items()
    }
    for kind, struct in structs.items():
        files[f"generated/shape/{kind}.cl"] = f'{struct}#include "shapes/kinds/{kind}.cl"\n'
    return files


def hit_text(features: Features) -> str:
    """Return `shape_hit`, which intersects an analytic shape, the same for all lanes."""
    if not features.geometry.analytic:
        return ""
    word = {member.name: member.word for member in SHAPE.members}
    moves = features.motion.shapes
    answer = "none =" if moves else "return"
    none = "ShapeHit none = {FAR, {0.0f, 0.0f, 1.0f}, {0.0f, 0.0f}};"
    to_rest = _at_rest(word["number"], none) if moves else []
    back = _in_motion() if moves else [none]
    curves = "curves" in features.geometry.analytic
    number = f"(integer)((int)shape[{word['number']}])"
    piece = f"scene.spheres + (int)gather_i(scene.geometry, params + {_FIRST}) + CURVE_WORDS * prim"
    beside = f"if (kind == {_number('curves')} && curve_beside_one({piece}, o, d)) return none;"
    cases = [beside] * curves + [
        f"if (kind == {_number(kind)}) {answer} {ONE_OF.get(kind, kind)}_intersect("
        f"{_row_text(features, kind, 'params', number)}, o, d, tmin, tmax);"
        for kind in features.geometry.analytic
    ]
    many = len(ONE_OF.keys() & set(features.geometry.analytic))
    # An intersection with a shape that moves separately needs the shape's row.
    rows = ("single", "many", "mixed")[2 if many and (moves or _keyed(features)) else many]
    signature = (
        "ShapeHit shape_hit(Scene scene, int prim, int row, vec3 o, vec3 d, real tmin, real tmax)"
    )
    body = [
        "global const uint *shape = scene.shapes + row * SHAPE_ROW_WORDS;",
        f"int kind = (int)shape[{word['kind']}];",
        f"integer params = (int)shape[{word['params']}];",
        *([none] if curves and not moves else []),
        *to_rest,
        *cases,
        *back[curves and not moves :],
        "return none;",
    ]
    files = '#include "generated/motion.cl"\n' * moves
    files += '#include "tracing/curves.cl"\n' * curves
    files += f'#include "tracing/shape_rows.cl#{rows}"\n'
    return _includes(features) + files + function(signature, *body)


def _at_rest(number: int, none: str) -> list[str]:
    """Return statements that take the ray to the place where a moving shape was lowered."""
    return [
        none,
        f"Motion motion = motion_of_shape(scene, (integer)((int)shape[{number}]));",
        "real longer = motion_length_back(motion, d);",
        "o = motion_point_back(motion, o);",
        "d = scale3(motion_back(motion, d), 1.0f / longer);",
        "tmin *= longer;",
        "tmax = min_r(tmax * longer, (real)(FAR));",
    ]


def _in_motion() -> list[str]:
    """Return statements that take a hit back to the world."""
    return [
        "none.t = sel(none.t < tmax, none.t / longer, (real)(FAR));",
        "none.n = normalize3(motion_normal(motion, none.n));",
    ]


def points_text(features: Features) -> str:
    """Return `<verb>_of_shape`: they compute points of analytic shapes for shading."""
    if not features.geometry.analytic:
        return ""
    functions = [_of_shape(features, "vec3", "onto", "vec3 p"), _of_shape(features, "real", "size")]
    if features.geometry.tangents:
        point = ("vec3 p", "vec2 uv")
        functions += [_of_shape(features, "vec3", verb, *point) for verb in ("dpdu", "dpdv")]
    return _includes(features) + "".join(functions)


def _of_shape(features: Features, type_: str, verb: str, *parameters: str) -> str:
    """Return `<verb>_of_shape`, which chooses among `<kind>_<verb>` of the scene's kinds."""
    head = ", ".join(("Scene scene", "ShapeRow shape", "integer prim", *parameters))
    names = [parameter.split()[-1] for parameter in parameters]
    indices = active("shape.params"), active("shape.number")
    cases = [
        Case(
            f"shape.kind == {_number(kind)}",
            f"{ONE_OF.get(kind, kind)}_{verb}"
            f"({', '.join((_row_text(features, kind, *indices, 'm'), *names))})",
        )
        for kind in features.geometry.analytic
    ]
    nothing = "0.0f" if type_ == "real" else "v3(0.0f, 0.0f, 0.0f)"
    return Function(f"{type_} {verb}_of_shape({head})", nothing, cases).text()


def _includes(features: Features) -> str:
    files = "".join(
        f'#include "generated/shape/{kind}.cl"\n' for kind in features.geometry.analytic
    )
    if not _keyed(features):
        return files
    first = f"#define SPHERES_FIRST {ROWS['sphere'].words}\n"
    included = ("generated/motion.cl", "shapes/analytic.cl#keyed_spheres")
    return files + first + "".join(f'#include "{name}"\n' for name in included)


def _keyed(features: Features) -> bool:
    """Return whether each sphere of a `spheres` shape has a row for each key."""
    return features.motion.spheres


def _number(kind: str) -> int:
    """Return the value of ShapeRow.kind for an analytic shape."""
    return 1 + ANALYTIC.index(kind)


def _row_text(
    features: Features, kind: str, params: str, number: str, mask: str = "mask_of(1)"
) -> str:
    """Return the expression for the parameters of primitive `prim`."""
    if kind == "spheres" and _keyed(features):
        return f"spheres_then(scene, {params}, prim, {number}, scene.time, {mask})"
    if kind in ONE_OF:
        return f"{kind}_one(scene, {params}, prim, {mask})"
    return f"{kind}_row(scene.geometry, {params})"
