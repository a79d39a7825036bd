# SPDX-License-Identifier: GPL-3.0-or-later
"""Patterns of Cycles, such as its noises, in nodes of clpt's graphs; functions as in operations."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import bpy

from .graphs import TURN, Graph, Site, Value, hashed

PERLIN = {"1D": "noise1d", "2D": "noise2d", "3D": "noise3d", "4D": "noise4d"}


def _offset(seed: float, count: int) -> list[float]:
    """Return where the further channels of a noise begin."""
    keys = [(seed,)] if count == 1 else [(seed, float(i)) for i in range(count)]
    return [100.0 + 100.0 * hashed(*key) for key in keys]


def _place(tree: Any, at: Site, dimensions: str) -> Value:
    """Return what a pattern is made of: a number, a vector, or both."""
    g = tree.g
    if dimensions == "1D":
        return tree.input(at, "W")
    v = tree.vector(at, "generated")
    if dimensions == "2D":
        return g("convert", v, channels=2)
    return g("combine4", v[0], v[1], v[2], tree.input(at, "W")) if dimensions == "4D" else v


def _noise(tree: Any, at: Site) -> Value:
    node, g, count = at.node, tree.g, int(at.node.noise_dimensions[0])
    p = _place(tree, at, node.noise_dimensions) * tree.input(at, "Scale")
    perlin, parts = PERLIN[node.noise_dimensions], []
    bend = tree.input(at, "Distortion")
    if bend.constant() != [0.0]:
        seeds = [_offset(float(i), count) for i in range(count)]
        parts = [g(perlin, p + seed) * bend for seed in seeds]
        p = p + (parts[0] if count == 1 else g(f"combine{count}", *parts))
    seed = float(count)
    places = [p, p + _offset(seed, count), p + _offset(seed + 1.0, count)]
    kind = node.noise_type
    if at.output != "Color":
        return _octaves(tree, at, perlin, kind, p)
    return g("combine3", *(_octaves(tree, at, perlin, kind, place) for place in places))


def _octaves(tree: Any, at: Site, perlin: str, kind: str, p: Value) -> Value:
    """Return octaves of noise (Musgrave 1994; Texturing and Modeling, chapter 16)."""
    g, detail = tree.g, min(max(tree.constant(at, "Detail", 2.0), 0.0), 15.0)
    rough = g("max", tree.input(at, "Roughness"), 0.0)
    lacunarity, whole, rest = tree.input(at, "Lacunarity"), int(detail), detail - int(detail)
    if kind == "FBM":
        return _fbm(g, perlin, p, (detail, rough, lacunarity), normalized=at.node.normalize)
    offset, gain = (tree.input(at, key) for key in ("Offset", "Gain"))
    count = whole + (1 if rest else 0) if kind != "RIDGED_MULTIFRACTAL" else whole
    power, weight = g.value(1.0), g.value(1.0)
    value = g.value(1.0 if kind == "MULTIFRACTAL" else 0.0)
    for i in range(count + 1):
        share, n = (rest if i > whole else 1.0), g(perlin, p)
        if kind == "MULTIFRACTAL":
            value = value * (n * power * share + 1.0)
        elif kind == "HETERO_TERRAIN":
            step = n + offset if i == 0 else (n + offset) * power * value
            value = value + step * share
        elif kind == "HYBRID_MULTIFRACTAL":
            weight = g("ifgreater", weight, 1e-3, g("min", weight, 1.0), 0.0)  # 0: it ends there
            signal = (n + offset) * power
            value = value + weight * signal * share
            weight = weight * gain * signal
        else:
            signal = offset - g("absval", n)
            signal = signal * signal * (weight if i else 1.0)
            value = value + signal * (power if i else 1.0)
            weight = (signal * gain).clamped()
        power, p = power * rough, p * lacunarity
    return value


def _fbm(
    g: Graph, perlin: str, p: Value, settings: tuple[float, Any, Any], *, normalized: bool
) -> Value:
    """Return octaves of noise, each less strong by `rough`; a part of the last one."""
    detail, rough, lacunarity = settings
    whole, rest = int(detail), detail - int(detail)
    rough = g.value(rough)

    def octaves(count: int) -> Value:
        if perlin in ("noise2d", "noise3d"):
            place = {"noise2d": "texcoord", "noise3d": "position"}[perlin]
            inputs = {place: p, "lacunarity": lacunarity, "diminish": rough}
            value = g(perlin.replace("noise", "fractal"), octaves=float(count), **inputs)
        else:
            value, power, at = g.value(0.0), g.value(1.0), p
            for _ in range(count):
                value = value + g(perlin, at) * power
                power, at = power * rough, at * lacunarity
        total, power = g.value(0.0), g.value(1.0)
        for _ in range(count):
            total, power = total + power, power * rough
        return value / total * 0.5 + 0.5 if normalized else value

    low = octaves(whole + 1)
    return g("mix", octaves(whole + 2), low, rest) if rest else low


def _voronoi(tree: Any, at: Site) -> Value | None:
    node, g = at.node, tree.g
    if node.voronoi_dimensions in ("1D", "4D"):
        return tree.told(at, "Voronoi Texture of one or four dimensions is grey", 0.5)
    if bpy.app.version < (5, 0):
        tree.tell("Voronoi Texture has the cells of Blender 5, which lie elsewhere")
    feature = ("F1", "F2", "SMOOTH_F1", "DISTANCE_TO_EDGE", "N_SPHERE_RADIUS").index(node.feature)
    smoothness = (tree.input(at, "Smoothness") * 0.5) if feature == 2 else g.value(0.25)
    settings = {
        "randomness": tree.input(at, "Randomness").clamped(), "feature": feature,
        "smoothness": g("clamp", smoothness, 0.0, 0.5), "exponent": tree.input(at, "Exponent"),
        "metric": ("EUCLIDEAN", "MANHATTAN", "CHEBYCHEV", "MINKOWSKI").index(node.distance)
        if feature < 3 else 0, "output": ("Distance", "Color", "Position").index(
            at.output if at.output != "Radius" else "Distance"),
    }  # fmt: skip
    flat = node.voronoi_dimensions == "2D"
    scale = tree.input(at, "Scale")
    p = _place(tree, at, node.voronoi_dimensions) * scale

    def octave(factor: Any) -> Value:
        place = {"texcoord" if flat else "position": p * factor}
        found = g("voronoi2d" if flat else "voronoi3d", **place, **settings)
        return found[0] if settings["output"] == 0 else found

    value = _cells(tree, at, octave, settings) if feature < 4 else octave(1.0)
    return value / scale if at.output == "Position" else value


def _cells(tree: Any, at: Site, octave: Callable[[Any], Value], settings: Any) -> Value:
    """Return octaves of Voronoi's cells: sums, and of distances to edges the least."""
    node, g, output = at.node, tree.g, settings["output"]
    detail = min(max(tree.constant(at, "Detail", 0.0), 0.0), 15.0)
    rough, lacunarity = tree.input(at, "Roughness").clamped(), tree.input(at, "Lacunarity")
    edge, single = settings["feature"] == 3, detail == 0.0 or rough.constant() == [0.0]
    reach = settings["randomness"] * 0.5 + 0.5
    most = g.value(0.0)
    value, amplitude, scale = g.value(8.0 if edge else 0.0), g.value(1.0), g.value(1.0)
    for i in range(1 if single else math.ceil(detail) + 1):
        share = 1.0 if i <= detail else detail - int(detail)
        found = octave(scale)
        if single:
            value, most = found, reach if edge else g.value(1.0)
        elif edge:
            value = g(
                "mix", g("mix", g("min", value, found / scale), value, amplitude), value, share
            )
            most = g("mix", g("mix", reach / scale, most, amplitude), most, share)
        elif output == 2:
            value = g("mix", found / scale, value, amplitude * share)
        else:
            value, most = value + found * amplitude * share, most + amplitude * share
        amplitude, scale = amplitude * rough, scale * lacunarity
    if not node.normalize or output == 2:
        return value
    if output == 1 or edge:
        return value / most
    metric, corner = node.distance, reach * (2.0 if settings["feature"] == 1 else 1.0)
    count = 2.0 if node.voronoi_dimensions == "2D" else 3.0
    far = {"EUCLIDEAN": count**0.5, "MANHATTAN": count, "CHEBYCHEV": 1.0}.get(metric)
    far = g("power", count, 1.0 / settings["exponent"]) if far is None else far
    return value / (most * corner * far)


