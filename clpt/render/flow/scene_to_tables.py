"""Lowering: a scene as plain data becomes tables of words, features and settings.

`_Tables` asks each subject in turn to append its words, and then for its features.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import transforms
from clpt.files import budget
from clpt.geometry import shapes
from clpt.geometry.instancing import Instances
from clpt.geometry.refining import is_refined
from clpt.records import SHAPE_BITS
from clpt.render.camera import encode_camera
from clpt.render.film import filters
from clpt.render.film.colour import sensor
from clpt.render.flow import flags
from clpt.render.flow.check import warnings_of
from clpt.render.flow.find import Analysis, analyse
from clpt.render.flow.layer_names import lower_names
from clpt.render.flow.settings import set_times, settings_of
from clpt.render.geometry.encode import (
    encode_attributes,
    encode_geometry,
    geometry_features,
    motion_features,
    shape_words,
)
from clpt.render.geometry.find import Geometry, Owner, spheres_move
from clpt.render.geometry.surroundings import for_rays
from clpt.render.lights.encode import LightRows, has_tree, light_rows
from clpt.render.lights.find import is_whole
from clpt.render.lights.openings import Openings
from clpt.render.materials.encode import MaterialWords, gloss_word
from clpt.render.materials.encoder import Encoder
from clpt.render.media.bodies import BodyWords
from clpt.render.media.encode import MediumWords, media_features, medium_aims
from clpt.render.media.grids import DeviceGrid
from clpt.render.media.light_media import around_words, light_media_words
from clpt.render.motion import lower_motion
from clpt.render.records import (
    CameraFeatures,
    Features,
    FilmFeatures,
    FilterFeatures,
    LayerFeatures,
    SpectraFeatures,
    TransportFeatures,
    usual,
)
from clpt.render.records.film import LayerNames
from clpt.render.records.materials import row_words
from clpt.render.records.tables import LoweringCache, is_table
from clpt.render.scene_index import SceneIndex
from clpt.render.spectra.find import Density, density, emissions
from clpt.render.spectra.slopes import Slope
from clpt.render.textures.texels import ImageFiles
from clpt.scene import Scene
from clpt.scene import materials as mt
from clpt.scene.fingerprint import named_files
from clpt.scene.integrators import Integrator
from clpt.scene.params import Kind
from clpt.scene.shapes import Mesh

MOST_AIM = 0.5  # share of light paths that aim, above which others mostly end at diffuse surfaces
TREE_FROM = 16  # the least number of lights for a light tree, see bench/lights.py
INTEGRATORS = {"direct": "path", "vcm": "path"}  # kinds that use the kernels of another kind


@dataclass(frozen=True)
class Lowered:
    """A scene ready for the device: data that nobody writes to, which several devices may share.

    vertices (n, 3) float32, faces (m, 3) uint32, tags (m,) uint32, boxes (k, 2, 3) float32 and
    instances: the input of trees, see `Geometry`. tables: every other read-only array by name; the
    roots of instances' trees are filled in when trees are built. zero_copy: tables that are the
    caller's buffers. owners: of each row of `shapes`. layer_names: names in the film's layers.
    glass_rows: of the camera, see `encode_camera`. openings: of a room. integrator: of the scene,
    or the choice; reason: of the choice, "" without a choice; candidates: see `SceneIndex`;
    samples: of the whole film, as the scene demands. encoder: of the tables, for edited values.
    cache: for the next lowering. around: media at the camera, or the matter of bodies.
    device_grids: densities whose bricks kernels put into `images`. files: identities of the files
    of images.
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
    owners: tuple[Owner, ...]
    layer_names: LayerNames
    glass_rows: tuple[int, ...]
    openings: Openings
    warnings: tuple[str, ...]
    integrator: Integrator
    reason: str
    candidates: tuple[Integrator, ...]
    samples: int
    encoder: Encoder
    cache: LoweringCache
    around: tuple[Any, ...] = ()
    device_grids: tuple[DeviceGrid, ...] = ()
    files: ImageFiles = field(default_factory=ImageFiles)

    def __post_init__(self) -> None:
        geometry = (self.vertices, self.faces, self.tags, self.boxes)
        instances = (self.instances.rows, self.instances.boxes)
        for array in (*geometry, *instances, self.settings, *self.tables.values()):
            array.flags.writeable = False

    def table(self, name: str) -> np.ndarray:
        """A table by its name in clpt.records.TABLES."""
        geometry = {"vertices": self.vertices, "faces": self.faces}
        return geometry[name] if name in geometry else self.tables[name]

    @property
    def bytes(self) -> int:
        """Size of all arrays."""
        return sum(a.nbytes for a in (*self.tables.values(), self.vertices, self.faces, self.tags))


