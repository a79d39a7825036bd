"""Lowering: a scene as plain data becomes tables of words, features and settings."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import spectra, transforms
from clpt.files import budget
from clpt.geometry import shape_records, shapes
from clpt.geometry.instancing import Instances
from clpt.geometry.refining import is_refined
from clpt.records import SHAPE_BITS
from clpt.render.camera.encode import encode_camera
from clpt.render.film import filters
from clpt.render.film.colour import sensor
from clpt.render.flow import features as needs
from clpt.render.flow.find import Analysis, Before, analyse
from clpt.render.flow.layer_names import lower_names
from clpt.render.flow.settings import Found, settings_of
from clpt.render.geometry.encode import encode_attributes, encode_geometry, shape_words
from clpt.render.geometry.find import Geometry, Owner, spheres_move
from clpt.render.lights.encode import LightRows, has_tree, light_rows
from clpt.render.lights.find import Sources
from clpt.render.materials.encode import MaterialWords, gloss_word
from clpt.render.materials.encoder import Encoder
from clpt.render.media.bodies import BodyWords
from clpt.render.media.encode import MediumWords, medium_aims
from clpt.render.media.grids import DeviceGrid
from clpt.render.media.light_media import light_media_words
from clpt.render.motion.encode import lower_motion
from clpt.render.records import Features, GeometryFeatures, LayerFeatures, SpectraFeatures
from clpt.render.records.device_arrays import is_table
from clpt.render.records.film import LayerNames
from clpt.render.records.lowering_cache import LoweringCache
from clpt.render.records.materials import row_words
from clpt.render.scene_index import SceneIndex
from clpt.render.spectra.find import Density, density, emissions
from clpt.render.textures.image_files import ImageFiles
from clpt.render.transport import photons
from clpt.scene import Scene
from clpt.scene import materials as mt
from clpt.scene.cameras import CONNECTED
from clpt.scene.fingerprint import named_files
from clpt.scene.integrators import DEEPEST, Film, Integrator
from clpt.scene.params import Kind, params
from clpt.scene.roles import INDEX
from clpt.scene.shapes import Mesh, Shape

TREE_FROM = 16  # lights from which a tree chooses among them, see bench/lights.py


TANGENT_WORDS = 4


@dataclass(frozen=True)
class Lowered:
    """A scene ready for the device: data that nobody writes to, which several devices may share.

    vertices (n, 3) float32, faces (m, 3) uint32, tags (m,) uint32, boxes (k, 2, 3) float32 and
    instances: what trees are built of, see `Geometry`. tables: every other read-only array by name;
    where an instance's tree begins is filled in when trees are built. zero_copy: tables that are
    the caller's buffers. owners: of each row of `shapes`. layer_names: what layers tell of.
    glass_rows: of the camera, see `encode_camera`. integrator: of the scene, or what was chosen;
    reason: why, "" where there was no choice; candidates: see `SceneIndex`; samples: of the
    whole film, as the scene asks for. encoder: what made the tables, for values that are edited.
    cache: what the next lowering need not make again. around: media at the camera, or the matter of
    bodies. device_grids: densities whose bricks kernels put into `images`. files: what stands for
    the files that images were read from.
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
        own = (self.vertices, self.faces, self.tags, self.boxes, self.settings)
        for array in (*own, *self.tables.values(), self.instances.rows, self.instances.boxes):
            array.flags.writeable = False

    def table(self, name: str) -> np.ndarray:
        """A table by its name in clpt.records.TABLES."""
        own = {"vertices": self.vertices, "faces": self.faces}
        return own[name] if name in own else self.tables[name]

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
) -> Lowered:
    """Lower a scene.

    texture_budget: [bytes] for images, None for any number. former: of a scene that has much in
    common with this one: it saves time, and what is "auto" stays as chosen, unless it is chosen
    anew. Arrays, lights and images that are the same objects as then are taken to hold the same.

    Raises SceneError where the scene makes no sense: it names the shape, light or material; and
    for an image whose file changes meanwhile, and where it takes more than the budget of its load
    has left.
    """
    cache = LoweringCache(former.cache if former else None)
    before = None
    if former is not None and not anew:
        before = Before(former.integrator, former.features.transport.lit_ghosts)
    with budget.resumed(scene.account):
        files = ImageFiles.of(named_files(scene), former.files if former else ImageFiles())
        made = encode(analyse(scene, cache, before), cache, texture_budget)
        files.check()
    return replace(made, files=files)


