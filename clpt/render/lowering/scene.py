"""Lowering: a scene as plain data becomes tables of words, features and settings."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import scene as sc
from clpt import transforms
from clpt.bvh.build import MOST
from clpt.errors import SceneError
from clpt.records import SETTINGS, SHAPE
from clpt.render.contract import custom_materials, shape_records
from clpt.render.contract.features import Features, disperses
from clpt.render.contract.parameter_words import row_words
from clpt.render.lowering.camera import cameras, filters
from clpt.render.lowering.camera.colour import output_matrix, sensor
from clpt.render.lowering.camera.wavelengths import Density, density, emissions
from clpt.render.lowering.checks import check
from clpt.render.lowering.device_arrays import is_table
from clpt.render.lowering.geometry import instancing, shapes, spheres
from clpt.render.lowering.geometry.instancing import Instances, Placed, Prototype
from clpt.render.lowering.lights import lights
from clpt.render.lowering.lowering_cache import LoweringCache
from clpt.render.lowering.materials import reradiation
from clpt.render.lowering.materials.normal_maps import NormalPerturbation
from clpt.render.lowering.tables import STEP, Tables
from clpt.render.lowering.textures import attributes
from clpt.scene import materials as mt
from clpt.scene.params import device_params
from clpt.scene.shapes import Mesh, Shape
from clpt.spectra import Constant
from clpt.spectra.cie import tanh_ends

SHAPE_NORMALS, SHAPE_UVS, SHAPE_TWO_SIDED, SHAPE_ONE_LIGHT, SHAPE_MANY = 1, 2, 4, 8, 16
MIXTURE = 0xFF
FEW_LIGHTS = 256  # up to which one random number chooses a light and a point on it
TREE_FROM = 16  # lights from which a tree chooses among them, see bench/lights.py
CLEAR = Constant(0.0)  # absorption of what absorbs nothing
MOST_SAMPLE_BITS = 16  # of a zsobol pixel's part of its sequence
DEEPEST = 4000  # path state has 12 bits for the depth


@dataclass
class Lowered:
    """A scene ready for the device.

    vertices (n, 3) float32, faces (m, 3) uint32 and tags (m,) uint32 (the shape of each triangle)
    are what the acceleration structures are built of, the world's before those of the groups that
    `instances` share; boxes (k, 2, 3) float32 those of the analytic shapes, which are the last rows
    of `shapes`. tables: every other read-only array by name; where an instance's tree begins is
    filled in when trees are built. lent: those that are the caller's buffers. owners: of each row
    of `shapes`. glass_row: of the camera, see `lower_camera`. encoder: what made the tables, for
    values that are edited; None once it is of no use; memo: what the next lowering need not make
    again.
    """

    features: Features
    settings: NDArray[np.void]
    tables: dict[str, np.ndarray]
    vertices: NDArray[np.float32]
    faces: NDArray[np.uint32]
    tags: NDArray[np.uint32]
    boxes: NDArray[np.float32]
    instances: Instances
    zero_copy: dict[str, Any]
    owners: list[attributes.Placed]
    glass_row: int
    warnings: list[str]
    encoder: Tables | None
    cache: LoweringCache

    def table(self, name: str) -> np.ndarray:
        """A table by its name in clpt.records.TABLES."""
        own = {"vertices": self.vertices, "faces": self.faces}
        return own[name] if name in own else self.tables[name]

    @property
    def bytes(self) -> int:
        """Size of all arrays."""
        return sum(a.nbytes for a in (*self.tables.values(), self.vertices, self.faces, self.tags))


def lower(
    scene: sc.Scene, texture_budget: int | None = None, former: Lowered | None = None
) -> Lowered:
    """Lower a scene; of the `aov` integrator, for its first channel.

    former: of a scene that has much in common with this one; it only saves time. Arrays, lights and
    images that are the same objects as then are taken to hold the same.

    Raises SceneError where the scene makes no sense: it names the shape, light or material.
    """
    check(scene)
    return _Lowering(scene, texture_budget, LoweringCache(former.cache if former else None)).run()


@dataclass(frozen=True)
class _Side:
    """A side of a surface, and what stands around the material that is looked at.

    turned: the material is two-sided, so that its back is turned round; inside: below a TwoSided.
    """

    front: bool
    turned: bool
    inside: bool = False
    perturbation: NormalPerturbation = NormalPerturbation()

    @property
    def key(self) -> tuple[Any, ...]:
        """What makes two the same."""
        return self.front, self.turned, self.inside, self.perturbation.key


class _Lowering:
    """The state of one `lower`."""

    def __init__(self, scene: sc.Scene, texture_budget: int | None, cache: LoweringCache):
        film = scene.film
        self.cache = cache
        self.warnings: list[str] = []
        self.placed, self.prototypes = instancing.sort(scene.shapes, self.warnings)
        scene = dataclasses.replace(scene, shapes=list(instancing.distinct(scene.shapes)))
        self.scene = scene
        self.channels = getattr(scene.integrator, "channels", ())
        self.light_paths = isinstance(scene.integrator, sc.integrators.ParticleTracer)
        self.mode = "rgb" if self.channels else film.mode
        own = Density(film.lambda_min, film.lambda_max)
        self.density = density(scene) if self.mode == "spectral" else own
        self.tables = Tables(
            self.mode,
            film.lambda_min,
            film.lambda_max,
            sensor(film),
            self.density,
            texture_budget,
            cache,
        )
        if self.light_paths and (film.filter.kind != "box" or filters.radius(film.filter) != 0.5):
            self.warnings.append(
                "film.filter is passed over: particle_tracer has a box of one pixel"
            )
        self.leaves = _leaf_kinds(scene)
        if self.mode == "spectral" and mt.Fluorescent in self.leaves:
            nodes = reradiation.nodes(film.lambda_min, film.lambda_max)
            self.tables.expected = reradiation.expected(emissions(scene), nodes)
        self.words: dict[tuple[int, tuple[Any, ...]], int] = {}
        self.uses = dict.fromkeys(("normals", "uvs", "tangents", "absorption"), False)
        self.transmitting: set[str] = set()  # kinds of leaves
        self.perturbed = any(_any_of(shape.material, mt.NormalMapped) for shape in scene.shapes)
        self.nested: dict[int, int] = {}  # how deep mixtures are, by their words
        self.triangles: list[tuple[np.ndarray, np.ndarray, int]] = []  # vertices, faces, shape
        self.flat: list[shapes.Flat] = []
        self.owners: list[attributes.Placed] = []
        self.balls: list[spheres.Balls] = []
        self.n_vertices = self.n_faces = self.n_spheres = 0

    def run(self) -> Lowered:
        scene, tables = self.scene, self.tables
        filters.lower_filter(scene.film.filter, tables)  # first in its table
        self.tabulated = self.mode == "spectral" and self.density.values is not None
        self.first_density = tables.size("distributions")
        if self.tabulated:
            tables.append_floats("distributions", self.density.words())
        longest = max(map(row_words, (*mt.LEAVES, *self.leaves)))
        tables.append("materials", np.zeros(longest, np.uint32))  # what idle lanes read
        flat = [one for one in self.placed if one.shape.kind not in shape_records.ANALYTIC]
        analytic = [one for one in self.placed if one.shape.kind in shape_records.ANALYTIC]
        analytic.sort(key=lambda one: one.shape.kind in shape_records.ONE_OF)
        many = [one.shape for one in analytic if one.shape.kind in shape_records.ONE_OF]
        emitters: list[lights.Emitter] = []
        rows = [self._shape(i, one, emitters) for i, one in enumerate(flat)]
        in_world = self.n_vertices
        instances = instancing.concatenated([self._shared(p, rows) for p in self.prototypes])
        tables.append("instances", instances.rows.view(np.uint32))
        self.first_analytic, self.single_count = len(rows), len(analytic) - len(many)
        rows += [self._shape(len(rows) + i, one, emitters) for i, one in enumerate(analytic)]
        self.shape_count = len(rows)
        found = [shapes.bounds(one.shape) for one in analytic[: self.single_count]]
        boxes = np.array(found, np.float32).reshape(-1, 2, 3)
        boxes = np.concatenate([boxes, spheres.boxes(self.balls)])
        self.analytic_count = len(boxes)
        vertices, faces, tags = self._joined()
        center, radius = _sphere_around(vertices[:in_world], boxes, instances.boxes)
        tree_from = None if self.light_paths else TREE_FROM
        self.lights = lights.light_rows(scene.lights, emitters, tables, radius, tree_from)
        tables.append("lights", self.lights.rows.view(np.uint32))
        if self.lights.tree is not None:
            tables.append("lights", self.lights.tree)
        for emitter, first, whole in zip(
            emitters, self.lights.first, self.lights.whole, strict=True
        ):
            rows[emitter.shape_row]["light"] = first
            rows[emitter.shape_row]["flags"] |= SHAPE_ONE_LIGHT if whole else 0
        attributes.lower_attributes(self.owners, tables, self.single_count)
        for row in rows:
            tables.append("shapes", row.reshape(1).view(np.uint32))
        glass_row = self._lens_glass()
        camera, words = cameras.lower_camera(
            scene.camera, scene.film.width, scene.film.height, glass_row
        )
        tables.append_floats("camera", words)
        ambient = getattr(scene.integrator, "ambient", 0.0)
        self.ambient = (
            tables.append("light_params", tables.emission_words(ambient)) if ambient else 0
        )
        if scene.film.mode == "rgb" and mt.Fluorescent in self.leaves:
            self.warnings.append(
                "in rgb mode fluorescent paint has its colour under D65, at most white"
            )
        self.warnings += [*shapes.warnings_of(self.flat), *tables.finish()]
        features = self._features({one.shape.kind for one in analytic}, camera)
        arrays = tables.arrays()
        settings = self._settings(center, radius)
        self.cache.settle()
        return Lowered(
            features, settings, arrays, vertices, faces, tags, boxes, instances,
            self._zero_copy_tables(len(faces)), self.owners, glass_row, self.warnings, tables, self.cache,
        )  # fmt: skip

    def _zero_copy_tables(self, count: int) -> dict[str, Any]:
        """Buffers of a mesh that alone has triangles, which are tables as they are."""
        meshes: list[Shape] = [
            s for _, s, _, _ in self.owners if s.kind not in shape_records.ANALYTIC
        ]
        if len(meshes) != 1 or self.prototypes or not isinstance(meshes[0], Mesh):
            return {}
        mesh = meshes[0]
        turned = transforms.flips_handedness(shapes.placement(mesh)) != mesh.flip_normals
        wanted = {"uvs": (mesh.uvs, "f")}
        if not turned and len(mesh.faces) == count:  # no triangle was left out
            wanted["faces"] = mesh.faces, "iu"
        return {name: v.data for name, (v, kind) in wanted.items() if is_table(v, kind)}

    def _lens_glass(self) -> int:
        """The row in `spectra` of the glass of a lens that disperses, 0 where there is none."""
        glass = cameras.dispersive_glass(self.scene.camera)
        if glass and self.mode == "rgb" and not self.channels:
            self.warnings.append("thin_lens.glass: in RGB mode all wavelengths have one focus")
        return self.tables.spectra_row(glass) if glass and self.mode == "spectral" else 0

    def _shared(self, prototype: Prototype, rows: list[np.ndarray]) -> instancing.Shared:
        """What instances share; the rows of its shapes are appended, its triangles put in once."""
        before, first = len(self.triangles), self.n_faces
        for shape in prototype.shapes:
            rows.append(self._shape(len(rows), Placed(shape, 0), []))
        own = self.triangles[before:]
        whole, centre = instancing.centred(np.concatenate([v for v, _, _ in own]))
        hull_points = instancing.hull_points(whole)
        placed, boxes = instancing.place(prototype.to_world, prototype.numbers, hull_points, centre)
        ends = np.cumsum([len(v) for v, _, _ in own])[:-1]
        self.triangles[before:] = [
            (moved, faces, number)
            for moved, (_, faces, number) in zip(np.split(whole, ends), own, strict=True)
        ]
        placed["prim"] = first
        return instancing.Shared(placed, boxes, self.n_faces - first, centre)

    def _shape(self, number: int, one: Placed, emitters: list) -> np.ndarray:
        """One row of `shapes`; its triangles, or its parameters, go into the tables."""
        shape: Any = one.shape
        row = np.zeros((), SHAPE.dtype)
        row["number"] = one.number
        row["light"] = -1
        front, back, row["flags"] = self._sides(shape)
        row["front"], row["back"] = np.array([front, back], np.uint32).view(np.int32)
        triangles: tuple[Any, Any, Any] = (None, None, None)
        self.owners.append((row, shape, self.n_vertices, self.n_faces))
        if shape.kind in shape_records.ANALYTIC:
            row["kind"] = 1 + shape_records.ANALYTIC.index(shape.kind)
            row["params"] = self.tables.append("geometry", shapes.row(shape))
        if shape.kind in shape_records.ONE_OF:
            row["prim"] = self.single_count + self.n_spheres
            row["flags"] |= SHAPE_MANY
            self.balls.append(self.cache(spheres.balls, shape, by=shapes.geometry(shape)))
            self.n_spheres += len(self.balls[-1])
            self.tables.append_floats("spheres", self.balls[-1])
            triangles = self.balls[-1], None, None
        elif shape.kind not in shape_records.ANALYTIC:
            made = self.cache(shapes.counted, shape, by=shapes.geometry(shape))
            vertices, faces, normals, uvs, flat = made
            self.flat += flat
            triangles = vertices, faces, uvs
            row["prim"] = self.n_faces
            row["flags"] |= self._attributes(vertices, normals, uvs)
            self.triangles.append((vertices, faces + np.uint32(self.n_vertices), number))
            self.n_vertices += len(vertices)
            self.n_faces += len(faces)
        if shape.emission is not None:
            emitters.append(lights.Emitter(shape, number, *triangles))
            if any(getattr(v, "is_texture", False) for v in vars(shape.emission).values()):
                self.uses["uvs"] = True
        return row

    def _attributes(self, vertices: Any, normals: Any, uvs: Any) -> int:
        """Append normals and uvs of a mesh, zeros where it has none; return its SHAPE_ bits."""
        zeros = np.zeros_like(vertices)
        self.tables.append_floats("normals", zeros if normals is None else normals)
        self.tables.append_floats("uvs", zeros[:, :2] if uvs is None else uvs)
        self.uses["normals"] |= normals is not None
        return (SHAPE_NORMALS if normals is not None else 0) | (SHAPE_UVS if uvs is not None else 0)

    def _joined(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """All triangles in one array."""
        if max(self.n_vertices, self.n_faces) > MOST:
            raise SceneError(
                f"{self.n_faces:,} triangles with {self.n_vertices:,} vertices: of either there "
                f"may be {MOST:,}; use instances for what repeats"
            )
        if not self.triangles:
            return np.zeros((0, 3), np.float32), np.zeros((0, 3), np.uint32), np.zeros(0, np.uint32)
        vertices = np.concatenate([v for v, _, _ in self.triangles])
        faces = np.concatenate([f for _, f, _ in self.triangles])
        tags = np.concatenate([np.full(len(f), n, np.uint32) for _, f, n in self.triangles])
        self.triangles.clear()
        return vertices, faces, tags

    def _sides(self, shape: Any) -> tuple[int, int, int]:
        """Material words of front and back, and whether the back is turned round."""
        two_sided = _any_of(shape.material, mt.TwoSided)
        name = shapes.where(shape)
        if two_sided and any(part.transmits for part in mt.parts(shape.material)):
            raise SceneError(
                "a transmissive material cannot be mixed with a two-sided one", where=name
            )
        front = self._word(shape.material, _Side(front=True, turned=two_sided))
        back = self._word(shape.material, _Side(front=False, turned=two_sided))
        return front, back, SHAPE_TWO_SIDED if two_sided else 0

    def _word(self, material: Any, side: _Side) -> int:
        """The material word of one side."""
        key = (id(material), side.key)
        if key not in self.words:
            self.words[key] = self._made_word(material, side)
        return self.words[key]

    def _made_word(self, material: Any, side: _Side) -> int:
        if isinstance(material, mt.TwoSided):
            chosen = material.front if side.front or material.back is None else material.back
            return self._word(chosen, dataclasses.replace(side, inside=True))
        if isinstance(material, (mt.NormalMap, mt.BumpMap)):
            perturbation = side.perturbation.within(material, side.inside)
            return self._word(
                material.material, dataclasses.replace(side, perturbation=perturbation)
            )
        if isinstance(material, mt.Mask):
            return self._mixture(material.opacity, _NULL, material.material, side)
        if isinstance(material, mt.Blend):
            return self._mixture(material.weight, material.first, material.second, side)
        one_sided = not side.inside and not isinstance(material, mt.Null)
        if side.turned and not side.front and one_sided:
            material = _BLACK  # the back of a one-sided part, though the surface is turned
        if material.no_back and not side.front:
            material = _NULL
        before = side.perturbation.words(self.tables) if self.perturbed else None
        row = self.tables.row(material, "materials", before)
        if row >= 1 << 24:
            raise SceneError("the scene has more than 16 million words of material parameters")
        for part in (material, *getattr(material, "layers", ())):
            for name in device_params(type(part)):
                if getattr(getattr(part, name), "is_texture", False):
                    self.uses["uvs"] = True
        self.uses["tangents"] |= material.uses_tangents
        if material.transmits:
            self.transmitting.add(material.kind)
        self.uses["absorption"] |= getattr(material, "absorption", CLEAR) != CLEAR
        return self.leaves.index(type(material)) << 24 | row

    def _mixture(self, weight: Any, first: Any, second: Any, side: _Side) -> int:
        words, source = self.tables.param_words(weight, "real")
        self.tables.sources["mixture"]["weight"].add(source)
        self.uses["uvs"] |= source == "texture"
        children = [self._word(m, side) for m in (first, second)]
        word = MIXTURE << 24 | self.tables.append("mixtures", [*words, *children])
        self.nested[word] = 1 + max(self.nested.get(child, 0) for child in children)
        return word

    def _features(self, analytic: set[str], camera: str) -> Features:
        scene, tables = self.scene, self.tables
        sources = frozenset(
            (kind, name, source)
            for kind, values in tables.sources.items()
            for name, found in values.items()
            for source in found
        )
        glass_lens = self.mode == "spectral" and bool(cameras.dispersive_glass(scene.camera))
        return Features(
            mode=self.mode,
            camera=camera,
            sampler=scene.sampler.kind,
            filter=scene.film.filter.kind,
            integrator={"direct": "path"}.get(scene.integrator.kind, scene.integrator.kind),
            leaves=self.leaves,
            transmitting=tuple(sorted(self.transmitting)),
            lights=self.lights.kinds,
            textures=tuple(sorted({kind for kind, _ in tables.texture_roles})),
            texture_roles=tuple(sorted(tables.texture_roles)),
            texture_depth=tables.texture_depth,
            texture_mappings=tables.texture_mappings,
            attributes=bool(tables.attributes),
            analytic=tuple(kind for kind in shape_records.ANALYTIC if kind in analytic),
            instances=bool(self.prototypes),
            normals=self.uses["normals"],
            uvs=self.uses["uvs"]
            or self.uses["tangents"]
            or self.perturbed
            or "uv" in self.channels,
            tangents=self.uses["tangents"] or self.perturbed,
            mixtures=max(self.nested.values(), default=0),
            normal_maps_used=self.perturbed and not self.channels,
            is_null=any(cls.is_null for cls in self.leaves) and not self.channels,
            infinite=self.lights.infinite > 0 and not self.channels,
            light_paths=self.light_paths,
            visible_lights=self.lights.visible,
            two_sided_lights=self.lights.two_sided,
            light_tree=self.lights.tree is not None,
            many_lights=len(self.lights.rows) > FEW_LIGHTS,
            absorption=self.uses["absorption"] and not self.channels,
            dispersion=glass_lens or disperses(self.leaves, sources),
            glass_lens=glass_lens,
            channel=self.channels[0] if self.channels else "",
            bands=bool(scene.film.bands) and not self.channels,
            tabulated_density=self.tabulated,
            spectra_size=tables.spectra_size,
            spectra_step=STEP,
            sources=sources,
        )

    def _settings(self, center: Any, radius: float) -> np.ndarray:
        """The settings that do not depend on how the device is used; the renderer adds those."""
        scene, film = self.scene, self.scene.film
        integrator = scene.integrator
        settings = np.zeros((), SETTINGS.dtype)
        width, height = film.size
        settings["width"], settings["height"] = width, height
        settings["crop_x"], settings["crop_y"] = (0, 0) if film.crop is None else film.crop[:2]
        settings["film_width"], settings["film_height"] = film.width, film.height
        settings["tiles_x"] = -(-width // 4)
        settings["padded_pixels"] = 16 * settings["tiles_x"] * -(-height // 4)
        settings["seed"] = scene.seed % 2**32
        settings["sample_bits"] = min((max(scene.spp, 1) - 1).bit_length(), MOST_SAMPLE_BITS)
        depth: int = {"direct": 2, "aov": 1}.get(integrator.kind, 0)
        depth = depth or getattr(integrator, "max_depth", -1)
        settings["max_depth"] = DEEPEST if depth < 0 else min(depth, DEEPEST)
        settings["rr_depth"] = min(getattr(integrator, "rr_depth", DEEPEST), DEEPEST)
        settings["hide_lights"] = getattr(integrator, "hide_lights", False)
        settings["light_count"] = len(self.lights.rows)
        settings["infinite_count"] = self.lights.infinite
        settings["ambient"] = self.ambient
        settings["first_analytic"] = self.first_analytic
        settings["analytic_count"] = self.analytic_count
        settings["single_count"], settings["shape_count"] = self.single_count, self.shape_count
        settings["lambda_min"], settings["lambda_max"] = film.lambda_min, film.lambda_max
        settings["tanh_min"], settings["tanh_max"] = tanh_ends(self.density.lo, self.density.hi)
        settings["bands"] = film.bands
        settings["density"] = self.first_density
        matrix = np.eye(3) if self.channels else output_matrix(film, self.mode)
        settings["to_first"], settings["to_second"], settings["to_third"] = matrix
        settings["scene_radius"], settings["center"] = radius, center
        return settings


_NULL, _BLACK = mt.Null(), mt.Diffuse(reflectance=0.0)


def _leaf_kinds(scene: sc.Scene) -> tuple[type[mt.Material], ...]:
    """The leaf kinds of a scene, in the order of their table; those from outside follow."""
    found: dict[type[mt.Material], str] = {}

    for shape in scene.shapes:
        if not isinstance(shape.material, mt.Material):
            raise SceneError(f"{shape.material!r} is not a material", where=shapes.where(shape))
        where = shapes.where(shape)
        for material in mt.parts(shape.material):
            if isinstance(material, mt.Mask) or material.no_back:
                found.setdefault(mt.Null, where)
            if not isinstance(material, mt.COMPOSITES):
                found.setdefault(type(material), where)
        if _any_of(shape.material, mt.TwoSided) and not isinstance(shape.material, mt.TwoSided):
            found.setdefault(mt.Diffuse, where)  # the black back of a part that is not two-sided
    return custom_materials.ordered(found) or (mt.Diffuse,)


def _any_of(material: Any, classes: Any) -> bool:
    """Whether a material or one inside it is of these classes."""
    return any(isinstance(part, classes) for part in mt.parts(material))


def _sphere_around(vertices: np.ndarray, *boxes: np.ndarray) -> tuple[np.ndarray, float]:
    """The sphere around the bounding box of the whole scene; a unit one if it is empty."""
    lows = [a.min(axis=0) for a in (vertices, *(b[:, 0] for b in boxes)) if len(a)]
    highs = [a.max(axis=0) for a in (vertices, *(b[:, 1] for b in boxes)) if len(a)]
    if not lows:
        return np.zeros(3), 1.0
    low, high = np.min(lows, axis=0), np.max(highs, axis=0)
    return (low + high) / 2, max(float(np.linalg.norm(high - low)) / 2, 1e-3)
