"""Writes a dancer with a skeleton as glTF: she turns on one toe, and her skirt swings by a morph.

    python scenes/dancer/generate.py
    clpt render scenes/dancer/dancer.glb -D time=0.7 -D shutter=0.05 --spp 512 -o dancer.png

Limbs are tubes around bones, whose rings follow two joints where these meet. All keys of the
animation are a tenth of a second apart.
"""

from __future__ import annotations

import json
import math
import struct
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).parent
JOINTS: dict[str, tuple[str | None, tuple[float, float, float]]] = {  # parent, place in T pose [m]
    "root": (None, (0, 0, 0)),
    "hips": ("root", (0, 1.0, 0)),
    "spine": ("hips", (0, 1.14, 0)),
    "chest": ("spine", (0, 1.3, 0)),
    "neck": ("chest", (0, 1.5, 0)),
    "head": ("neck", (0, 1.58, 0.01)),
    **{
        f"{name}_{side}": (f"{parent}_{side}" if parent in ("shoulder", "elbow", "hip", "knee",
                           "ankle") else parent, (x * (1 if side == "l" else -1), y, z))
        for side in ("l", "r")
        for name, parent, (x, y, z) in (
            ("shoulder", "chest", (0.16, 1.44, 0)),
            ("elbow", "shoulder", (0.42, 1.44, 0)),
            ("wrist", "elbow", (0.66, 1.44, 0)),
            ("hip", "hips", (0.085, 0.96, 0)),
            ("knee", "hip", (0.085, 0.52, 0.01)),
            ("ankle", "knee", (0.085, 0.1, 0)),
        )
    },
}  # fmt: skip
NAMES = list(JOINTS)
PLACES = np.array([place for _, place in JOINTS.values()], float)
TURN = 300.0  # degrees a second
STEP, LAST = 0.1, 1.2  # [s] of the keys


def weights_along(share: np.ndarray, joints: list[str], ends: list[float], blend: float) -> Any:
    """Joints (n, 4) and weights (n, 4) along a chain; ends: where each next joint begins."""
    made = np.zeros((len(share), len(NAMES)))
    left = np.ones(len(share))
    for joint, end in zip(joints[:-1], ends, strict=True):
        after = np.clip((share - end) / blend + 0.5, 0.0, 1.0)
        after = after * after * (3.0 - 2.0 * after)
        made[:, NAMES.index(joint)] += left * (1.0 - after)
        left = left * after
    made[:, NAMES.index(joints[-1])] += left
    return made