def encode(found: Analysis, cache: LoweringCache, texture_budget: int | None = None) -> Lowered:
    """Return a scene's tables, features and settings; cache: what the analysis was made with.

    texture_budget: as of `lower`. Raises SceneError for parameters that cannot be encoded.
    """
    index, film = found.index, found.index.film
    ends = film.lambda_min, film.lambda_max
    wavelengths = density(index) if index.spectral else Density(*ends)
    encoder = Encoder(index.mode, *ends, sensor(film), wavelengths, texture_budget, cache)
    surfaces = _encode_surfaces(found, encoder)
    rows = _encode_views(found, encoder, wavelengths, surfaces.geometry)
    geometry, lights = surfaces.geometry, surfaces.lights
    warnings = (
        *_warnings(index), *found.warnings, *sorted(encoder.warnings), *geometry.warnings,
        *encoder.textures.finish(),
    )  # fmt: skip
    motion_row = _lower_motion(found, lights, encoder)
    names, layers = lower_names(index, geometry, lights, encoder.store, cache)
    features = _features(found, encoder, surfaces, rows, motion_row, layers)
    aims, around, disperses = (rows.aims, len(found.aims)), surfaces.around, features.dispersion
    own = Found(rows.density, rows.ambient, aims, around, disperses, layers, encoder.second_uv)
    settings = settings_of(index, geometry, lights, wavelengths, found.sphere, own)
    cache.settle()
    tables = encoder.store.arrays()
    encoder.textures.images.joined(tables["images"])
    return Lowered(
        features=features,
        settings=settings,
        tables=tables,
        vertices=geometry.vertices,
        faces=geometry.faces,
        tags=geometry.tags,
        boxes=geometry.boxes,
        instances=geometry.instances,
        zero_copy=_zero_copy_tables(index, geometry),
        owners=geometry.owners,
        layer_names=names,
        glass_rows=rows.glasses,
        warnings=warnings,
        integrator=index.integrator,
        reason=found.reason,
        candidates=index.candidates,
        samples=index.samples,
        around=found.around,
        encoder=encoder,
        cache=cache,
        device_grids=tuple(encoder.store.device_grids),
    )


@dataclass(frozen=True)
class _Surfaces:
    """Shapes, their materials and media, and lights, whose words are in the tables.

    near: how many lamps flights through media end at; around: what is at the camera, see `Found`.
    """

    geometry: Geometry
    materials: MaterialWords
    lights: LightRows
    near: int
    around: tuple[int, int]


def _encode_surfaces(found: Analysis, encoder: Encoder) -> _Surfaces:
    """Append shapes, materials, media and lights."""
    index = found.index
    filters.encode_filter(index.film.filter, encoder.store, index.splatting)
    materials = _begin_materials(found, encoder)
    moves = spheres_move(index)
    geometry = encode_geometry(found.geometry, encoder, materials, spheres_move=moves)
    media = MediumWords(index, encoder, materials, found.sealed, found.sources.volumes)
    lights = _lower_lights(index, encoder, geometry, found.sources, media)
    near = _lower_medium_aims(index, encoder, lights)
    around = _lower_bodies(found, geometry, encoder, materials, media)
    return _Surfaces(geometry, materials, lights, near, around)


@dataclass(frozen=True)
class _Views:
    """Where the words begin of what paths and pixels look up.

    profile: of the filter, 0 for none; density: of wavelengths, if it is tabulated; aims: of light
    paths; glasses: rows in `spectra` of the camera's; ambient: 0 for none.
    """

    profile: int
    density: int
    tabulated: bool
    aims: int
    glasses: tuple[int, ...]
    ambient: int


