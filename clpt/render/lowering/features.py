"""The features of a lowered scene: what it needs of the kernels."""

from __future__ import annotations

from clpt.geometry import shape_records
from clpt.render.analysis.cameras import dispersive_glasses
from clpt.render.analysis.geometry import Geometry, spheres_move
from clpt.render.analysis.index import SceneIndex
from clpt.render.contract.features import Features, disperses
from clpt.render.contract.texture_records import MIPS
from clpt.render.lowering.encoder import Encoder
from clpt.render.lowering.lights.lights import LightRows
from clpt.render.lowering.materials.material_words import MaterialWords
from clpt.scene.cameras import Lens
from clpt.scene.media import Grid, Lattice

FEW_LIGHTS = 256  # up to which one random number chooses a light and a point on it
FEW_INSTANCES = 2  # up to which rays go to each, where some deform
INTEGRATORS = {"direct": "path", "vcm": "path"}  # kinds that have the kernels of another one


def features_of(
    index: SceneIndex,
    encoder: Encoder,
    materials: MaterialWords,
    geometry: Geometry,
    lights: LightRows,
    tabulated_density: bool,
    profile: int,
    aimed: bool,
    medium_aims: int,
    sealed: bool,
    motion_row: int,
) -> Features:
    """Return the features of a scene, from what each step of its lowering has met.

    profile: where in `distributions` the values of the pixel filter begin;
    aimed: whether light paths aim;
    medium_aims: places of lamps that flights through media aim at; sealed: whether there are media
    that rays to lights cannot leave;
    motion_row: where in `distributions` the table of what moves begins.
    """
    scene, textures = index.scene, encoder.textures
    sources = encoder.sources
    mips = any(kind in MIPS for kind, _ in textures.roles)
    tangents = materials.tangents or index.normal_mapped or mips
    uvs = materials.uvs or geometry.uvs or tangents or "uv" in index.layers
    glass_lens = index.spectral and bool(dispersive_glasses(scene.camera))
    return Features(
        mode=index.mode,
        camera=scene.camera.kind,
        sampler=scene.sampler.kind,
        filter=scene.film.filter.kind,
        filter_taps=index.filter_taps,
        filter_reach=index.filter_reach,
        integrator=INTEGRATORS.get(scene.integrator.kind, scene.integrator.kind),
        leaves=index.leaves,
        transmitting=tuple(sorted(materials.transmitting)),
        shining=index.shining,
        lights=lights.kinds,
        textures=tuple(sorted({kind for kind, _ in textures.roles})),
        texture_roles=tuple(sorted(textures.roles)),
        texture_depth=textures.depth,
        texture_mappings=textures.mappings,
        attributes=bool(textures.attributes),
        analytic=tuple(kind for kind in shape_records.ANALYTIC if kind in geometry.analytic),
        instances=bool(index.prototypes),
        only_instances=bool(index.prototypes) and not geometry.world_vertices,
        few_instances=_few(index, geometry),
        normals=geometry.normals,
        uvs=uvs,
        tangents=tangents,
        mixtures=materials.mixture_depth,
        normal_mapped=index.normal_mapped,
        null_surfaces=index.free_panes or any(cls.is_null for cls in index.leaves),
        free_panes=index.free_panes,
        infinite=lights.infinite > 0,
        light_paths=index.light_paths,
        weighed=index.weighed > 0,
        joined=index.joined and (index.light_paths or index.weighed > 0),
        merged=index.merged,
        guided=index.guided,
        aimed=aimed,
        light_filter=(*index.spread, profile) if index.weighed else (0, 0, 0),
        visible_lights=lights.visible,
        two_sided_lights=lights.two_sided,
        light_tree=lights.tree is not None,
        many_lights=len(lights.rows) > FEW_LIGHTS,
        absorption=materials.absorption,
        media=index.has_media,
        bodies=index.nested,
        chromatic_media=any(medium.is_chromatic for medium in index.media),
        medium_aims=medium_aims,
        sealed_media=sealed and not (index.balanced or index.guided),
        emissive_media=bool(index.emitting),
        emissive_grids=index.glowing,
        hot_grids=any(getattr(one, "temperature", None) is not None for one in index.emitting),
        grids=any(isinstance(medium, Lattice) for medium in index.media),
        moving=moving_parts(index, geometry),
        motion_scales=index.motions.scales,
        motion_row=motion_row,
        tinted_grids=index.tinted,
        dyed_media=index.dyed,
        coloured_grids=index.coloured,
        mixed_grids=index.most_parts,
        byte_grids=any(isinstance(one, Grid) and one.bits == 8 for one in index.media),
        dispersion=glass_lens or disperses(index.leaves, sources),
        glass_lens=glass_lens,
        lens_losses=isinstance(scene.camera, Lens) and scene.camera.reflects,
        lens_ghosts=index.lit_ghosts or getattr(scene.camera, "ghosts", 0.0) > 0.0,
        lit_ghosts=index.lit_ghosts,
        bands=bool(scene.film.bands),
        alpha=index.alpha,
        layers=index.layers,
        tabulated_density=tabulated_density,
        spectra_size=encoder.spectra.samples,
        spectra_step=encoder.spectra.step,
        sources=sources,
    )


def _few(index: SceneIndex, geometry: Geometry) -> int:
    """Return how many instances there are, if so few that a tree over them does not pay."""
    count = len(geometry.instances.rows)
    return count if _keyed(geometry) and count <= FEW_INSTANCES else 0


def _keyed(geometry: Geometry) -> bool:
    """Whether vertices have a row for each of several keys."""
    return any(count > 1 for count in geometry.keys.values())


def moving_parts(index: SceneIndex, geometry: Geometry) -> tuple[str, ...]:
    """Return what of a scene moves while its shutter is open."""
    motions = index.motions
    analytic = {one.number for one in index.placed if one.shape.kind in shape_records.ANALYTIC}
    placed = {int(number) for prototype in index.prototypes for number in prototype.numbers}
    lit = {int(geometry.rows[one.shape_row]["number"]) for one in geometry.emitters}
    deform = any(one.keys > 1 for one in geometry.emitters)
    numbers = motions.shapes.keys()
    found = {
        "camera": motions.camera is not None,
        "instances": bool(placed & numbers),
        "shapes": bool(analytic & numbers),
        "lights": bool(motions.lamps) or bool(lit & numbers),
        "vertices": _keyed(geometry),
        "spheres": spheres_move(index),
        "emitters": deform,
    }
    return tuple(name for name, moves in found.items() if moves)
