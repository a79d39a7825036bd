"""Scenes as glTF 2.0: meshes, instances, motion, the camera and punctual lights.

What shows as 1 in the scene's picture is 1 cd/m^2 in the file, as viewers show it.
"""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import transforms
from clpt.arrays import Floats, on_host
from clpt.errors import SceneError
from clpt.files import output_files
from clpt.formats import as_meshes
from clpt.formats.as_openpbr import MIRRORED, rgb, split
from clpt.formats.gltf.cameras_lights import FROM_GLTF, LIGHTS
from clpt.formats.gltf.export_materials import MaterialWriter
from clpt.geometry import lamps
from clpt.scene import Scene, lights, shapes
from clpt.scene.cameras import Orthographic, Perspective, ThinLens
from clpt.scene.motion import Deformation, Keys, decomposed
from clpt.scene.shapes import Mesh, Shape
from clpt.scene.textures import SECOND_UV, Texture

FLOAT, WORD = 5126, 5125  # types of components
WIDTHS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
LISTS = ("accessors", "bufferViews", "materials", "meshes", "images", "samplers", "textures",
         "cameras")  # fmt: skip


def save(scene: Scene, path: Path) -> list[str]:
    """Write a .glb, or a .gltf with a .bin beside it; return what was lost, a sentence each.

    Raises SceneError where it cannot be written.
    """
    film = scene.film
    writer = _Writer(float(film.exposure) * 2.0 ** float(film.display_exposure))
    writer.scene(lamps.plainly_lit(scene))
    document, content = writer.document(), bytes(writer.content)
    buffer: dict[str, Any] = {"byteLength": len(content)}
    document["buffers"] = [buffer]
    try:
        if path.suffix.lower() == ".gltf":
            binary = output_files.beside(path, ".bin")
            buffer["uri"] = binary.name
            output_files.write(binary, content)
            output_files.write_text(path, json.dumps(document))
        else:
            output_files.write(path, _packed(json.dumps(document).encode(), content))
    except OSError as error:
        raise SceneError(f"cannot be written: {error.strerror}", file=path) from None
    return list(writer.materials.lost)


def is_lit(document: dict[str, object]) -> bool:
    """Return whether a file that `save` wrote has its lights: its surfaces need no studio."""
    asset = document.get("asset")
    return isinstance(asset, dict) and asset.get("extras") == {"lit": True}


def _packed(text: bytes, content: bytes) -> bytes:
    text += b" " * (-len(text) % 4)
    header = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(content))
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    return header + chunks + struct.pack("<I4s", len(content), b"BIN\0") + content