def _encode_views(
    found: Analysis, encoder: Encoder, wavelengths: Density, geometry: Geometry
) -> _Views:
    """Append what the film, the camera and the integrator ask for, and the rows of shapes."""
    index, store = found.index, encoder.store
    profile = _lower_profile(index, encoder)
    density_row, tabulated = _lower_density(index, encoder, wavelengths)
    aims = store.append_floats("distributions", found.aims)
    counts = geometry.single_count, geometry.keys
    encode_attributes(geometry.owners, encoder.textures, encoder.cache, *counts)
    store.append("shapes", shape_words(geometry.rows))
    glasses = _encode_camera(index, encoder)
    ambient = _lower_ambient(index, encoder)
    return _Views(profile, density_row, tabulated, aims, glasses, ambient)


def _features(
    found: Analysis, encoder: Encoder, surfaces: _Surfaces, rows: _Views, motion: int,
    layers: LayerFeatures,
) -> Features:  # fmt: skip
    """Return what the scene uses; motion: as of `_lower_motion`; layers: of the film."""
    index = found.index
    aims = len(found.aims) > 0
    own = index.mode, encoder.spectra.samples, encoder.spectra.step, rows.tabulated
    return Features(
        camera=needs.of_camera(index),
        film=needs.of_film(index, layers),
        transport=needs.of_transport(index, rows.profile, aimed=bool(index.balanced) and aims),
        lights=needs.of_lights(surfaces.lights, surfaces.materials.gloss_before),
        media=needs.of_media(index, surfaces.materials, surfaces.near, found.sealed, escapes=aims),
        motion=needs.of_motion(index, surfaces.geometry, motion),
        geometry=_geometry_features(index, encoder, surfaces),
        textures=needs.of_textures(encoder),
        spectra=SpectraFeatures(*own),
        materials=needs.of_materials(index, encoder, surfaces.materials),
    )


def _geometry_features(
    index: SceneIndex, encoder: Encoder, surfaces: _Surfaces
) -> GeometryFeatures:
    """Return what the scene has of geometry; append its tangents, if materials ask for them."""
    textures = needs.of_textures(encoder)
    made = needs.of_geometry(index, surfaces.geometry, surfaces.materials, textures)
    if made.tangents and surfaces.geometry.tangents:
        made = replace(made, vertex_tangents=_lower_tangents(surfaces.geometry, encoder))
    return made


def _lower_motion(found: Analysis, lights: LightRows, encoder: Encoder) -> int:
    """Append the table of what moves, if anything does; return where in `distributions` it is."""
    index, rows = found.index, list(found.sources.order)
    if not index.motions:
        return 0
    rows += [-1] * ((*lights.first, len(lights.rows))[0] - len(rows))  # bricks of media
    return lower_motion(index.motions, len(index.listed), rows, encoder.store)


def _lower_tangents(geometry: Geometry, encoder: Encoder) -> int:
    """Append four words for each vertex; return where in `distributions` they are.

    They are the tangents that shapes say, else zero. A row of zeros is before them, so that the
    place is never 0.
    """
    words = np.zeros((1 + len(geometry.vertices), TANGENT_WORDS), np.float32)
    for first, own in geometry.tangents:
        words[1 + first : 1 + first + len(own)] = own
    return encoder.store.append_floats("distributions", words) + TANGENT_WORDS


def _lower_profile(index: SceneIndex, encoder: Encoder) -> int:
    """Append the filter's values for light paths, if any; return their place in `distributions`."""
    if not index.weighed:
        return 0
    return filters.encode_profile(index.film.filter, encoder.store, index.splatting)


def _lower_density(index: SceneIndex, encoder: Encoder, wavelengths: Density) -> tuple[int, bool]:
    """Append wavelengths' density if it is tabulated.

    Return where in `distributions` it would begin, and whether it is there.
    """
    density_row = encoder.store.size("distributions")
    tabulated = index.spectral and wavelengths.values is not None
    if tabulated:
        encoder.store.append_floats("distributions", wavelengths.words())
    return density_row, tabulated


