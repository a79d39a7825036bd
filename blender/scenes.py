# SPDX-License-Identifier: GPL-3.0-or-later
"""The evaluated scene of Blender as a scene file of clpt, with its meshes and images beside it."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import bpy
import numpy as np
from mathutils import Matrix

from . import cameras, lights, measured, meshes, preferences, process, volumes
from .graphs import Json, jenkins
from .lights import listed
from .nodes import Tree, told

SURFACES = {"MESH", "CURVE", "SURFACE", "META", "FONT"}
LINEAR = ("Non-Color", "Linear Rec.709", "Raw", "Linear")  # spaces without a curve
READ = (".png", ".jpg", ".jpeg", ".exr", ".hdr", ".tga", ".bmp", ".webp")  # files that clpt reads
SILENT = {"CAMERA", "EMPTY", "ARMATURE", "LATTICE", "LIGHT_PROBE", "SPEAKER"}

CAMERA = ("", "", ())  # the key of the camera

Key = tuple[str, str, tuple[int, ...]]  # of an instance, at all times
Pose = tuple[float, dict[Key, Matrix]]


class Made(NamedTuple):
    """A material that is written: its name, light, what it reads of meshes, and what is inside."""

    name: str
    radiance: Any
    attributes: frozenset[int]
    interior: str


class Writer:
    """Writes a scene once. told: what is left out or approximated, for people."""

    def __init__(
        self,
        depsgraph: bpy.types.Depsgraph,
        folder: Path,
        width: int,
        height: int,
        set_frame: Callable[..., None],
    ):
        self.depsgraph, self.folder, self.set_frame = depsgraph, folder, set_frame
        self.width, self.height = width, height
        self.told: dict[str, None] = {}
        self.owner = ""  # the data that is read now
        self.tree = Tree(self.image, self.tell)
        self.images: dict[str, Json | None] = {}
        self.numbers = itertools.count()  # of files
        self.materials: dict[str, Made] = {}
        self.personal: set[str] = set()  # materials that are others for each object
        self.named: dict[str, Json] = {}
        self.media: dict[str, Json] = {}
        self.origins: dict[str, meshes.Rows] = {}
        self.groups: dict[str, list[Json]] = {}

    def tell(self, text: str) -> None:
        self.told.setdefault(text)
        lines = told.setdefault(self.owner, [])
        if text not in lines:
            lines.append(text)

    @contextmanager
    def reads(self, name: str) -> Iterator[None]:
        """Let what is told while data of this name are read stand in their panel."""
        self.owner, told[name] = name, []
        try:
            yield
        finally:
            self.owner = ""

    def write(self) -> Path:
        """Write all; return the scene file."""
        file = self.folder / "scene.json"
        file.write_text(json.dumps(self.describe()), "utf-8")
        return file

    def shows(self, instance: bpy.types.DepsgraphObjectInstance) -> bool:
        """Return whether an instance is in the picture."""
        return instance.show_self

    def describe(self) -> Json:
        """Write meshes and images; return the scene that names their files."""
        shapes: list[Json] = []
        around: dict[str, list[Json]] = {"shapes": shapes, "lights": []}
        parts: dict[Any, list[Json]] = {}
        places: dict[Any, list[tuple[Key, Matrix]]] = {}
        names: dict[Key, str] = {}
        for instance in self.depsgraph.object_instances:
            source, matrix = instance.object, instance.matrix_world.copy()  # gone after its turn
            if instance.show_particles and not instance.is_instance:
                shapes += self._particles(source)
            if not self.shows(instance):
                continue
            if source.type in SURFACES or source.type == "CURVES":
                self.tree.random = _random(instance)
                made = [self._material(slot, source) for slot in _slots(source)]
                key = (source.data.as_pointer(), source.lightgroup, *(m.name for m in made))
                if key not in parts:
                    parts[key] = self._parts(len(parts), source)
                names[_key(instance)] = source.name
                places.setdefault(key, []).append((_key(instance), matrix))
            elif source.type == "LIGHT":
                where, lamp = lights.lamp(self, source, matrix)
                around[where].append(lamp)
            elif source.type == "VOLUME":
                shapes += self._volume(source, matrix)
            elif source.type not in SILENT:
                self.tell(f"objects of the type {source.type.title()} are left out")
        around["lights"] += lights.world(self, self.depsgraph.scene.world)
        camera = self._camera()
        deforming = {
            rows[0][0]: parts[key] for key, rows in places.items() if len(rows) == 1
        }  # fmt: skip
        poses = self._poses(deforming)
        for key, placed in places.items():
            moved = [{"name": names[row[0]], **_moved(row, poses)} for row in placed]
            shapes += self._placed(parts[key], moved)
        if poses and self.depsgraph.scene.camera is not None:
            camera |= {"shutter": {"open": 0.0, "close": poses[-1][0]}, **self._moved_camera(poses)}
        return {
            "version": 2,
            "camera": camera,
            "film": {
                "width": self.width,
                "height": self.height,
                "alpha": self.depsgraph.scene.render.film_transparent,
                **measured.film(self.depsgraph.scene.clpt),
            },
            "integrator": {"type": "path", "max_depth": self.depsgraph.scene.clpt.bounces + 2},
            "materials": self.named,
            "media": self.media,
            "groups": self.groups,
            **around,
        }

    def _poses(self, parts: dict[Key, list[Json]]) -> list[Pose]:
        """Return when the shutter is open [s], and where all is then; nothing without motion blur.

        The frame of the scene is set to these times, and back. Parts whose meshes change meanwhile
        get a deformation.
        """
        scene, frames = self.depsgraph.scene, self.depsgraph.scene.render
        length = frames.motion_blur_shutter
        if not frames.use_motion_blur or not length > 0.0:
            return []
        start = {"START": 0.0, "CENTER": -0.5, "END": -1.0}[frames.motion_blur_position] * length
        rate = frames.fps / frames.fps_base
        present, poses = scene.frame_current_final, []
        seen: dict[Key, list[tuple[float, np.ndarray, np.ndarray]]] = {}
        for share in (0.0, 0.5, 1.0):
            frame = present + start + share * length
            self.set_frame(math.floor(frame), subframe=frame - math.floor(frame))
            places = {}
            for instance in self.depsgraph.object_instances:
                key, source = _key(instance), instance.object
                places[key] = instance.matrix_world.copy()
                if key in parts and _deforms(source):
                    shape = meshes.positions(source.data), meshes.normals(source.data)
                    seen.setdefault(key, []).append((share * length / rate, *shape))
            camera = scene.camera
            if camera is not None:
                places[CAMERA] = camera.evaluated_get(self.depsgraph).matrix_world.copy()
            poses.append((share * length / rate, places))
        self.set_frame(math.floor(present), subframe=present - math.floor(present))
        for key, keys in seen.items():
            for part in parts[key]:
                self._deform(part, keys)
        return poses

    def _deform(self, part: Json, keys: list[tuple[float, np.ndarray, np.ndarray]]) -> None:
        """Let a part move as the vertices and the normals of its mesh, (n, 3) at times."""
        rows, first = self.origins.get(part["file"]), keys[0]
        if rows is None or all(np.array_equal(points, first[1]) for _, points, _ in keys):
            return
        if any(k[1].shape != first[1].shape or k[2].shape != first[2].shape for k in keys):
            self.tell(f"{part['name']} gets other vertices while the shutter is open: it is still")
            return
        normals = (
            {"normals": np.stack([n[rows.corners] for _, _, n in keys])} if rows.smooth else {}
        )
        file = self.folder / f"{part['file']}.npz"
        points = np.stack([points[rows.vertices] for _, points, _ in keys])
        np.savez(file, times=np.array([time for time, _, _ in keys]), points=points, **normals)
        part["deformation"] = {"file": file.name}

    def _moved_camera(self, poses: list[Pose]) -> Json:
        matrix = self.depsgraph.scene.camera.evaluated_get(self.depsgraph).matrix_world.copy()
        moved = _moved((CAMERA, matrix), poses)
        return {"motion": moved["motion"]} if "motion" in moved else {}

    def _placed(self, parts: list[Json], places: list[Json]) -> list[Json]:
        """Return the shapes of a mesh at all its places: instances of a group where it has many."""
        if len(places) == 1:
            return [{**part, **places[0]} for part in parts]
        if not parts:
            return []
        name = f"group{len(self.groups)}"
        self.groups[name] = parts
        return [{"type": "instance", "group": name, **place} for place in places]

    def _parts(self, number: int, source: Any) -> list[Json]:
        """Return the shapes of an object in its own space, one for each material."""
        files, slots = self._files(number, source), _slots(source)
        parts = [self._part(file, slots, slot, source) for slot, file in files.items()]
        if source.type == "CURVES":
            return [{**part, "type": "curves", "basis": "bezier"} for part in parts]
        return parts

    def wanted(self, source: Any) -> meshes.Wanted:
        """Return the attributes that an object's materials read, by their numbers."""
        used = {n for slot in _slots(source) for n in self._material(slot, source).attributes}
        return {n: key for key, n in self.tree.attributes.items() if n in used}

    def _particles(self, source: Any) -> list[Json]:
        """Return the hair of an object's particle systems, in the world."""
        found = []
        for system in source.particle_systems:
            settings = system.settings
            if settings.type != "HAIR" or settings.render_type != "PATH":
                continue
            file = f"particles{next(self.numbers)}.txt"
            strands = meshes.particle_strands(source, system)
            if meshes.write_strands(*strands, self.folder / file):
                part = self._part(file, _slots(source), settings.material - 1, source)
                found.append({**part, "type": "curves", "basis": "bezier"})
        return found

    def _volume(self, source: Any, matrix: Matrix) -> list[Json]:
        """Return the box of a volume object, whose inside is the grid of its file."""
        grids = source.data.grids
        grids.load()
        path, slots = Path(bpy.path.abspath(grids.frame_filepath)), _slots(source)
        if not grids.frame_filepath:  # of geometry nodes, or of a modifier
            path = self.folder / f"volume{next(self.numbers)}.vdb"
            grids.save(filepath=str(path))
        output = None
        if slots and slots[0] is not None and slots[0].node_tree is not None:
            output = slots[0].node_tree.get_output_node("CYCLES")
        if not path.is_file() or output is None:
            self.tell(f"the volume {source.name!r} has no file or no material: it is left out")
            return []
        medium = volumes.medium(self.tree, output, file=str(path))
        if medium is None:
            return []
        low, high = (np.array(source.bound_box)[i] for i in (0, 6))
        box = (
            matrix
            @ Matrix.Translation(0.5 * (low + high))
            @ Matrix.Diagonal((*(0.505 * (high - low)), 1.0))
        )
        self.media[source.name_full] = {**medium, "to_world": listed(matrix)}
        return [{
            "type": "cube", "material": {"type": "null"}, "name": source.name,
            "interior": source.name_full, "to_world": listed(box),
        }]  # fmt: skip

    def _files(self, number: int, source: Any) -> dict[int, str]:
        """Write the geometry of an object; return the file of each of its material slots."""
        if source.type == "CURVES":
            file = f"hair{number}.txt"
            strands = meshes.strands(source.data)
            return {0: file} if meshes.write_strands(*strands, self.folder / file) else {}
        as_mesh = isinstance(source.data, bpy.types.Mesh) and not source.data.is_editmode
        try:
            mesh = source.data if as_mesh else source.to_mesh()
        except RuntimeError:  # such as curves without a surface
            return {}
        wanted, matrix = self.wanted(source), source.matrix_world
        files = meshes.write(mesh, self.folder, f"mesh{number}", wanted, matrix, self.origins)
        if not as_mesh:
            source.to_mesh_clear()
        return files

    def _material(self, material: Any, source: Any) -> Made:
        """Return a material as an object has it."""
        key = "default_surface" if material is None else material.name_full
        own = f"{key} of {source.name_full}"
        found = self.materials.get(own if key in self.personal else key)
        if found is not None:
            return found
        tree = self.tree
        tree.used, tree.object, tree.personal = set(), source, False
        nodes = None if material is None else material.node_tree
        output = None if nodes is None else nodes.get_output_node("CYCLES")
        with self.reads("" if material is None else material.name_full):
            described, radiance = tree.material(material)
            if material is not None and material.clpt.use_drops:
                medium = self._drops(material.clpt)
            else:
                medium = None if output is None else volumes.medium(tree, output)
        if tree.personal:
            self.personal.add(key)
        key, interior = own if tree.personal else key, ""
        if medium is not None:
            self.media[key], interior = medium, key
        self.named[key] = described
        self.materials[key] = made = Made(key, radiance, frozenset(tree.used), interior)
        return made

    def _drops(self, settings: Any) -> Json | None:
        try:
            python = preferences.python() or process.interpreter()
            return measured.drops(settings, python)
        except (ValueError, OSError, process.ProcessError) as error:
            self.tell(str(error))
            return None

    def _part(self, file: str, slots: list[Any], slot: int, source: Any) -> Json:
        made = self._material(slots[min(slot, len(slots) - 1)] if slots else None, source)
        part: Json = {"type": "mesh", "file": file, "material": made.name, "name": source.name}
        if made.interior:
            part["interior"] = made.interior
        if made.radiance is not None:
            part["emission"] = {
                "type": "area", "radiance": made.radiance, "two_sided": True,
                "group": source.lightgroup,
            }  # fmt: skip
        return part

    def image(self, node: bpy.types.Node) -> Json | None:
        """Return a node's image as a bitmap; its file as it is, or what Blender has in memory."""
        image = node.image
        path = bpy.path.abspath(image.filepath_from_user(image_user=node.image_user),
                                library=image.library)  # fmt: skip
        key = f"{image.name_full} {path}"
        if key not in self.images:
            self.images[key] = self._image(image, Path(path))
        found = self.images[key]
        return None if found is None else {**found}

    def _image(self, image: bpy.types.Image, path: Path) -> Json | None:
        space = image.colorspace_settings.name
        data = space in LINEAR
        if space not in (*LINEAR, "sRGB") and not image.is_float:
            self.tell(f"image {image.name!r}: its color space {space} is read as sRGB")
        if image.source == "TILED":
            self.tell(f"image {image.name!r}: of its tiles the first one is read")
        plain = image.source in ("FILE", "SEQUENCE") and not image.is_dirty
        straight = not image.is_float or data
        known = not image.packed_file and path.suffix.lower() in READ and path.is_file()
        if plain and straight and known:
            return {"type": "bitmap", "image": str(path), "raw": data}
        width, height = image.size
        if width * height == 0:
            self.tell(f"image {image.name!r} is missing")
            return None
        pixels = np.empty(width * height * 4, np.float32)
        image.pixels.foreach_get(pixels)
        pixels = pixels.reshape(height, width, 4)[::-1]
        if not (data or image.is_float):  # those of floats are linear already
            pixels = np.concatenate([_linear(pixels[..., :3]), pixels[..., 3:]], axis=2)
        file = self.folder / f"image{next(self.numbers)}.npy"
        np.save(file, np.ascontiguousarray(pixels))
        return {"type": "bitmap", "image": str(file), "raw": True}

    def _camera(self) -> Json:
        source = self.depsgraph.scene.camera
        if source is None:
            self.tell("there is no camera; it stands at (7, -7, 5)")
            return cameras.NOWHERE
        source = source.evaluated_get(self.depsgraph)
        window = source.calc_matrix_camera(self.depsgraph, x=self.width, y=self.height)
        described, lost = cameras.final(source, window)
        if lost:
            self.tell(lost)
        return described