def tube(
    points: list[Any],
    radii: list[Any],
    joints: list[str],
    ends: list[float],
    blend: float = 0.12,
    rings: int = 40,
    sides: int = 20,
) -> dict[str, Any]:
    """A tube around a line of points; radii: one or (across, along z) for each of them."""
    line = np.array(points, float)
    length = np.linalg.norm(np.diff(line, axis=0), axis=1)
    at = np.concatenate([[0.0], np.cumsum(length)]) / length.sum()
    share = np.linspace(0.0, 1.0, rings)
    widths = np.array([np.broadcast_to(r, 2) for r in radii], float)
    middle = np.stack([np.interp(share, at, line[:, i]) for i in range(3)], axis=1)
    smooth = np.stack([np.interp(share, at, widths[:, i]) for i in range(2)], axis=1)
    for values in (middle, smooth):  # rounder than the corners of the line
        for _ in range(3):
            values[1:-1] = 0.25 * values[:-2] + 0.5 * values[1:-1] + 0.25 * values[2:]
    along = np.gradient(middle, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    deep = np.array([0.0, 0.0, 1.0]) - along * along[:, 2:]
    deep /= np.linalg.norm(deep, axis=1, keepdims=True)
    across = np.cross(along, deep)
    round_ = np.sqrt(np.clip(np.minimum(share, 1.0 - share) * rings * 0.4, 0.0, 1.0))
    round_[[0, -1]] = 1e-3
    angle = 2.0 * np.pi * np.arange(sides) / sides
    ring = across[:, None] * (smooth[:, :1] * np.cos(angle))[..., None]
    ring = ring + deep[:, None] * (smooth[:, 1:] * np.sin(angle))[..., None]
    vertices = middle[:, None] + ring * round_[:, None, None]
    weights = np.repeat(weights_along(share, joints, ends, blend), sides, axis=0)
    return grid(vertices, weights)


def grid(vertices: np.ndarray, weights: np.ndarray) -> dict[str, Any]:
    """Rings of vertices (rings, sides, 3), closed around, as triangles."""
    rings, sides = vertices.shape[:2]
    a = np.arange(rings - 1)[:, None] * sides + np.arange(sides)
    b = np.arange(rings - 1)[:, None] * sides + (np.arange(sides) + 1) % sides
    faces = np.stack([a, b, b + sides, a, b + sides, a + sides], axis=-1).reshape(-1, 3)
    flat = vertices.reshape(-1, 3)
    return {"vertices": flat, "faces": faces, "normals": normals(flat, faces), "weights": weights}


def normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    made = np.zeros_like(vertices)
    corners = vertices[faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    for i in range(3):
        np.add.at(made, faces[:, i], across)
    return made / np.maximum(np.linalg.norm(made, axis=1, keepdims=True), 1e-12)


def outward(part: dict[str, Any]) -> dict[str, Any]:
    """A closed part whose faces look outward."""
    corners = part["vertices"][part["faces"]]
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum()
    if volume < 0.0:
        part["faces"] = part["faces"][:, ::-1].copy()
        part["normals"] = -part["normals"]
    return part


def joined(parts: list[dict[str, Any]]) -> dict[str, Any]:
    firsts = np.cumsum([0, *(len(part["vertices"]) for part in parts)])
    made = {n: np.concatenate([p[n] for p in parts]) for n in ("vertices", "normals", "weights")}
    made["faces"] = np.concatenate([p["faces"] + f for p, f in zip(parts, firsts, strict=False)])
    return made


def figure() -> dict[str, dict[str, Any]]:
    """The parts of the dancer by their material."""
    skin, hair, shoes = [], [], []
    skin.append(tube([(0, 1.44, 0), (0, 1.52, 0), (0, 1.6, 0.005)], [0.05, 0.042, 0.045],
                     ["chest", "neck", "head"], [0.35, 0.75], 0.3, 16))  # fmt: skip
    head = [(0, 1.555, 0.03), (0, 1.6, 0.025), (0, 1.67, 0.015), (0, 1.73, 0.005), (0, 1.775, 0)]
    skin.append(tube(head, [(0.035, 0.045), (0.06, 0.075), (0.073, 0.088), (0.065, 0.08), 0.03],
                     ["head"], [], rings=24, sides=24))  # fmt: skip
    cap = [(0, 1.64, -0.05), (0, 1.69, -0.025), (0, 1.74, -0.012), (0, 1.79, -0.008)]
    hair.append(tube(cap, [0.03, (0.077, 0.075), (0.073, 0.085), 0.035], ["head"], [], rings=24,
                     sides=24))  # fmt: skip
    bun = [(0, 1.735, -0.125), (0, 1.77, -0.12), (0, 1.805, -0.115)]
    hair.append(tube(bun, [0.02, 0.045, 0.02], ["head"], [], rings=16))
    for side, sign in (("l", 1), ("r", -1)):
        arm = [(0.1, 1.435, 0), (0.16, 1.44, 0), (0.28, 1.44, 0), (0.42, 1.44, 0), (0.5, 1.44, 0),
               (0.65, 1.44, 0), (0.7, 1.44, 0), (0.77, 1.44, 0), (0.82, 1.44, 0)]  # fmt: skip
        radii = [0.04, 0.047, 0.04, 0.033, 0.035, 0.023, (0.014, 0.032), (0.012, 0.028), 0.008]
        skin.append(tube([(sign * x, y, z) for x, y, z in arm], radii,
                         ["chest", *(f"{n}_{side}" for n in ("shoulder", "elbow", "wrist"))],
                         [0.06, 0.44, 0.77], 0.13))  # fmt: skip
        x = sign * 0.085
        leg = [(x, 0.98, 0), (x, 0.86, 0), (x, 0.66, 0.01), (x, 0.52, 0.012), (x, 0.4, -0.01),
               (x, 0.25, -0.005), (x, 0.1, 0), (x, 0.06, 0.02)]  # fmt: skip
        radii = [0.07, 0.083, 0.063, 0.048, 0.052, 0.04, 0.029, 0.03]
        names = ["hips", *(f"{n}_{side}" for n in ("hip", "knee", "ankle"))]
        skin.append(tube(leg, radii, names, [0.05, 0.5, 0.95], 0.13))
        foot = [(x, 0.12, -0.035), (x, 0.07, -0.01), (x, 0.045, 0.07), (x, 0.03, 0.15),
                (x, 0.028, 0.19)]  # fmt: skip
        shoes.append(tube(foot, [0.03, 0.036, (0.036, 0.028), (0.03, 0.016), 0.01],
                          [f"ankle_{side}"], [], rings=20))  # fmt: skip
    trunk = [(0, 0.9, 0), (0, 0.98, 0), (0, 1.12, 0), (0, 1.3, 0.01), (0, 1.4, 0.005),
             (0, 1.455, 0)]  # fmt: skip
    wide = [(0.1, 0.08), (0.15, 0.11), (0.105, 0.08), (0.135, 0.1), (0.15, 0.085), (0.08, 0.055)]
    dress = [tube(trunk, wide, ["hips", "spine", "chest"], [0.32, 0.62], 0.3, rings=44, sides=28)]
    made = {"skin": skin, "hair": hair, "shoes": shoes, "dress": dress}
    return {name: joined([outward(part) for part in parts]) for name, parts in made.items()}


def skirt(flare: float) -> np.ndarray:
    """The rings of a skirt, which hangs, or flies out and lags behind the turn."""
    share = np.linspace(0.0, 1.0, 22)[:, None]
    angle = 2.0 * np.pi * np.arange(96) / 96
    fold = np.cos(12.0 * (angle - 0.5 * flare * share)) * share**1.5
    reach = 0.115 + (0.22 + 0.2 * flare) * share ** (0.9 - 0.2 * flare) + 0.022 * fold
    drop = (0.46 - 0.24 * flare) * share ** (1.3 - 0.1 * flare) + 0.02 * flare * fold
    drop = drop + 0.05 * flare * share * np.cos(3.0 * angle)
    lag = angle - 0.35 * flare * share
    return np.stack([reach * np.cos(lag), 1.07 - drop, 0.9 * reach * np.sin(lag)], axis=-1)


def quaternion(axis: tuple[float, float, float], degrees: float) -> np.ndarray:
    half = math.radians(degrees) / 2.0
    return np.array([*(np.array(axis) * math.sin(half)), math.cos(half)])


def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The rotation b, then a."""
    v = a[3] * b[:3] + b[3] * a[:3] + np.cross(a[:3], b[:3])
    return np.array([*v, a[3] * b[3] - a[:3] @ b[:3]])


def pose(time: float) -> dict[str, np.ndarray]:
    """Rotations of joints while she turns: a leg whips out, the arms open."""
    x, y, z = (1, 0, 0), (0, 1, 0), (0, 0, 1)
    whip = 0.5 - 0.5 * math.cos(2.0 * math.pi * time / 1.2)  # from 0 to 1 and back
    lean = quaternion(z, -4.0)
    return {
        "root": quaternion(y, TURN * time + 117.0),
        "hips": lean,
        "spine": quaternion(x, -4.0),
        "chest": product(quaternion(z, 5.0), quaternion(x, -4.0)),
        "neck": quaternion(y, -18.0),
        "head": quaternion(x, -6.0),
        "shoulder_l": product(quaternion(z, 62.0 - 40.0 * whip), quaternion(y, -22.0)),
        "elbow_l": quaternion(z, 30.0 + 8.0 * whip),
        "wrist_l": quaternion(z, 12.0),
        "shoulder_r": product(quaternion(z, 2.0 + 8.0 * whip), quaternion(y, 18.0 + 10.0 * whip)),
        "elbow_r": quaternion(y, 24.0 - 12.0 * whip),
        "wrist_r": quaternion(z, 10.0),
        "hip_l": product(quaternion(z, 3.0), quaternion(x, 0.0)),
        "ankle_l": quaternion(x, 62.0),
        "hip_r": product(quaternion(z, -30.0 - 52.0 * whip), quaternion(x, -25.0 + 15.0 * whip)),
        "knee_r": quaternion(x, 75.0 - 65.0 * whip),
        "ankle_r": quaternion(x, 55.0),
    }


class Binary:
    """A .glb in the making."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.views: list[Any] = []
        self.accessors: list[Any] = []

    def add(self, values: Any, kind: str, component: int, normalized: bool = False) -> int:
        dtype = {5126: "<f4", 5123: "<u2", 5125: "<u4", 5121: "u1"}[component]
        array = np.ascontiguousarray(values, dtype)
        self.views.append({"buffer": 0, "byteOffset": len(self.data), "byteLength": array.nbytes})
        self.data += array.tobytes() + bytes(-array.nbytes % 4)
        accessor: dict[str, Any] = {
            "bufferView": len(self.views) - 1, "componentType": component,
            "count": len(array), "type": kind,
        }  # fmt: skip
        if normalized:
            accessor["normalized"] = True
        if kind in ("VEC3", "SCALAR") and component == 5126:
            rows = array.reshape(len(array), -1)
            accessor |= {"min": rows.min(0).tolist(), "max": rows.max(0).tolist()}
        self.accessors.append(accessor)
        return len(self.accessors) - 1

    def part(self, part: dict[str, Any], material: int) -> dict[str, Any]:
        """A primitive; of the weights the four greatest, as bytes that add up to 255."""
        attributes = {
            "POSITION": self.add(part["vertices"], "VEC3", 5126),
            "NORMAL": self.add(part["normals"], "VEC3", 5126),
        }
        if "weights" in part:
            order = np.argsort(-part["weights"], axis=1, kind="stable")[:, :4]
            given = np.take_along_axis(part["weights"], order, axis=1)
            whole = np.rint(255.0 * given / given.sum(axis=1, keepdims=True)).astype(int)
            whole[:, 0] += 255 - whole.sum(axis=1)
            attributes["JOINTS_0"] = self.add(order * (whole > 0), "VEC4", 5121)
            attributes["WEIGHTS_0"] = self.add(whole, "VEC4", 5121, True)
        faces = self.add(part["faces"].reshape(-1), "SCALAR", 5123)
        return {"attributes": attributes, "indices": faces, "material": material}


def square(corners: list[Any]) -> dict[str, Any]:
    vertices = np.array(corners, float)
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    return {"vertices": vertices, "faces": faces, "normals": normals(vertices, faces)}


def paint(colour: list[float], roughness: float, **more: Any) -> dict[str, Any]:
    surface = {"baseColorFactor": [*colour, 1.0], "metallicFactor": 0.0,
               "roughnessFactor": roughness}  # fmt: skip
    return {"pbrMetallicRoughness": surface, **more}


def main() -> None:
    binary = Binary()
    materials = [
        paint([0.6, 0.32, 0.2], 0.5), paint([0.04, 0.02, 0.015], 0.35),
        paint([0.75, 0.42, 0.38], 0.3), paint([0.5, 0.012, 0.03], 0.45),
        paint([0.62, 0.02, 0.05], 0.6, doubleSided=True),
        paint([0.05, 0.035, 0.028], 0.22), paint([0.035, 0.04, 0.06], 0.9),
        paint([0, 0, 0], 1.0, emissiveFactor=[1.0, 0.82, 0.62],
              extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 22.0}}),
        paint([0, 0, 0], 1.0, emissiveFactor=[0.45, 0.65, 1.0],
              extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 16.0}}),
    ]  # fmt: skip
    parts = figure()
    body = [
        binary.part(parts[name], i) for i, name in enumerate(("skin", "hair", "shoes", "dress"))
    ]
    weights = np.zeros((22 * 96, len(NAMES)))
    weights[:, NAMES.index("hips")] = 1.0
    hanging, flying = grid(skirt(0.0), weights), grid(skirt(1.0), weights)
    cloth = binary.part(hanging, 4)
    cloth["targets"] = [
        {
            "POSITION": binary.add(flying["vertices"] - hanging["vertices"], "VEC3", 5126),
            "NORMAL": binary.add(flying["normals"] - hanging["normals"], "VEC3", 5126),
        }
    ]
    room = [
        binary.part(square([(-9, 0, 9), (9, 0, 9), (9, 0, -4), (-9, 0, -4)]), 5),
        binary.part(square([(-9, 0, -3.5), (9, 0, -3.5), (9, 7, -3.5), (-9, 7, -3.5)]), 6),
    ]
    lamps = [
        binary.part(square([(-3.2, 3.4, 1.2), (-3.2, 2.0, 1.2), (-2.4, 2.0, 2.4),
                            (-2.4, 3.4, 2.4)]), 7),
        binary.part(square([(3.0, 2.8, -1.6), (3.0, 1.2, -1.6), (2.5, 1.2, -2.6),
                            (2.5, 2.8, -2.6)]), 8),
    ]  # fmt: skip
    nodes: list[Any] = []
    for name, (parent, place) in JOINTS.items():
        offset = np.array(place) - (PLACES[NAMES.index(parent)] if parent else 0.0)
        nodes.append({"name": name, "translation": np.round(offset, 5).tolist()})
        if parent:
            nodes[NAMES.index(parent)].setdefault("children", []).append(len(nodes) - 1)
    nodes[0]["translation"] = [0.0, 0.105, 0.0]  # on her toe
    bind = np.tile(np.eye(4), (len(NAMES), 1, 1))
    bind[:, :3, 3] = -PLACES
    skin = {"joints": list(range(len(NAMES))), "skeleton": 0}
    skin["inverseBindMatrices"] = binary.add(bind.transpose(0, 2, 1).reshape(-1, 16), "MAT4", 5126)
    view = [-0.22, 1.16, 5.2]
    meshes = [
        {"name": "body", "primitives": body},
        {"name": "skirt", "primitives": [cloth], "weights": [0.6]},
        {"name": "room", "primitives": room},
        {"name": "lamps", "primitives": lamps},
    ]
    first = len(nodes)
    nodes += [
        {"name": "dancer", "mesh": 0, "skin": 0}, {"name": "skirt", "mesh": 1, "skin": 0},
        {"name": "room", "mesh": 2}, {"name": "lamps", "mesh": 3},
        {"name": "camera", "camera": 0, "translation": view},
    ]  # fmt: skip
    times = np.arange(0.0, LAST + STEP / 2, STEP)
    clock = binary.add(times, "SCALAR", 5126)
    poses = [pose(float(t)) for t in times]
    channels, samplers = [], []
    for name in poses[0]:
        rows = np.array([one[name] for one in poses])
        still = not np.ptp(rows, axis=0).any()
        nodes[NAMES.index(name)]["rotation"] = rows[0].tolist()
        if still:
            continue
        samplers.append({"input": clock, "output": binary.add(rows, "VEC4", 5126)})
        target = {"node": NAMES.index(name), "path": "rotation"}
        channels.append({"sampler": len(samplers) - 1, "target": target})
    swing = 0.62 + 0.38 * np.sin(2.0 * np.pi * times / LAST)
    samplers.append({"input": clock, "output": binary.add(swing, "SCALAR", 5126)})
    target = {"node": first + 1, "path": "weights"}
    channels.append({"sampler": len(samplers) - 1, "target": target})
    document = {
        "asset": {"version": "2.0", "generator": "scenes/dancer/generate.py"},
        "extensionsUsed": ["KHR_materials_emissive_strength"],
        "scene": 0,
        "scenes": [{"nodes": [0, *range(first, len(nodes))]}],
        "nodes": nodes, "meshes": meshes, "materials": materials, "skins": [skin],
        "animations": [{"name": "turn", "channels": channels, "samplers": samplers}],
        "cameras": [
            {"type": "perspective", "perspective": {"yfov": 0.46, "aspectRatio": 0.75,
                                                    "znear": 0.1}}
        ],
        "buffers": [{"byteLength": len(binary.data)}],
        "bufferViews": binary.views,
        "accessors": binary.accessors,
    }  # fmt: skip
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    body_ = bytes(binary.data)
    head = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(body_))
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(body_), b"BIN\0") + body_
    (HERE / "dancer.glb").write_bytes(head + chunks)


if __name__ == "__main__":
    main()