def _begin_materials(found: Analysis, encoder: Encoder) -> MaterialWords:
    """Append what idle lanes read as a material, and make the maker of material words."""
    index = found.index
    if index.shifts:
        encoder.spectra.expect_light(emissions(index))
    leaves: tuple[type[Kind], ...] = (*mt.LEAVES, *index.leaves)
    longest = max(map(row_words, leaves))
    encoder.store.append("materials", np.zeros(longest, np.uint32))
    tells = index.normal_mapped, _asks_gloss(found)
    return MaterialWords(encoder, index.leaves, *tells)


def _asks_gloss(found: Analysis) -> bool:
    """Whether the tree over lights asks for the gloss of materials."""
    index = found.index
    tree = not index.light_paths and has_tree(found.sources.every, TREE_FROM)
    leaves = (leaf for shape in index.shapes for leaf in mt.parts(shape.material))
    return tree and any(gloss_word(leaf) for leaf in leaves)


def _lower_medium_aims(index: SceneIndex, encoder: Encoder, lights: LightRows) -> int:
    """Append the lamps near which flights through media end; return how many."""
    homogeneous = (medium for medium in index.media if medium.lattice is None)
    near = medium_aims(lights) if any(medium.scatters for medium in homogeneous) else ()
    encoder.store.append("media", np.array(near, np.float32).view(np.uint32))
    return len(near)


def _lower_bodies(
    found: Analysis,
    geometry: Geometry,
    encoder: Encoder,
    materials: MaterialWords,
    media: MediumWords,
) -> tuple[int, int]:
    """Append what is around lights, and on both sides of shapes; return that at the camera.

    Kernels find the sides of shapes behind the media of lights: all are parts of one table.
    """
    index, bounding = found.index, [shape for _, shape, _, _ in geometry.owners]
    bodies = BodyWords(index.shapes) if index.nested else None
    if bodies is not None:
        sides = bodies.rows(bounding, encoder, materials, media)
    else:
        sides = media.of_shapes(bounding)
    if index.has_media and (index.balanced or index.light_paths or index.guided):
        words = light_media_words(found.light_media, media, bodies)
        encoder.store.append("media", words)
    encoder.store.append("media", sides)
    if bodies is not None:
        return bodies.around(found.around, media)
    return 0, media.word(next(iter(found.around), None))


def _lower_lights(
    index: SceneIndex,
    encoder: Encoder,
    geometry: Geometry,
    sources: Sources,
    media: MediumWords,
) -> LightRows:
    """Append the rows of `lights`, and note in the rows of shapes which lights they are."""
    tree_from = None if index.light_paths else TREE_FROM
    for medium in index.emitting:
        media.word(medium)
    emitters = geometry.emitters
    lights = light_rows(index.lights, emitters, encoder, sources, tree_from, media.lights)
    encoder.store.append("lights", lights.rows.view(np.uint32))
    if lights.tree is not None:
        encoder.store.append("lights", lights.tree)
    for emitter, first, whole in zip(geometry.emitters, lights.first, lights.whole, strict=True):
        row = geometry.rows[emitter.shape_row]
        row["light"] = first
        row["flags"] |= SHAPE_BITS["one_light"] if whole else 0
    return lights


def _encode_camera(index: SceneIndex, encoder: Encoder) -> tuple[int, ...]:
    """Append the camera; return the rows in `spectra` of its glasses that disperse."""
    camera, film = index.camera, index.film
    glasses = camera.dispersive_glasses
    rows = tuple(encoder.spectra.row(glass) for glass in glasses) if index.spectral else ()
    words = encode_camera(camera, film.width, film.height, rows)
    encoder.store.append_floats("camera", words)
    return rows


def _lower_ambient(index: SceneIndex, encoder: Encoder) -> int:
    """Append the ambient light of an integrator; return its first word, 0 if there is none."""
    ambient = index.integrator.ambient
    if ambient is None:
        return 0
    return encoder.store.append("light_params", encoder.emission_words(ambient))


