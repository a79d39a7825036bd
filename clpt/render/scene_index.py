"""The index of a scene: facts that several steps of lowering need."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from clpt.geometry import instancing, shapes
from clpt.geometry.instancing import Placed, Prototype
from clpt.geometry.motion import Motions
from clpt.render.records import GridFeatures, materials, usual
from clpt.scene import Film, Scene
from clpt.scene import materials as mt
from clpt.scene.cameras import Camera
from clpt.scene.integrators import Direct, Integrator, Path, Sampler
from clpt.scene.layers import LAYERS
from clpt.scene.lights import Light
from clpt.scene.media import Grid, Medium
from clpt.scene.phases import LEAVES
from clpt.scene.scatterer import Scatterer
from clpt.scene.shapes import Shape
from clpt.scene.textures import turned

GHOSTS = 1.0  # light paths for each sample that are ghosts of a lens
UNKNOWN = "its medium was not looked for"


@dataclass(frozen=True)
class SceneIndex:
    """The parts of a scene with facts about them.

    integrator: of the scene, or the choice for "auto". lights: lights without a shape. listed:
    shapes as the scene lists them, with instances. shapes: every shape once; shapes of groups have
    the coordinates of their group. placed: shapes that are lowered as they are. prototypes: shapes
    that instances share. leaves: classes of leaf materials, in the order of material words.
    normal_mapped: whether a material has a normal or a bump map. warnings: of instances that became
    triangles. motions: of shapes, lights and the camera. lit_media: why no path can start at some
    light in a medium; "" if paths can. lit_before: whether light paths were ghosts of a lens before
    an edit; None without an edit. candidates: integrators for a trial, the chosen integrator first;
    empty without a trial. shared: whether programs are those of many scenes.
    """

    camera: Camera
    film: Film
    integrator: Integrator
    sampler: Sampler
    spp: int
    noise: float | None
    seed: int
    lights: Sequence[Light]
    listed: Sequence[Shape]
    shapes: tuple[Shape, ...]
    placed: tuple[Placed, ...]
    prototypes: tuple[Prototype, ...]
    leaves: tuple[type[Scatterer], ...]
    normal_mapped: bool
    warnings: tuple[str, ...]
    motions: Motions
    lit_media: str = UNKNOWN
    lit_before: bool | None = None
    candidates: tuple[Integrator, ...] = ()
    shared: bool = False

    @classmethod
    def of(cls, scene: Scene, shared: bool = False) -> SceneIndex:
        """Return the index of a scene that clpt.render.flow.check accepts.

        shared: whether its programs are to be those of many scenes.

        Raises SceneError for an instance that cannot be placed, and for invalid custom materials.
        """
        warnings: list[str] = []
        motions = Motions.of(scene)
        placed, prototypes = instancing.sort(scene.shapes, warnings, motions.moving)
        distinct = tuple(instancing.distinct(scene.shapes))
        kinds = _leaf_kinds(distinct)
        bends = any(map(_bends, {id(s.material): s.material for s in distinct}.values()))
        return cls(
            camera=scene.camera,
            film=scene.film,
            integrator=scene.integrator,
            sampler=scene.sampler,
            spp=scene.spp,
            noise=scene.noise,
            seed=scene.seed,
            lights=scene.lights,
            listed=scene.shapes,
            shapes=distinct,
            placed=tuple(placed),
            prototypes=tuple(prototypes),
            leaves=(
                *(usual.leaves(kinds) if shared else kinds),
                *_phase_kinds(_media(scene.camera, distinct), scene.film.mode),
            ),
            normal_mapped=bends or shared,
            warnings=tuple(warnings),
            motions=motions,
            shared=shared,
        )

    @property
    def shining(self) -> tuple[str, ...]:
        """The kinds of leaf materials on shapes that are lights."""
        lights = (shape for shape in self.shapes if shape.emission is not None)
        shining = {cls for shape in lights for cls in leaves_of(shape.material)}
        return tuple(cls.kind for cls in self.leaves if cls in shining)

    @property
    def media(self) -> tuple[Medium, ...]:
        """The media of a scene."""
        return tuple(_media(self.camera, self.shapes))

    @property
    def emitting(self) -> tuple[Medium, ...]:
        """The media that emit light."""
        return tuple(medium for medium in self.media if medium.light is not None)

    @property
    def free_panes(self) -> bool:
        """Whether the scene has thin glass that paths cross without a step."""
        return self.integrator.free_panes and any(cls.is_pane for cls in self.leaves)

    def passes_shadow_rays(self, leaf: type[Scatterer]) -> bool:
        """Whether rays to lights pass a kind of leaf materials."""
        return leaf.is_null or (leaf.is_pane and self.free_panes)

    @property
    def grids(self) -> GridFeatures:
        """Features of the media whose density is on a grid."""
        media, emitting = self.media, self.emitting
        grids = [medium for medium in media if isinstance(medium, Grid)]
        return GridFeatures(
            present=any(medium.lattice is not None for medium in media),
            emissive=any(medium.lattice is not None for medium in emitting),
            hot=any(grid.temperature is not None and grid.light is not None for grid in grids),
            tinted=any(grid.albedo_grid is not None for grid in grids),
            coloured=any(grid.color_grid is not None for grid in grids),
            mixed=max((len(medium.parts) for medium in media if medium.is_mixture), default=0),
            bytes=any(grid.bits == 8 for grid in grids),
        )

    @property
    def dyed(self) -> bool:
        """Whether some medium has a dye that fluoresces."""
        return self.spectral and any(medium.glows for medium in self.media)

    @property
    def nested(self) -> bool:
        """Whether bodies may overlap, of different priorities."""
        return any(shape.priority for shape in self.shapes)

    @property
    def has_media(self) -> bool:
        """Whether rays travel through media, or through bodies that may overlap."""
        return bool(self.media) or self.nested

    @property
    def has_insides(self) -> bool:
        """Whether rays travel through media, or through bodies that overlap or absorb."""
        parts = (part for shape in self.shapes for part in mt.parts(shape.material))
        return self.has_media or any(part.absorbs_inside and not part.is_sheet for part in parts)

    @property
    def light_paths(self) -> bool:
        """Whether paths start at lights."""
        return self.integrator.from_lights_alone

    @property
    def weighed(self) -> float:
        """The number of light paths for each camera sample; 0: no light paths.

        In a scene with the integrator "auto" it is valid after `hard_light.decided`.
        """
        return self.balanced or GHOSTS * self.lit_ghosts

    @property
    def balanced(self) -> float:
        """The number of light paths for each camera sample that share weights (MIS) with it."""
        wanted: Any = self.integrator.light_paths
        return wanted if (self.joined or self.merged) and self.lights_reach else 0

    @property
    def lit_ghosts(self) -> bool:
        """Whether light paths are ghosts of the lens: light that comes directly from lights."""
        camera, integrator, before = self.camera, self.integrator, self.lit_before
        wanted = camera.has_ghosts
        ghosts = camera.traced_lens is not None and (wanted if before is None else before)
        alone = isinstance(integrator, (Path, Direct)) and not integrator.guiding
        return ghosts and alone and not self.light_layers and not self.emitting

    @property
    def samples(self) -> int:
        """The number of samples of the whole film."""
        return self.spp * self.film.width * self.film.height

    @property
    def lights_reach(self) -> bool:
        """Whether paths can start at lights: the medium around each light is known."""
        return not self.has_media or not self.lit_media

    @property
    def may_have_light_paths(self) -> bool:
        """Whether the integrator starts paths at lights where `lights_reach`."""
        integrator = self.integrator
        beside = bool(integrator.light_paths) or integrator.guiding
        return integrator.from_lights_alone or integrator.leaves_choice or beside

    @property
    def joined(self) -> bool:
        """Whether light paths are connected to the camera."""
        return self.integrator.light_tracing and self.camera.is_connected(self.mode)

    @property
    def merged(self) -> bool:
        """Whether light paths store photons, which camera paths gather."""
        integrator = self.integrator
        possible = not self.shifts and self.lights_reach and integrator.max_depth not in (1, 2)
        return integrator.merging and possible

    @property
    def guided(self) -> bool:
        """Whether a guide for camera paths is trained by light paths."""
        return self.integrator.guiding and not self.weighed and self.lights_reach

    @property
    def reused(self) -> bool:
        """Whether pixels close to each other may share second vertices of their paths.

        They do not where wavelengths part, which the features of the scene tell.
        """
        return self.integrator.reuse and self.can_reuse and not self.weighed

    @property
    def can_reuse(self) -> bool:
        """Whether nothing tells apart the paths of pixels: no medium, time, or group of light.

        All pixels have as many samples then.
        """
        depth = self.integrator.max_depth
        apart = self.motions or self.has_insides or self.shifts or self.shared
        return not (apart or self.light_layers or self.adaptive or 0 <= depth < 3)

    @property
    def shifts(self) -> bool:
        """Whether some material fluoresces."""
        return self.spectral and any(cls.fluoresces for cls in self.leaves)

    @property
    def layers(self) -> tuple[str, ...]:
        """The layers of the film, in the order of LAYERS."""
        return tuple(name for name in LAYERS if name in self.film.layers)

    @property
    def light_layers(self) -> bool:
        """Whether the film has layers of light, or sorts it by time."""
        return self.timed or any(LAYERS[name].form == "light" for name in self.layers)

    @property
    def timed(self) -> bool:
        """Whether the film sorts light by time."""
        return self.film.time_bins > 0

    @property
    def splatting(self) -> bool:
        """Whether a sample adds to all pixels within the filter's reach, not only to its pixel."""
        film = self.film
        wanted = film.filtering != "importance" and self.noise is None
        wanted = wanted and not self.light_layers
        reaches = film.filter.reach > 0 and wanted
        return reaches or self.light_paths

    @property
    def spread(self) -> tuple[int, int]:
        """The filter along an axis [pixels]: number of pixels that a sample adds to, and reach."""
        return self.film.filter.taps, self.film.filter.reach

    @property
    def filter_taps(self) -> int:
        """The number of pixels along an axis that a sample adds to; 0 without splatting."""
        return self.spread[0] if self.splatting else 0

    @property
    def filter_reach(self) -> int:
        """The distance along an axis to the farthest pixel that a sample adds to [pixels].

        It is 0 without splatting.
        """
        return self.spread[1] if self.splatting else 0

    @property
    def adaptive(self) -> bool:
        """Whether noisy pixels get more samples."""
        return self.noise is not None

    @property
    def mode(self) -> str:
        """The mode of the kernels."""
        return self.film.mode

    @property
    def spectral(self) -> bool:
        return self.mode == "spectral"