def _waves(tree: Any, at: Site) -> Value:
    node, g = at.node, tree.g
    p = (tree.vector(at, "generated") * tree.input(at, "Scale") + 1e-6) * 0.999999
    bands = node.wave_type == "BANDS"
    way = node.bands_direction if bands else node.rings_direction
    if bands:
        n = (p[0] + p[1] + p[2]) * 10.0 if way == "DIAGONAL" else p["XYZ".index(way)] * 20.0
    else:
        n = g("magnitude", p * [float(way != axis) for axis in "XYZ"]) * 20.0
    n = n + tree.input(at, "Phase Offset")
    bend = tree.input(at, "Distortion")
    if bend.constant() != [0.0]:
        detail = min(max(tree.constant(at, "Detail", 2.0), 0.0), 15.0)
        rough = tree.input(at, "Detail Roughness").clamped()
        q = p * tree.input(at, "Detail Scale")
        n = n + bend * (_fbm(g, "noise3d", q, (detail, rough, 2.0), normalized=True) * 2.0 - 1.0)
    if node.wave_profile == "SIN":
        return g("sin", n - 0.5 * math.pi) * 0.5 + 0.5
    n = n / TURN
    return g("fract", n) if node.wave_profile == "SAW" else g("absval", n - g("round", n)) * 2.0