def lower(
    scene: Scene,
    texture_budget: int | None = None,
    former: Lowered | None = None,
    *,
    anew: bool = False,
    shared: bool = False,
    beside: Lowered | None = None,
) -> Lowered:
    """Lower a scene.

    texture_budget: [bytes] for images, None for no limit. former: of a similar scene, which saves
    time; choices for "auto" stay, unless `anew`. Arrays, lights and images that are the same
    objects as in the former scene are taken to hold the same values. shared: see `SceneIndex`.
    beside: of a scene with the same shapes in other materials, which saves time too.

    Raises SceneError where the scene makes no sense: it names the shape, light or material; and
    for an image whose file changes meanwhile, and where it takes more than the budget of its load
    has left.
    """
    cache = LoweringCache(former.cache if former else None, beside.cache if beside else None)
    integrator = lit_ghosts = openings = None
    if former is not None and not anew:
        integrator, lit_ghosts = former.integrator, former.features.transport.lit_ghosts
        openings = former.openings
    with budget.resumed(scene.account):
        files = ImageFiles.of(named_files(scene), former.files if former else ImageFiles())
        analysis = analyse(
            scene, cache, integrator, lit_before=lit_ghosts, openings=openings, shared=shared
        )
        lowered = encode(analysis, cache, texture_budget)
        files.check()
    return replace(lowered, files=files)


def encode(analysis: Analysis, cache: LoweringCache, texture_budget: int | None = None) -> Lowered:
    """Return a scene's tables, features and settings; cache: of the analysis.

    texture_budget: as of `lower`. Raises SceneError for parameters that cannot be encoded.
    """
    tables = _Tables(analysis, cache, texture_budget)
    index, geometry, encoder = analysis.index, tables.geometry, tables.encoder
    warnings = (
        *warnings_of(index), *analysis.warnings, *sorted(encoder.warnings), *geometry.warnings,
        *encoder.textures.finish(),
    )  # fmt: skip
    motion_row = tables.append_motion()
    names, layers = lower_names(index, geometry, tables.lights, encoder.store, cache)
    features = tables.features(motion_row, layers)
    settings = tables.settings(layers, features)
    cache.settle()
    arrays = encoder.store.arrays()
    encoder.textures.images.joined(arrays["images"])
    return Lowered(
        features=features,
        settings=settings,
        tables=arrays,
        vertices=geometry.vertices,
        faces=geometry.faces,
        tags=geometry.tags,
        boxes=geometry.boxes,
        instances=geometry.instances,
        zero_copy=_zero_copy_tables(index, geometry),
        owners=geometry.owners,
        layer_names=names,
        glass_rows=tables.glass_rows,
        openings=analysis.openings,
        warnings=warnings,
        integrator=index.integrator,
        reason=analysis.reason,
        candidates=index.candidates,
        samples=index.samples,
        around=analysis.around,
        encoder=encoder,
        cache=cache,
        device_grids=tuple(encoder.store.device_grids),
    )