def any_of(material: mt.Material, classes: type | tuple[type, ...]) -> bool:
    """Return whether a material, or a part of it, is of these classes."""
    return any(isinstance(part, classes) for part in mt.parts(material))


def _bends(material: mt.Material) -> bool:
    """Whether a material has a normal or bump map, or directions along a second set of uv."""
    parts = mt.parts(material)
    return any(isinstance(p, mt.NormalMapped) or any(map(turned, p.directing)) for p in parts)


def _leaf_kinds(shapes_: tuple[Shape, ...]) -> tuple[type[mt.Material], ...]:
    """The leaf kinds of a scene, in the order of their table; custom kinds follow."""
    kinds: dict[type[mt.Material], str] = {}
    for shape in shapes_:
        for leaf in leaves_of(shape.material):
            if leaf not in kinds:
                kinds[leaf] = shapes.where(shape)
    if any(shape.priority for shape in shapes_):
        kinds.setdefault(mt.Null, "")  # a surface within a body of higher priority
    return materials.ordered(kinds) or (mt.Diffuse,)


def _media(camera: Camera, shapes_: tuple[Shape, ...]) -> list[Medium]:
    """The media of a scene, each once."""
    media = [m for shape in shapes_ for m in (shape.interior, shape.exterior)]
    return list(dict.fromkeys(m for m in (camera.medium, *media) if m is not None))


def _phase_kinds(media: Iterable[Medium], mode: str) -> tuple[type[Scatterer], ...]:
    """The kinds of phase functions of media, in the order of their table."""
    scattering = (medium for medium in media if medium.scatters)
    phases = (phase for medium in scattering for phase in medium.collisions(mode == "spectral"))
    kinds = {type(leaf) for phase in phases for leaf in phase.leaves}
    return tuple(cls for cls in LEAVES if cls in kinds)


def leaves_of(material: mt.Material) -> Iterator[type[mt.Material]]:
    """Yield the kinds of leaf materials on a shape with this material."""
    for part in mt.parts(material):
        if isinstance(part, mt.Mask) or part.no_back:
            yield mt.Null
        if not part.is_composite:
            yield type(part)
    if not material.two_sided and any(part.two_sided for part in mt.parts(material)):
        yield mt.Diffuse  # the black back of a part that is not two-sided
