"""The features of a lowered scene: what each step of lowering needs of the kernels."""

from __future__ import annotations

from dataclasses import replace

from clpt.geometry import shape_records
from clpt.render.geometry.find import Geometry, spheres_move
from clpt.render.lights.encode import LightRows
from clpt.render.materials.encode import MaterialWords
from clpt.render.materials.encoder import Encoder
from clpt.render.records import (
    CameraFeatures,
    FilmFeatures,
    FilterFeatures,
    GeometryFeatures,
    LayerFeatures,
    LightFeatures,
    MaterialFeatures,
    MediaFeatures,
    MotionFeatures,
    TextureFeatures,
    TransportFeatures,
)
from clpt.render.scene_index import SceneIndex
from clpt.scene.media import Medium

FEW_LIGHTS = 256  # up to which one random number chooses a light and a point on it
FEW_INSTANCES = 2  # up to which rays go to each, where some deform
INTEGRATORS = {"direct": "path", "vcm": "path"}  # kinds that have the kernels of another one


def of_camera(index: SceneIndex) -> CameraFeatures:
    """Return the features of a scene's camera."""
    camera = index.camera
    return CameraFeatures(
        kind=camera.kind,
        disperses=index.spectral and bool(camera.dispersive_glasses),
        losses=camera.reflects,
        ghosts=index.lit_ghosts or camera.has_ghosts,
    )


def of_film(index: SceneIndex, layers: LayerFeatures) -> FilmFeatures:
    """Return the features of the camera's film, which has these layers."""
    film = index.film
    return FilmFeatures(
        filter=FilterFeatures(film.filter.kind, index.filter_taps, index.filter_reach),
        layers=layers,
        bands=bool(film.bands),
        alpha=index.film.alpha,
    )


def of_transport(index: SceneIndex, profile: int, *, aimed: bool) -> TransportFeatures:
    """Return the features of what paths do.

    profile: where in `distributions` the values of the pixel filter begin; aimed: whether light
    paths aim at something.
    """
    integrator, weighed = index.integrator.kind, index.weighed > 0
    return TransportFeatures(
        integrator=INTEGRATORS.get(integrator, integrator),
        sampler=index.sampler.kind,
        light_paths=index.light_paths,
        weighed=weighed,
        joined=index.joined and (index.light_paths or weighed),
        merged=index.merged,
        guided=index.guided,
        aimed=aimed,
        lit_ghosts=index.lit_ghosts,
        light_filter=(*index.spread, profile) if weighed else (0, 0, 0),
    )


def of_lights(lights: LightRows, gloss: int = 0) -> LightFeatures:
    """Return the features of the rows of `lights`."""
    return LightFeatures(
        kinds=lights.kinds,
        infinite=lights.infinite > 0,
        visible=lights.visible,
        two_sided=lights.two_sided,
        unseen=lights.unseen,
        tree=lights.tree is not None,
        few=len(lights.rows) <= FEW_LIGHTS,
        gloss=gloss,
    )


def of_media(
    index: SceneIndex,
    materials: MaterialWords,
    aims: int,
    sealed: frozenset[Medium],
    *,
    escapes: bool,
) -> MediaFeatures:
    """Return the features of a scene's media.

    aims: places of lamps that flights through media aim at; sealed: media that rays to lights
    cannot leave; escapes: whether rays of their own leave them.
    """
    return MediaFeatures(
        absorption=materials.absorption,
        present=index.has_media,
        chromatic=any(medium.is_chromatic for medium in index.media),
        emissive=bool(index.emitting),
        dyed=index.dyed,
        sealed=bool(sealed) and not (index.balanced or index.guided),
        escapes=escapes and not index.balanced,
        bodies=index.nested,
        aims=aims,
        grids=index.grids,
    )


def of_motion(index: SceneIndex, geometry: Geometry, row: int) -> MotionFeatures:
    """Return what of a scene moves while its shutter is open.

    row: where in `distributions` the table of that begins.
    """
    motions = index.motions
    analytic = {one.number for one in index.placed if one.shape.kind in shape_records.ANALYTIC}
    placed = {int(number) for prototype in index.prototypes for number in prototype.numbers}
    lit = {int(geometry.rows[one.shape_row]["number"]) for one in geometry.emitters}
    numbers = motions.shapes.keys()
    found = MotionFeatures(
        camera=motions.camera is not None,
        instances=bool(placed & numbers),
        shapes=bool(analytic & numbers),
        lights=bool(motions.lamps) or bool(lit & numbers),
        vertices=_keyed(geometry),
        spheres=spheres_move(index),
        emitters=any(one.keys > 1 for one in geometry.emitters),
        scales=motions.scales,
    )
    return replace(found, row=row) if found.present else found


def of_geometry(
    index: SceneIndex, geometry: Geometry, materials: MaterialWords, textures: TextureFeatures
) -> GeometryFeatures:
    """Return the features of a scene's shapes, of which materials and textures ask something too.

    Where the tangents lie that meshes say is known when they are lowered.
    """
    tangents = materials.tangents or index.normal_mapped or textures.mips
    instances = bool(index.prototypes)
    count = len(geometry.instances.rows)
    return GeometryFeatures(
        analytic=tuple(kind for kind in shape_records.ANALYTIC if kind in geometry.analytic),
        instances=instances,
        only_instances=instances and not geometry.world_vertices,
        few_instances=count if _keyed(geometry) and count <= FEW_INSTANCES else 0,
        normals=geometry.normals,
        uvs=materials.uvs or geometry.uvs or tangents or "uv" in index.layers,
        tangents=tangents,
    )


def _keyed(geometry: Geometry) -> bool:
    """Whether vertices have a row for each of several keys."""
    return any(count > 1 for count in geometry.keys.values())


def of_textures(encoder: Encoder) -> TextureFeatures:
    """Return the features of the textures that have been lowered."""
    textures = encoder.textures
    return TextureFeatures(
        roles=tuple(sorted(textures.roles)),
        mappings=textures.mappings,
        depth=textures.depth,
        attributes=bool(textures.attributes),
    )


def of_materials(index: SceneIndex, encoder: Encoder, materials: MaterialWords) -> MaterialFeatures:
    """Return the features of a scene's materials, and the sources of all that is loaded."""
    return MaterialFeatures(
        leaves=index.leaves,
        transmitting=tuple(sorted(materials.transmitting)),
        shining=index.shining,
        mixtures=materials.mixture_depth,
        normal_mapped=index.normal_mapped,
        free_panes=index.free_panes,
        sources=encoder.sources,
    )
