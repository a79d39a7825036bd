"""The index of a scene: what its steps of lowering ask for, found once."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from clpt.geometry import instancing, shapes
from clpt.geometry.instancing import Placed, Prototype
from clpt.geometry.motion import Motions
from clpt.render.records import GridFeatures, custom_materials
from clpt.scene import Film, Scene
from clpt.scene import materials as mt
from clpt.scene.cameras import Camera
from clpt.scene.integrators import Auto, Direct, Integrator, ParticleTracer, Path, Vcm
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
    """A scene with what is in it.

    shapes: every shape once, those of groups as the group has them; placed: shapes that are lowered
    as they are; prototypes: shapes that instances share; leaves: classes of leaf materials, in the
    order that material words count; normal_mapped: whether a material has a normal or a bump map;
    warnings: of instances that became triangles; motions: what moves; lit_media: why no paths can
    start at some light in a medium, "" if they can; lit_before: whether light paths were ghosts of
    a lens before an edit, whose film has sums for them or none; candidates: integrators between
    which a trial decides, the one that was chosen first; none where there is no trial.
    """

    scene: Scene
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

    @classmethod
    def of(cls, scene: Scene) -> SceneIndex:
        """Look through a scene that clpt.render.flow.check accepts.

        Raises SceneError for an instance that cannot be placed, and for materials of one's own.
        """
        warnings: list[str] = []
        motions = Motions.of(scene)
        placed, prototypes = instancing.sort(scene.shapes, warnings, motions.moving)
        distinct = tuple(instancing.distinct(scene.shapes))
        return cls(
            scene=scene,
            shapes=distinct,
            placed=tuple(placed),
            prototypes=tuple(prototypes),
            leaves=(*_leaf_kinds(distinct), *_phase_kinds(scene, distinct)),
            normal_mapped=any(map(_bends, {id(s.material): s.material for s in distinct}.values())),
            warnings=tuple(warnings),
            motions=motions,
        )

    @property
    def listed(self) -> Sequence[Shape]:
        """The shapes as the scene lists them, instances among them."""
        return self.scene.shapes

    @property
    def shining(self) -> tuple[str, ...]:
        """The kinds of leaves on shapes that are lights."""
        lights = (shape for shape in self.shapes if shape.emission is not None)
        found = {cls for shape in lights for cls in leaves_of(shape.material)}
        return tuple(cls.kind for cls in self.leaves if cls in found)

    @property
    def media(self) -> tuple[Medium, ...]:
        """The media of a scene."""
        return tuple(_media(self.scene, self.shapes))

    @property
    def emitting(self) -> tuple[Medium, ...]:
        """The media that give out light."""
        return tuple(medium for medium in self.media if medium.light is not None)

    @property
    def free_panes(self) -> bool:
        """Whether there is thin glass that is no step of a path."""
        return self.scene.integrator.free_panes and any(cls.is_pane for cls in self.leaves)

    @property
    def grids(self) -> GridFeatures:
        """Features of the media whose density is on a grid."""
        media, emitting = self.media, self.emitting
        grids = [medium for medium in media if isinstance(medium, Grid)]
        return GridFeatures(
            present=any(medium.lattice is not None for medium in media),
            emissive=any(medium.lattice is not None for medium in emitting),
            hot=any(one.temperature is not None for one in emitting if isinstance(one, Grid)),
            tinted=any(one.albedo_grid is not None for one in grids),
            coloured=any(one.color_grid is not None for one in grids),
            mixed=max((len(medium.parts) for medium in media if medium.is_mixture), default=0),
            bytes=any(one.bits == 8 for one in grids),
        )

    @property
    def dyed(self) -> bool:
        """Whether some medium has a dye that gives out light."""
        return self.spectral and any(medium.glows for medium in self.media)

    @property
    def nested(self) -> bool:
        """Whether bodies may overlap, of different priorities."""
        return any(shape.priority for shape in self.shapes)

    @property
    def has_media(self) -> bool:
        """Whether rays go through media, which may be different from the two sides' of a shape."""
        return bool(self.media) or self.nested

    @property
    def light_paths(self) -> bool:
        """Whether paths start at lights."""
        return isinstance(self.scene.integrator, ParticleTracer)

    @property
    def weighed(self) -> float:
        """Light paths for each camera sample; 0: there are none.

        Where the scene says "auto" nothing may ask before `hard_light.decided` has chosen.
        """
        return self.balanced or GHOSTS * self.lit_ghosts

    @property
    def balanced(self) -> float:
        """Light paths for each camera sample that are weighed against it; 0: there are none."""
        wanted: Any = self.scene.integrator.light_paths
        return wanted if (self.joined or self.merged) and self.lights_reach else 0

    @property
    def lit_ghosts(self) -> bool:
        """Whether light paths are ghosts of the lens, of light straight from lights."""
        camera, integrator, before = self.scene.camera, self.scene.integrator, self.lit_before
        wanted = camera.has_ghosts
        ghosts = camera.traced_lens is not None and (wanted if before is None else before)
        alone = isinstance(integrator, (Path, Direct)) and not integrator.guiding
        return ghosts and alone and not self.light_layers and not self.emitting

    @property
    def samples(self) -> int:
        """The samples of the whole film that the scene asks for."""
        return self.spp * self.film.width * self.film.height

    @property
    def lights_reach(self) -> bool:
        """Whether paths can start at lights: they know the light's medium."""
        return not self.has_media or not self.lit_media

    @property
    def may_have_light_paths(self) -> bool:
        """Whether paths start at lights, if they can."""
        given = self.scene.integrator
        wanted = bool(given.light_paths) or given.guiding
        return isinstance(given, Auto | ParticleTracer) or wanted

    @property
    def joined(self) -> bool:
        """Whether paths that start at lights are joined to the camera."""
        if not isinstance(self.scene.integrator, Vcm):
            return self.scene.camera.is_connected(self.mode)
        wanted = self.scene.integrator.light_tracing
        return wanted and self.scene.camera.is_connected(self.mode)

    @property
    def merged(self) -> bool:
        """Whether light paths leave photons, which paths from the camera gather."""
        integrator = self.scene.integrator
        if not isinstance(integrator, Vcm) or self.shifts or not self.lights_reach:
            return False
        return integrator.merging and integrator.max_depth not in (1, 2)

    @property
    def guided(self) -> bool:
        """Whether directions of the camera's paths are learned from light paths."""
        return self.scene.integrator.guiding and not self.weighed and self.lights_reach

    @property
    def shifts(self) -> bool:
        """Whether some material gives light another wavelength."""
        return self.spectral and any(cls.fluoresces for cls in self.leaves)

    @property
    def alpha(self) -> bool:
        """Whether the film tells what is covered."""
        return self.scene.film.alpha

    @property
    def layers(self) -> tuple[str, ...]:
        """The layers that the film has beside the picture, in the order of LAYERS."""
        return tuple(name for name in LAYERS if name in self.scene.film.layers)

    @property
    def light_layers(self) -> bool:
        """Whether the film has layers of light."""
        return any(LAYERS[name].form == "light" for name in self.layers)

    @property
    def splatting(self) -> bool:
        """Whether light serves all pixels whose filters hold it; else a sample serves its own."""
        film = self.scene.film
        wanted = film.filtering != "importance" and self.scene.noise is None
        wanted = wanted and not self.light_layers
        reaches = film.filter.reach > 0 and wanted
        return reaches or self.light_paths

    @property
    def spread(self) -> tuple[int, int]:
        """The spread of light along an axis [pixels]: how many it may serve, and how far away."""
        return self.film.filter.taps, self.film.filter.reach

    @property
    def filter_taps(self) -> int:
        """The number of pixels of an axis that a path's light may serve; 0 without splatting."""
        return self.spread[0] if self.splatting else 0

    @property
    def filter_reach(self) -> int:
        """The distance to the farthest pixel of an axis that a path's light may serve [pixels].

        It is 0 without splatting.
        """
        return self.spread[1] if self.splatting else 0

    @property
    def film(self) -> Film:
        return self.scene.film

    @property
    def camera(self) -> Camera:
        return self.scene.camera

    @property
    def integrator(self) -> Integrator:
        """The integrator that the scene asks for, or what was chosen."""
        return self.scene.integrator

    @property
    def lights(self) -> Sequence[Light]:
        """The lights that are on no shape."""
        return self.scene.lights

    @property
    def spp(self) -> int:
        return self.scene.spp

    @property
    def adaptive(self) -> bool:
        """Whether pixels get more samples where there is noise."""
        return self.scene.noise is not None

    @property
    def mode(self) -> str:
        """The mode of the kernels."""
        return self.scene.film.mode

    @property
    def spectral(self) -> bool:
        return self.mode == "spectral"