def _warnings(index: SceneIndex) -> list[str]:
    """Return warnings of parts of the scene that are not rendered as it says."""
    film, integrator = index.film, index.integrator
    warnings = list(index.warnings)
    if index.mode == "rgb" and index.camera.dispersive_glasses:
        warnings.append(f"{index.camera.kind}.glass: in RGB mode all wavelengths have one focus")
    if index.mode == "rgb" and any(map(_disperses, index.shapes)):
        warnings.append("in rgb mode glass does not disperse: ask for the spectral mode")
    if index.motions:
        warnings += _of_motion(index)
    if integrator.light_paths:
        warnings += _left_to_the_camera(index)
    if integrator.guiding and not index.lights_reach:
        warnings.append(f"{integrator.kind}.guiding: left aside, as {index.lit_media}")
    depth, most = integrator.max_depth, photons.DEEPEST if index.merged else DEEPEST
    if depth > most:
        warnings.append(f"integrator.max_depth: {depth} counts as {most}, the longest path")
    if index.spectral and not film.bands and not _sees(film):
        warnings.append(
            f"film.sensor sees nothing from {film.lambda_min:g} to {film.lambda_max:g} nm, so the"
            " picture is black; ask for film.bands"
        )
    if not index.lights and next(emissions(index), None) is None:
        warnings.append("no light in the scene, so the picture is black: add one to `lights`")
    if film.mode == "rgb" and mt.Fluorescent in index.leaves:
        warnings.append("in rgb mode fluorescent paint has its colour under D65, at most white")
    if film.mode == "rgb" and any(medium.glows for medium in index.media):
        warnings.append("in rgb mode dyes in media only absorb: ask for the spectral mode")
    return warnings


def _disperses(shape: Shape) -> bool:
    """Whether a shape refracts wavelengths differently, in the spectral mode."""
    return any(
        param.role is INDEX and not isinstance(spectra.index(vars(part)[name]), spectra.Constant)
        for part in mt.parts(shape.material)
        if part.refracts
        for name, param in params(type(part)).items()
    )


def _of_motion(index: SceneIndex) -> list[str]:
    """Return warnings of grids of media that stay where a shape moves."""
    warnings: list[str] = []
    for i in index.motions.shapes:
        shape = index.listed[i]
        media = (medium for s in shape.members for medium in (s.interior, s.exterior))
        if any(medium is not None and medium.lattice is not None for medium in media):
            warnings.append(
                f"{shapes.where(shape)}.motion: its boundary moves, the grid of its medium stays"
            )
    return warnings


def _left_to_the_camera(index: SceneIndex) -> list[str]:
    """Return warnings of light that only paths from the camera find, not light paths or photons."""
    camera, integrator = index.camera, index.integrator
    kind, warnings = integrator.kind, []
    if integrator.light_tracing and not index.joined:
        names = " and ".join(CONNECTED)
        reason = f"a {camera.kind} camera cannot be joined to a point"
        if camera.kind in CONNECTED:
            reason = "its glass disperses"
        name = "light_tracing" if kind == "vcm" else "light_paths"
        warnings.append(f"{kind}.{name}: left aside, as {reason}; {names} can, without such glass")
    if integrator.merging and not index.merged:
        reason = f"a path needs {photons.FIRST + 1} surfaces"
        if not index.lights_reach:
            reason = index.lit_media
        if index.shifts:
            reason = "what fluoresces gives light other wavelengths"
        warnings.append(f"{kind}.merging: left aside, as {reason}")
    if not index.lights_reach:
        warnings.append(f"{kind}.light_paths: left aside, as {index.lit_media}")
    if index.balanced:
        warnings += [
            f"{kind}.light_paths: none start at lights[{i}], whose light does not fall with "
            "distance"
            for i, light in enumerate(index.lights)
            if light.reach == "placed" and not light.falloff
        ]
    return warnings


def _sees(film: Film) -> bool:
    """Whether a film's sensor responds to any of its wavelengths."""
    return bool(sensor(film).sample(np.linspace(film.lambda_min, film.lambda_max, 2001)).any())


def _zero_copy_tables(index: SceneIndex, geometry: Geometry) -> dict[str, Any]:
    """Buffers of a mesh that alone has triangles, which are tables as they are."""
    meshes = [s for _, s, _, _ in geometry.owners if s.kind not in shape_records.ANALYTIC]
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