def _slots(source: Any) -> list[Any]:
    """Return the materials of an object's slots."""
    return [slot.material for slot in source.material_slots] or list(source.data.materials)


def _random(instance: bpy.types.DepsgraphObjectInstance) -> float:
    """Return the random number of an instance, or of an object by its name, as Cycles has it."""
    if instance.is_instance:
        return (instance.random_id & 0xFFFFFFFF) / 0xFFFFFFFF
    number = 0
    for letter in instance.object.name.encode():
        number = (number * 37 + letter) & 0xFFFFFFFF
    return jenkins(number, 0)


def _deforms(source: Any) -> bool:
    """Return whether a mesh may change with time."""
    if source.type != "MESH" or not len(source.data.vertices):
        return False
    keys = source.original.data.shape_keys
    return bool(source.modifiers) or keys is not None or source.parent_type == "ARMATURE"


def _key(instance: bpy.types.DepsgraphObjectInstance) -> Key:
    parent = instance.parent
    numbers = tuple(instance.persistent_id) if instance.is_instance else ()
    return instance.object.name_full, "" if parent is None else parent.name_full, numbers


def _moved(placed: tuple[Key, Matrix], poses: list[Pose]) -> Json:
    """Return where something is, and how it moves while the shutter is open."""
    key, matrix = placed
    place: Json = {"to_world": listed(matrix)}
    keys = [(time, there[key]) for time, there in poses if key in there]
    if len(keys) < 2 or all(there == matrix for _, there in keys):
        return place
    back = matrix.inverted_safe()
    motion = [{"time": time, "transform": listed(there @ back)} for time, there in keys]
    return {**place, "motion": motion}


def _linear(encoded: np.ndarray) -> np.ndarray:
    """Return sRGB as linear Rec. 709 (IEC 61966-2-1)."""
    low = encoded / 12.92
    return np.where(encoded <= 0.04045, low, ((encoded + 0.055) / 1.055) ** 2.4).astype(np.float32)