class _Writer:
    """Writes a scene; meshes and materials that several shapes share are written once."""

    def __init__(self, unit: float):
        self.content = bytearray()
        self.lists: dict[str, Any] = {name: [] for name in LISTS} | {"used": set()}
        self.materials = MaterialWriter(self.lists, self.view, unit)
        self.nodes: list[dict[str, Any]] = []
        self.lights: list[dict[str, Any]] = []
        self.samplers: list[dict[str, Any]] = []
        self.channels: list[dict[str, Any]] = []
        self.meshes: dict[Any, tuple[int, Shape]] = {}
        self.start, self.lit = 0.0, False

    def warn(self, message: str) -> None:
        self.materials.warn(message)

    def document(self) -> dict[str, Any]:
        used = sorted(self.lists.pop("used") | ({LIGHTS} if self.lights else set()))
        children = {child for node in self.nodes for child in node.get("children", ())}
        roots = [i for i in range(len(self.nodes)) if i not in children]
        parts: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "clpt", "extras": {"lit": self.lit}},
            "scene": 0, "scenes": [{"nodes": roots}], "nodes": self.nodes,
            "extensionsUsed": used, **self.lists,
        }  # fmt: skip
        if self.lights:
            parts["extensions"] = {LIGHTS: {"lights": self.lights}}
        if self.channels:
            parts["animations"] = [{"samplers": self.samplers, "channels": self.channels}]
        return {name: value for name, value in parts.items() if value != []}

    def view(self, content: bytes) -> int:
        """Add bytes to the buffer; return the number of their view."""
        self.lists["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(self.content), "byteLength": len(content)}
        )
        self.content += content + b"\0" * (-len(content) % 4)
        return len(self.lists["bufferViews"]) - 1

    def accessor(self, values: ArrayLike, kind: int = FLOAT) -> int:
        """Add rows (n, k) of numbers; return the number of their accessor."""
        rows = np.ascontiguousarray(values, np.float32 if kind == FLOAT else np.uint32)
        rows = rows.reshape(len(rows), -1)
        self.lists["accessors"].append(
            {
                "bufferView": self.view(rows.tobytes()), "componentType": kind, "count": len(rows),
                "type": WIDTHS[rows.shape[1]], "min": rows.min(0).tolist(),
                "max": rows.max(0).tolist(),
            }
        )  # fmt: skip
        return len(self.lists["accessors"]) - 1

    def scene(self, scene: Scene) -> None:
        moving: list[Any] = [*scene.shapes, *scene.lights, scene.camera]
        keys = [part.motion.times[0] for part in moving if part.motion is not None]
        keys += [s.deformation.times[0] for s in scene.shapes if s.deformation is not None]
        self.start = min([0.0, *keys])
        self.camera(scene)
        for shape in scene.shapes:
            self.shape(shape)
        for light in scene.lights:
            self.light(light)
        shutter = scene.camera.shutter
        if self.channels and shutter is not None:
            times = f"-D time={shutter.open - self.start:g} "
            times += f"-D shutter={shutter.close - shutter.open:g}"
            self.warn(f"when the shutter is open: render it with {times}")
        if scene.camera.medium is not None:
            self.warn("the medium around the camera")

    def node(self, matrix: NDArray[Any], motion: Keys | None = None, **values: object) -> int:
        """Add a node at a place, which a motion moves as its parent; return the outer one."""
        if not np.array_equal(matrix, np.eye(4)):
            values["matrix"] = np.asarray(matrix, float).T.reshape(-1).tolist()
        self.nodes.append(values)
        inner = len(self.nodes) - 1
        if motion is None:
            return inner
        self.nodes.append({"children": [inner]})
        outer, parts = inner + 1, [decomposed(key) for key in motion.transforms]
        stretches = np.stack([stretch for _, _, stretch in parts])
        scales = np.diagonal(stretches, axis1=1, axis2=2)
        if not np.allclose(stretches, scales[:, None] * np.eye(3), atol=1e-6):
            self.warn("that motions shear")
        turns = np.stack([turn for _, turn, _ in parts])
        self.animate(outer, "translation", motion.times, np.stack([t for t, _, _ in parts]))
        self.animate(outer, "rotation", motion.times, turns)
        self.animate(outer, "scale", motion.times, scales)
        return outer

    def animate(self, node: int, path: str, times: Sequence[float], values: Floats) -> None:
        """Add keys of a node at times [s]."""
        seconds = np.asarray(times)[:, None] - self.start
        sampler = {"input": self.accessor(seconds), "output": self.accessor(values)}
        self.channels.append(
            {"sampler": len(self.samplers), "target": {"node": node, "path": path}}
        )
        self.samplers.append(sampler)

    def shape(self, shape: Shape) -> int:
        """Add the nodes of a shape; return the outer one."""
        name = {"name": shape.name} if shape.name else {}
        matrix = np.asarray(on_host(shape.to_world), float)
        if shape.priority:
            self.warn("which body fills a place where bodies overlap")
        if shape.exterior is not None and shape.exterior is not shape.interior:
            self.warn("media in front of shapes")
        if shape.group is not None:
            children = [self.shape(part) for part in shape.group.shapes]
            return self.node(matrix, shape.motion, children=children, **name)
        if isinstance(shape, shapes.Spheres):
            ball, centers = shapes.Sphere(**_surface_of(shape)), np.asarray(on_host(shape.centers))
            radii = centers[:, 3] if centers.shape[1] == 4 else shape.radii
            mesh = self.mesh(ball)
            sizes = np.broadcast_to(radii, len(centers))
            places = [
                transforms.translate(*center) @ transforms.scale(float(size))
                for center, size in zip(centers[:, :3].tolist(), sizes, strict=True)
            ]
            if shape.attributes or shape.deformation is not None:
                self.warn("attributes and motion of single spheres")
            balls = [self.node(place, mesh=mesh) for place in places]
            return self.node(matrix, shape.motion, children=balls, **name)
        outer = self.node(matrix, shape.motion, mesh=self.mesh(shape), **name)
        if shape.deformation is not None and isinstance(shape, Mesh):
            inner = outer if shape.motion is None else outer - 1
            times = shape.deformation.times
            self.animate(inner, "weights", times, np.eye(len(times)).reshape(-1, 1))
        return outer

    def mesh(self, shape: Shape) -> int:
        """Return the mesh of a shape, which shapes with the same arrays and surface share."""
        parts = (id(shape.material), id(shape.emission), id(shape.interior), shape.flip_normals)
        arrays = (id(shape.vertices), id(shape.faces), id(shape.normals), id(shape.deformation))
        key = (*parts, *arrays) if isinstance(shape, Mesh) else id(shape)
        if key not in self.meshes:
            mesh: dict[str, Any] = {"primitives": [self.primitive(shape)]}
            if shape.name:
                mesh["name"] = shape.name
            self.lists["meshes"].append(mesh)
            self.meshes[key] = len(self.lists["meshes"]) - 1, shape  # keys are ids
        return self.meshes[key][0]

    def primitive(self, shape: Shape) -> dict[str, Any]:
        vertices, faces, normals, uvs = as_meshes.local(shape)
        emission = shape.emission
        if emission is not None and not isinstance(emission, lights.Area):
            self.warn(f"the light {emission.kind} of shapes")
            emission = None
        self.lit = self.lit or emission is not None
        if emission is not None and not emission.visible:
            self.warn("that lamps are not visible")
        material, read = self.materials.material(shape.material, emission, shape.interior)
        attributes: dict[str, int] = {"POSITION": self.accessor(vertices)}
        side = -1.0 if shape.flip_normals else 1.0
        if normals is not None:
            lengths = np.linalg.norm(normals, axis=1, keepdims=True)
            unit = np.where(lengths > 0.0, normals / np.maximum(lengths, 1e-30), [0.0, 0.0, 1.0])
            attributes["NORMAL"] = self.accessor(side * unit)
        if uvs is not None:
            attributes["TEXCOORD_0"] = self.accessor(uvs * [1.0, -1.0] + [0.0, 1.0])
        attributes |= self.attributes(shape, len(vertices), read)
        primitive: dict[str, Any] = {
            "attributes": attributes, "material": material,
            "indices": self.accessor((faces[:, ::-1] if side < 0.0 else faces).reshape(-1), WORD),
        }  # fmt: skip
        if isinstance(shape, Mesh) and shape.deformation is not None:
            primitive["targets"] = self.targets(shape.deformation, vertices, normals)
        elif shape.deformation is not None:
            self.warn(f"the motion of points of {shape.kind}")
        return primitive

    def attributes(self, shape: Shape, count: int, read: set[str]) -> dict[str, int]:
        """Return what else a mesh says of its vertices: a second uv, colors that are looked up."""
        arrays = {
            name: np.asarray(on_host(values), np.float32).reshape(len(values), -1)
            for name, values in shape.attributes.items()
        }
        arrays = {name: values for name, values in arrays.items() if len(values) == count}
        found: dict[str, int] = {}
        if all(name in arrays for name in SECOND_UV):
            second = np.hstack([arrays[name] for name in SECOND_UV])
            found["TEXCOORD_1"] = self.accessor(second * [1.0, -1.0] + [0.0, 1.0])
        if read:
            white = np.ones((count, 1), np.float32)
            color = arrays.get("vertex_color", white) if "vertex_color" in read else white
            alpha = [arrays.get("vertex_alpha", white)] if "vertex_alpha" in read else []
            found["COLOR_0"] = self.accessor(
                np.hstack([np.broadcast_to(color, (count, 3)), *alpha])
            )
        if isinstance(shape, Mesh) and shape.tangents is not None:
            found["TANGENT"] = self.accessor(on_host(shape.tangents))
        return found

    def targets(
        self, keys: Deformation, vertices: NDArray[Any], normals: NDArray[Any] | None
    ) -> list[dict[str, int]]:
        """Return a morph target for each key."""
        rows = []
        for i, points in enumerate(np.asarray(on_host(keys.points))):
            row = {"POSITION": self.accessor(points - vertices)}
            if keys.normals is not None and normals is not None:
                row["NORMAL"] = self.accessor(np.asarray(on_host(keys.normals))[i] - normals)
            rows.append(row)
        return rows

    def light(self, light: lights.Light) -> None:
        values: dict[str, Any] = {}
        place = np.eye(4)
        if isinstance(light, lights.Point) and light.falloff:
            kind, emitted = "point", light.intensity
            place = transforms.translate(*np.asarray(light.position, float))
        elif isinstance(light, lights.Spot) and light.cutoff <= 90.0:
            kind, emitted = "spot", light.intensity
            place = np.asarray(light.to_world, float) @ FROM_GLTF
            inner = min(light.beam_width, 0.9999 * light.cutoff)
            angles = {"inner": inner, "outer": light.cutoff}
            values["spot"] = {f"{end}ConeAngle": math.radians(a) for end, a in angles.items()}
            if light.edge != "linear" or isinstance(light.image, Texture):
                self.warn("edges of spots that are not linear, and their images")
        elif isinstance(light, lights.Directional):
            kind, emitted = "directional", light.irradiance
            direction = np.asarray(light.direction, float)
            up = np.eye(3)[int(np.argmin(np.abs(direction)))]
            place = transforms.look_at(np.zeros(3), direction, up) @ FROM_GLTF
            if light.angle:
                self.warn("the angle of distant lights")
        else:
            self.warn(f"the light {light.kind}")
            return
        strength, color = split(self.materials.unit * rgb(emitted, "emission"))
        values |= {"type": kind, "intensity": strength, "color": color.tolist()}
        number = {LIGHTS: {"light": len(self.lights)}}
        self.lights.append(values)
        self.node(place, light.motion, extensions=number)

    def camera(self, scene: Scene) -> None:
        camera, film = scene.camera, scene.film
        if not isinstance(camera, (Perspective, Orthographic)):
            self.warn(f"the camera {camera.kind}")
            return
        to_world, aspect = np.asarray(camera.to_world, float), film.width / film.height
        if transforms.flips_handedness(to_world):
            self.warn(MIRRORED)
        planes = {"znear": max(float(camera.near), 1e-6), "zfar": float(camera.far)}
        if isinstance(camera, Orthographic):
            wide = float(np.linalg.norm(to_world[:3, 0]))
            row = {"type": "orthographic",
                   "orthographic": {"xmag": wide, "ymag": wide / aspect, **planes}}  # fmt: skip
        else:
            across, _ = camera.extent(film.width, film.height)
            angle = 2.0 * math.atan(0.5 * across / aspect)
            row = {"type": "perspective",
                   "perspective": {"yfov": angle, "aspectRatio": aspect, **planes}}  # fmt: skip
            if camera.offset_x or camera.offset_y:
                self.warn("that the camera is shifted")
            if isinstance(camera, ThinLens) and camera.aperture_radius > 0.0:
                self.warn("the camera's depth of field")
        self.lists["cameras"].append(row)
        self.node(transforms.unmirrored(to_world) @ FROM_GLTF, camera.motion, camera=0)


def _surface_of(shape: Shape) -> dict[str, Any]:
    names = ("material", "emission", "interior", "flip_normals", "name")
    return {name: vars(shape)[name] for name in names}
