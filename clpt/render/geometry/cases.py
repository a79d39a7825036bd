"""Kernel text of shapes: their structs, and the intersection of rays with analytic shapes."""

from __future__ import annotations

from clpt.geometry.shapes import ANALYTIC, ONE_OF, ROWS, VALUES
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
    """Return `shape_hit` of kernels/shapes/analytic.cl, with `shape_case`, a hit by its kind."""
    analytic, moves = features.geometry.analytic, features.motion.shapes
    if not analytic:
        return ""
    curves = "curves" in analytic
    piece = f"scene.spheres + (int)gather_i(scene.geometry, params + {_FIRST}) + CURVE_WORDS * prim"
    beside = f"if (kind == {_number('curves')} && curve_beside_one({piece}, o, d)) return none;"
    number = "(integer)((int)shape[SHAPE_ROW_NUMBER])"
    cases = [
        f"if (kind == {_number(kind)}) return {ONE_OF.get(kind, kind)}_intersect("
        f"{_row_text(features, kind, 'params', number)}, o, d, tmin, tmax);"
        for kind in analytic
    ]
    body = [
        "int kind = (int)shape[SHAPE_ROW_KIND];",
        "integer params = (int)shape[SHAPE_ROW_PARAMS];",
        "ShapeHit none = {FAR, {0.0f, 0.0f, 1.0f}, {0.0f, 0.0f}};",
        *([beside] * curves),
        *cases,
        "return none;",
    ]
    many = len(ONE_OF.keys() & set(analytic))
    # An intersection with a shape that moves separately needs the shape's row.
    rows = ("single", "many", "mixed")[2 if many and (moves or _keyed(features)) else many]
    files = '#include "generated/motion.cl"\n' * moves
    files += '#include "tracing/curves.cl"\n' * curves
    files += f'#include "tracing/shape_rows.cl#{rows}"\n'
    arguments = (
        "Scene scene, int prim, global const uint *shape, vec3 o, vec3 d, real tmin, real tmax"
    )
    case = function(f"ShapeHit shape_case({arguments})", *body)
    hit = f'#include "shapes/analytic.cl#{"moving_hit" if moves else "hit"}"\n'
    return _includes(features) + files + case + hit


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