def any_of(material: mt.Material, classes: type | tuple[type, ...]) -> bool:
    """Return whether a material, or one inside it, is of these classes."""
    return any(isinstance(part, classes) for part in mt.parts(material))


def _bends(material: mt.Material) -> bool:
    """Whether a material bends normals, or tells directions beside other uv than the main ones."""
    parts = mt.parts(material)
    return any(isinstance(p, mt.NormalMapped) or any(map(turned, p.directing)) for p in parts)


def _leaf_kinds(shapes_: tuple[Shape, ...]) -> tuple[type[mt.Material], ...]:
    """The leaf kinds of a scene, in the order of their table; custom kinds follow."""
    found: dict[type[mt.Material], str] = {}
    for shape in shapes_:
        for leaf in leaves_of(shape.material):
            if leaf not in found:
                found[leaf] = shapes.where(shape)
    if any(shape.priority for shape in shapes_):
        found.setdefault(mt.Null, "")  # a surface within a body of higher priority
    return custom_materials.ordered(found) or (mt.Diffuse,)


def _media(scene: Scene, shapes_: tuple[Shape, ...]) -> list[Medium]:
    """The media of a scene, each once."""
    found = [m for shape in shapes_ for m in (shape.interior, shape.exterior)]
    return list(dict.fromkeys(m for m in (scene.camera.medium, *found) if m is not None))


def _phase_kinds(scene: Scene, shapes_: tuple[Shape, ...]) -> tuple[type[Scatterer], ...]:
    """The kinds of phase functions of a scene, in the order of their table."""
    scattering = (medium for medium in _media(scene, shapes_) if medium.scatters)
    spectral = scene.film.mode == "spectral"
    phases = (phase for medium in scattering for phase in medium.collisions(spectral))
    found = {type(leaf) for phase in phases for leaf in phase.leaves}
    return tuple(cls for cls in LEAVES if cls in found)


def leaves_of(material: mt.Material) -> Iterator[type[mt.Material]]:
    """Return the kinds of leaves that paths may meet where a shape has a material."""
    for part in mt.parts(material):
        if isinstance(part, mt.Mask) or part.no_back:
            yield mt.Null
        if not isinstance(part, mt.COMPOSITES):
            yield type(part)
    if any_of(material, mt.TwoSided) and not isinstance(material, mt.TwoSided):
        yield mt.Diffuse  # the black back of a part that is not two-sided