class _Tables:
    """The tables of an analysed scene: each subject appends its words, in a fixed order.

    near: number of lamps that flights through media aim at; around: words of the bodies and of the
    medium at the camera. The others are indices of first words: profile: of the pixel filter for
    light paths, 0 without; density: of the density of wavelengths; aims: of spheres that light
    paths aim at; glass_rows: of the camera's glasses in `spectra`; ambient: 0 without.
    """

    def __init__(self, analysis: Analysis, cache: LoweringCache, texture_budget: int | None):
        self.analysis, self.index = analysis, analysis.index
        film = self.index.film
        ends = film.lambda_min, film.lambda_max
        self.wavelengths = density(self.index) if self.index.spectral else Density(*ends)
        self.encoder = Encoder(
            self.index.mode, *ends, sensor(film), self.wavelengths, texture_budget, cache
        )
        self.store = self.encoder.store
        filters.encode_filter(film.filter, self.store, self.index.splatting)
        self.profile = self._append_profile()
        self.materials = self._begin_materials()
        self.geometry = encode_geometry(
            analysis.geometry, self.encoder, self.materials, spheres_move=spheres_move(self.index)
        )
        media = MediumWords(
            self.index, self.encoder, self.materials, analysis.sealed, analysis.sources.volumes
        )
        self.lights = self._append_lights(media)
        self.near = self._append_medium_aims()
        self.around = self._append_bodies(media)
        self.density = self.store.size("distributions")
        self.tabulated = self._append_density()
        self.aims = self.store.append_floats("distributions", analysis.aims)
        counts = self.geometry.single_count, self.geometry.keys
        encode_attributes(self.geometry.owners, self.encoder.textures, cache, *counts)
        self.store.append("shapes", shape_words(self.geometry.rows))
        self.glass_rows = self._append_camera()
        self.ambient = self._append_ambient()
        self.openings = self.store.append("light_params", analysis.openings.words())

    def features(self, motion_row: int, layers: LayerFeatures) -> Features:
        """Return the features of the scene; append tangents of meshes."""
        index, analysis, camera = self.index, self.analysis, self.index.camera
        aimed, spectra = len(analysis.aims) > 0, self.encoder.spectra
        textures = self.encoder.textures.features()
        own = Features(
            camera=CameraFeatures(
                kind=camera.kind,
                disperses=index.spectral and bool(camera.dispersive_glasses),
                losses=camera.reflects,
                ghosts=index.lit_ghosts or camera.has_ghosts,
            ),
            film=FilmFeatures(
                filter=FilterFeatures(
                    index.film.filter.kind, index.filter_taps, index.filter_reach
                ),
                layers=layers,
                bands=bool(index.film.bands),
                alpha=index.film.alpha,
                reuse=index.reused,
                coats=index.reused and any(map(flags.is_coated, index.leaves)),
            ),
            transport=self._transport_features(aimed=bool(index.balanced) and aimed),
            lights=self.lights.features(
                self.materials.gloss_before, openings=bool(analysis.openings.rectangles)
            ),
            media=media_features(index, self.materials, self.near, analysis.sealed, escapes=aimed),
            motion=motion_features(index, self.geometry, motion_row),
            geometry=geometry_features(index, self.geometry, self.materials, textures, self.store),
            textures=textures,
            spectra=SpectraFeatures(index.mode, spectra.samples, spectra.step, self.tabulated),
            materials=self.materials.features(index),
        )
        if own.ratios:  # wavelengths part, so that paths differ in them
            own = replace(own, film=replace(own.film, reuse=False, coats=False))
        return usual.widened(own) if index.shared else own

    def _transport_features(self, *, aimed: bool) -> TransportFeatures:
        index = self.index
        kind, weighed = index.integrator.kind, index.weighed > 0
        return TransportFeatures(
            integrator=INTEGRATORS.get(kind, kind),
            sampler=index.sampler.kind,
            light_paths=index.light_paths,
            weighed=weighed,
            joined=index.joined and (index.light_paths or weighed),
            merged=index.merged,
            guided=index.guided,
            aimed=aimed * (2 if index.integrator.aimed > MOST_AIM else 1),
            lit_ghosts=index.lit_ghosts,
            light_filter=(*index.spread, self.profile) if weighed else (0, 0, 0),
        )

    def settings(self, layers: LayerFeatures, features: Features) -> NDArray[np.void]:
        """Return the record SETTINGS of the scene."""
        settings = settings_of(
            self.index, self.geometry, self.lights, self.wavelengths, self.analysis.sphere,
            layers, features,
        )  # fmt: skip
        settings["aims"], settings["aim_count"] = self.aims, len(self.analysis.aims)
        settings["openings"] = self.openings
        settings["opening_count"] = len(self.analysis.openings.rectangles)
        settings["opening_share"] = self.analysis.openings.share
        for name, word in zip(("bodies", "medium", "around"), self.around, strict=True):
            settings[f"camera_{name}"] = word
        settings["second_u"], settings["second_v"] = self.encoder.textures.second_uv
        settings["ambient"], settings["density"] = self.ambient, self.density
        if self.index.timed:
            set_times(settings, self.index, *self.analysis.at_camera)
            settings["slope_before"] = self.materials.slope_before
        return settings

    def append_motion(self) -> int:
        """Append the table of motions; return its index in `distributions`, 0 without motion."""
        index, sources = self.index, self.analysis.sources
        if not index.motions:
            return 0
        rows = list(sources.order)
        rows += [-1] * ((*sources.first, len(sources.power))[0] - len(rows))  # bricks of media
        return lower_motion(index.motions, len(index.listed), rows, self.store)

    def _begin_materials(self) -> MaterialWords:
        """Append a row of zeros, which idle lanes read as a material."""
        index = self.index
        if index.shifts:
            self.encoder.spectra.expect_light(emissions(index))
        leaves: tuple[type[Kind], ...] = (*mt.LEAVES, *index.leaves)
        longest = max(map(row_words, leaves))
        self.store.append("materials", np.zeros(longest, np.uint32))
        asked = self._asks_gloss(), self._asks_slopes()
        return MaterialWords(self.encoder, index.leaves, index.normal_mapped, *asked)

    @property
    def _tree_from(self) -> int | None:
        """The least number of lights for a light tree, None without."""
        if self.index.light_paths:
            return None
        return 1 if self.index.shared else TREE_FROM

    def _asks_gloss(self) -> bool:
        """Whether the tree over lights asks for the gloss of materials."""
        index = self.index
        tree = self._tree_from is not None and has_tree(
            self.analysis.sources.every, self._tree_from
        )
        leaves = (leaf for shape in index.shapes for leaf in mt.parts(shape.material))
        return tree and (index.shared or any(gloss_word(leaf) for leaf in leaves))

    def _asks_slopes(self) -> bool:
        """Whether light by time asks for the indices of groups; bodies that overlap have none."""
        index = self.index
        if not (index.timed and index.spectral) or index.nested:
            return False
        leaves = (leaf for shape in index.shapes for leaf in mt.parts(shape.material))
        return any(Slope.of(leaf) is not None for leaf in leaves)

    def _append_lights(self, media: MediumWords) -> LightRows:
        """Append the rows of `lights`, and note in the rows of shapes which lights they are."""
        index, emitters, sources = self.index, self.geometry.emitters, self.analysis.sources
        for medium in index.emitting:
            media.word(medium)
        lights = light_rows(
            index.lights, emitters, self.encoder, sources, self._tree_from, media.lights
        )
        self.store.append("lights", lights.rows.view(np.uint32))
        if lights.tree is not None:
            self.store.append("lights", lights.tree)
        for emitter, first in zip(emitters, sources.first, strict=True):
            row = self.geometry.rows[emitter.shape_row]
            row["light"] = first
            row["flags"] |= SHAPE_BITS["one_light"] if is_whole(emitter.shape) else 0
        return lights

    def _append_medium_aims(self) -> int:
        """Append the lamps that flights through media aim at; return how many."""
        homogeneous = (medium for medium in self.index.media if medium.lattice is None)
        near = (
            medium_aims(self.analysis.sources)
            if any(medium.scatters for medium in homogeneous)
            else ()
        )
        self.store.append("media", np.array(near, np.float32).view(np.uint32))
        return len(near)

    def _append_bodies(self, media: MediumWords) -> tuple[int, int, int]:
        """Append the media of lights and both sides of shapes; return `around`.

        Kernels find the sides of shapes behind the media of lights, in the same table.
        """
        index, bounding = self.index, [shape for _, shape, _, _ in self.geometry.owners]
        bodies = BodyWords(index.shapes) if index.nested else None
        if bodies is not None:
            sides = bodies.rows(bounding, self.encoder, self.materials, media)
        else:
            sides = media.of_shapes(bounding)
        absorbing = index.has_media or self.materials.absorption
        if absorbing and (index.balanced or index.light_paths or index.guided):
            lights = self.analysis.light_media
            words = light_media_words(lights, media, bodies, len(self.lights.rows))
            self.store.append("media", words)
        self.store.append("media", sides)
        around = self.analysis.around
        return around_words(around if bodies else for_rays(around), media, bodies)

    def _append_profile(self) -> int:
        if not self.index.weighed:
            return 0
        return filters.encode_profile(self.index.film.filter, self.store, self.index.splatting)

    def _append_density(self) -> bool:
        """Append the density of wavelengths if it is tabulated; return whether it is."""
        if not self.index.spectral or self.wavelengths.values is None:
            return False
        self.store.append_floats("distributions", self.wavelengths.words())
        return True

    def _append_camera(self) -> tuple[int, ...]:
        """Append the camera; return the rows in `spectra` of its glasses that disperse."""
        camera, film = self.index.camera, self.index.film
        glasses = camera.dispersive_glasses if self.index.spectral else ()
        rows = tuple(self.encoder.spectra.row(glass) for glass in glasses)
        self.store.append_floats("camera", encode_camera(camera, film.width, film.height, rows))
        return rows

    def _append_ambient(self) -> int:
        ambient = self.index.integrator.ambient
        if ambient is None:
            return 0
        return self.store.append("light_params", self.encoder.emission_words(ambient))


def _zero_copy_tables(index: SceneIndex, geometry: Geometry) -> dict[str, Any]:
    """Buffers of a mesh that alone has triangles, which are tables as they are."""
    meshes = [s for _, s, _, _ in geometry.owners if s.kind not in shapes.ANALYTIC]
    if len(meshes) != 1 or index.prototypes or not isinstance(meshes[0], Mesh):
        return {}
    mesh = meshes[0]
    if is_refined(mesh):
        return {}
    reversed_ = transforms.flips_handedness(shapes.placement(mesh)) != mesh.flip_normals
    wanted = {"uvs": (mesh.uvs, "f")}
    if not reversed_ and len(mesh.faces) == len(geometry.faces):  # no triangle was left out
        wanted["faces"] = mesh.faces, "iu"
    return {name: v.data for name, (v, kind) in wanted.items() if is_table(v, kind)}