def _checker(tree: Any, at: Site) -> Value:
    g = tree.g
    p = (tree.vector(at, "generated") * tree.input(at, "Scale") + 1e-6) * 0.999999
    cell = g("floor", p)
    odd = g("modulo", cell[0] + cell[1] + cell[2], 2.0)
    return odd if at.output == "Fac" else g("mix", *(tree.input(at, c) for c in (
        "Color1", "Color2")), odd)  # fmt: skip


def _bricks(tree: Any, at: Site) -> Value:
    node, g = at.node, tree.g
    p = tree.vector(at, "generated") * tree.input(at, "Scale")
    pairs = {"size": ("Brick Width", "Row Height"), "mortar": ("Mortar Size", "Mortar Smooth")}
    inputs = {
        key: g("combine2", *(tree.input(at, name) for name in names))
        for key, names in pairs.items()
    }
    off = node.offset_frequency == 0 or node.squash_frequency == 0
    inputs["offset"] = g.value([0.0 if off else node.offset, max(node.offset_frequency, 1)])
    inputs["squash"] = g.value([1.0 if off else node.squash, max(node.squash_frequency, 1)])
    flat = g("convert", p, channels=2)
    found = g("brick", texcoord=flat, bias=tree.input(at, "Bias"), **inputs)
    if at.output == "Fac":
        return found[1]
    first, second, mortar = (tree.input(at, c) for c in ("Color1", "Color2", "Mortar"))
    return g("mix", mortar, g("mix", second, first, found[0]), found[1])


def _gradient(tree: Any, at: Site) -> Value:
    g, p, kind = tree.g, tree.vector(at, "generated"), at.node.gradient_type
    ball = g("max", 0.999999 - g("magnitude", p), 0.0)
    r, eased = g("max", p[0], 0.0), p[0].clamped()
    return {
        "LINEAR": lambda: p[0], "QUADRATIC": lambda: r * r, "DIAGONAL": lambda: (p[0] + p[1]) * 0.5,
        "EASING": lambda: eased * eased * (3.0 - eased * 2.0),
        "RADIAL": lambda: g("atan2", p[1], p[0]) / TURN + 0.5,
        "QUADRATIC_SPHERE": lambda: ball * ball, "SPHERICAL": lambda: ball,
    }[kind]().clamped()  # fmt: skip


MAGIC = (  # which of x, y, z, its function and sign, and the signs within
    ("y", "cos", -1, (1, -1, 1)), ("x", "cos", 1, (1, -1, -1)), ("z", "sin", 1, (-1, -1, -1)),
    ("x", "cos", -1, (-1, 1, -1)), ("y", "sin", -1, (-1, 1, 1)), ("y", "cos", -1, (-1, 1, 1)),
    ("x", "cos", 1, (1, 1, 1)), ("z", "sin", 1, (1, 1, -1)), ("x", "cos", -1, (-1, -1, 1)),
    ("y", "sin", -1, (1, -1, 1)),
)  # fmt: skip


def _magic(tree: Any, at: Site) -> Value:
    g, bend = tree.g, tree.input(at, "Distortion")
    p = tree.vector(at, "generated") * tree.input(at, "Scale")
    p = g("combine3", *(g("modulo", p[i], TURN) for i in range(3)))
    v = {
        "x": g("sin", (p[0] + p[1] + p[2]) * 5.0), "y": g("cos", (p[1] - p[0] - p[2]) * 5.0),
        "z": -g("cos", (p[2] - p[0] - p[1]) * 5.0),
    }  # fmt: skip
    for i, (axis, function, sign, signs) in enumerate(MAGIC[: at.node.turbulence_depth]):
        v = {key: value * bend for key, value in v.items()} if i == 0 else v
        inner = v["x"] * signs[0] + v["y"] * signs[1] + v["z"] * signs[2]
        v[axis] = g(function, inner) * bend * float(sign)
    double = g("ifequal", bend, 0.0, 1.0, bend * 2.0)
    color = g("combine3", *(0.5 - value / double for value in v.values()))
    return (color[0] + color[1] + color[2]) / 3.0 if at.output == "Fac" else color


def _white(tree: Any, at: Site) -> Value:
    kind = at.node.noise_dimensions
    p = _place(tree, at, kind)
    found = tree.g("whitenoise", p, dimensions=int(kind[0]))
    return found[0] if at.output == "Value" else found


READ: dict[str, Callable[[Any, Site], Value | None]] = {
    "TEX_NOISE": _noise, "TEX_VORONOI": _voronoi, "TEX_WAVE": _waves, "TEX_CHECKER": _checker,
    "TEX_BRICK": _bricks, "TEX_GRADIENT": _gradient, "TEX_MAGIC": _magic,
    "TEX_WHITE_NOISE": _white,
}  # fmt: skip
