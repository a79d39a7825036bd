"""Features: what a lowered scene needs of the kernels. They alone decide the kernels' text.

There is a record for each subject, with the macro of each field beside it. What follows from
several subjects is a property of `Features`.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

from clpt.render.records.camera import CameraFeatures
from clpt.render.records.film import FilmFeatures, FilterFeatures, LayerFeatures
from clpt.render.records.lights import LightFeatures
from clpt.render.records.macros import flag, macro, number
from clpt.render.records.materials import MaterialFeatures
from clpt.render.records.textures import TextureFeatures
from clpt.scene.layers import LAYERS

__all__ = [
    "GROUP_WORDS",
    "SUM_WORDS",
    "CameraFeatures",
    "Features",
    "FilmFeatures",
    "FilterFeatures",
    "GeometryFeatures",
    "GridFeatures",
    "LayerFeatures",
    "LightFeatures",
    "MaterialFeatures",
    "MediaFeatures",
    "MotionFeatures",
    "SpectraFeatures",
    "TextureFeatures",
    "TransportFeatures",
]

SUM_WORDS = 3  # kernels/core/fixed.cl
GROUP_WORDS = 3 * SUM_WORDS + 1  # of a pixel: three sums and a count, see kernels/film/film.cl


@dataclass(frozen=True)
class GeometryFeatures:
    """The kinds of shapes that rays meet as they are, instances, and what vertices have."""

    analytic: tuple[str, ...] = ()
    instances: bool = flag("USES_INSTANCES")
    only_instances: bool = flag("ONLY_INSTANCES")  # all triangles are of groups
    few_instances: int = flag("FEW_INSTANCES", 0)  # how many, if a ray goes to each without a tree
    normals: bool = False
    uvs: bool = False
    tangents: bool = flag("USES_TANGENTS")
    vertex_tangents: int = flag("VERTEX_TANGENTS", 0)  # where in `distributions` meshes' own lie

    @property
    @macro("USES_ANALYTIC")
    def has_analytic(self) -> bool:
        """Whether rays meet shapes that are no triangles."""
        return bool(self.analytic)


MOST_AIMS = 8  # lamps near which flights end, see kernels/media/equiangular.cl


@dataclass(frozen=True)
class GridFeatures:
    """Media whose density is on a grid."""

    present: bool = False
    emissive: bool = False  # some give out light
    hot: bool = False  # some have a temperature
    tinted: bool = False  # some have an albedo on a grid
    coloured: bool = False  # some have colours of their extinction on a grid
    mixed: int = flag("GRIDS_MIXED", 0)  # most parts of a mixture
    bytes: bool = False  # some have 8 bits for each number


@dataclass(frozen=True)
class MediaFeatures:
    """Media, and bodies whose insides absorb light."""

    absorption: bool = False  # inside of a dielectric
    present: bool = flag("USES_MEDIA")
    chromatic: bool = False  # some extinction depends on the wavelength
    emissive: bool = False  # some give out light
    dyed: bool = False  # some have a dye that gives out light
    sealed: bool = flag("SEALED_MEDIA")  # no ray to a light can leave some
    escapes: bool = False  # rays of their own leave them toward lamps
    bodies: bool = False  # they may overlap, of different priorities
    aims: int = number("MEDIUM_AIMS")  # rows about lamps near which flights through media end
    grids: GridFeatures = GridFeatures()

    @property
    def aim_cones(self) -> bool:
        """Whether some of these lamps shine into a cone; then each has two rows."""
        return self.aims > 0 and self.aims != 1 and self.aims != MOST_AIMS

    @property
    @macro("USES_ABSORPTION")
    def absorbing(self) -> bool:
        """Whether light may be lost on its way."""
        return self.absorption or self.present


NO_PARTS = ("scales", "rolling", "row")  # fields of features of motion that are no parts


@dataclass(frozen=True)
class MotionFeatures:
    """The things that move, and where the table of them is."""

    camera: bool = False
    instances: bool = flag("MOVES_INSTANCES")
    shapes: bool = False  # analytic shapes
    lights: bool = False
    vertices: bool = flag("MOVES_VERTICES")  # have a row for each key
    spheres: bool = flag("MOVES_SPHERES")  # of shapes `spheres` have a row for each key
    emitters: bool = False  # triangles of lights have a row for each key
    scales: bool = flag("MOTION_SCALES")  # some motion scales
    rolling: bool = False  # rows of the film get light one after the other
    row: int | None = number("MOTION_ROW", None)  # where in `distributions` its table begins

    @property
    def parts(self) -> tuple[str, ...]:
        """The names of the parts that move."""
        parts = (field.name for field in fields(self) if field.name not in NO_PARTS)
        return tuple(name for name in parts if vars(self)[name])

    @property
    def present(self) -> bool:
        """Whether anything moves."""
        return bool(self.parts)


@dataclass(frozen=True)
class SpectraFeatures:
    """The mode, and the grid of tabulated spectra."""

    mode: str = "rgb"
    size: int = number("SPECTRA_SIZE")  # values of a spectrum
    step: float = 1.0  # between them [nm]
    tabulated_density: bool = False  # of wavelengths

    @property
    def spectral(self) -> bool:
        """Whether paths have wavelengths."""
        return self.mode == "spectral"

    @property
    @macro("SPECTRA_STEP")
    def step_text(self) -> str:
        """The step in the text of kernels."""
        return f"{self.step}f"


@dataclass(frozen=True)
class TransportFeatures:
    """The integrator, the sampler and the techniques of a single kind of paths."""

    integrator: str = "path"
    sampler: str = "sobol"
    light_paths: bool = flag("LIGHT_PATHS")  # paths start at lights
    weighed: bool = flag("SUMS_LIGHT_PATHS")  # light paths have sums beside the camera's paths'
    joined: bool = flag("JOINS_CAMERA")  # those are joined to the camera
    merged: bool = False  # those leave photons, which paths from the camera gather
    guided: bool = flag("USES_GUIDE")  # directions of the camera's paths are learned
    aimed: int = 0  # light paths that start toward what is sharp: 0 none, 1 some, 2 most
    lit_ghosts: bool = False  # light paths are ghosts of the lens, and no more
    light_filter: tuple[int, int, int] = (0, 0, 0)  # of weighed light paths: taps, reach, profile

    @property
    def balanced(self) -> bool:
        """Whether paths from the camera are weighed against light paths."""
        return self.weighed and not self.lit_ghosts


@dataclass(frozen=True)
class Features:
    """Features of a scene, and of a single kind of its paths, see `passes`."""

    camera: CameraFeatures = CameraFeatures()
    film: FilmFeatures = FilmFeatures()
    transport: TransportFeatures = TransportFeatures()
    lights: LightFeatures = LightFeatures()
    media: MediaFeatures = MediaFeatures()
    motion: MotionFeatures = MotionFeatures()
    geometry: GeometryFeatures = GeometryFeatures()
    textures: TextureFeatures = TextureFeatures()
    spectra: SpectraFeatures = SpectraFeatures()
    materials: MaterialFeatures = MaterialFeatures()

    @property
    def passes(self) -> tuple[Features, ...]:
        """The features of each kind of paths, in their order; those of the film are the last."""
        if self.transport.guided:
            none = LayerFeatures(present=self.film.layers.present)
            return self._from_lights(self.film.filter, none, 0), self
        if not self.transport.weighed:
            return (self,)
        layers = replace(self.film.layers, names=self.film.layers.lights, material_numbers=0)
        light_filter = FilterFeatures(self.film.filter.kind, *self.transport.light_filter)
        return self._from_lights(light_filter, layers, self.group_words), self

    def _from_lights(self, filter_: FilterFeatures, layers: LayerFeatures, first: int) -> Features:
        """The features of light paths beside paths from the camera."""
        film = replace(self.film, filter=filter_, layers=layers, first_word=first, alpha=False)
        transport = replace(self.transport, integrator="particle_tracer", light_paths=True)
        return replace(self, film=film, transport=transport)

    @property
    def mode(self) -> str:
        """The mode of the kernels."""
        return self.spectra.mode

    @property
    def dispersion(self) -> bool:
        """Whether the direction of light depends on its wavelength somewhere."""
        return self.camera.disperses or self.materials.disperses

    @property
    @macro("USES_DISPERSION")
    def told_dispersion(self) -> bool:
        """Whether the direction of light depends on the wavelengths that paths have."""
        return self.dispersion and self.spectra.spectral

    @property
    def grouped(self) -> bool:
        """Whether light by time counts the indices of groups: the delay of pulses."""
        return self.film.layers.time_bins > 0 and self.materials.slopes

    @property
    @macro("USES_RATIO")
    def ratios(self) -> bool:
        """Whether the density of a path differs between its wavelengths."""
        varies = any(map(self.materials.phase_varies, self.materials.leaves))
        of_paths = self.spectra.spectral and (self.dispersion or varies)
        return self.media.chromatic or of_paths

    @property
    def fluorescence(self) -> bool:
        """Whether light may leave some material at another wavelength than it came."""
        return self.spectra.spectral and any(cls.fluoresces for cls in self.materials.leaves)

    @property
    def dull_paths_end(self) -> bool:
        """Whether roulette ends light paths at a first diffuse surface.

        Most other light paths are aimed at specular shapes.
        """
        mostly_aimed = self.transport.aimed > 1
        return mostly_aimed and self.transport.balanced and not self.media.present

    @property
    def hemispheres(self) -> bool:
        """Whether paths keep the hemisphere that their direction was sampled in."""
        weighed_there = self.transport.balanced and self.transport.light_paths
        return self.lights.infinite or self.lights.tree or weighed_there

    @property
    def shows_lights(self) -> bool:
        """Whether paths that start at lights join these to the camera."""
        transport = self.transport
        starts = transport.joined and transport.light_paths and not transport.weighed
        return starts and self.lights.visible

    @property
    def shadow_media(self) -> bool:
        """Whether rays to lights may go through several media."""
        several = self.materials.null_surfaces or self.media.grids.present
        return self.media.present and several

    @property
    def light_media(self) -> bool:
        """Whether media, or bodies that absorb, are known around lights, as paths start there."""
        transport = self.transport
        start = transport.light_paths or transport.weighed or transport.guided
        return self.media.absorbing and start and not transport.lit_ghosts

    @property
    def screen_motion(self) -> bool:
        """Whether there is a layer of motion across the film, and anything moves."""
        return "motion" in self.film.layers.names and self.motion.present

    @property
    def names_surfaces(self) -> bool:
        """Whether some layer asks which surface is seen."""
        forms = {LAYERS[name].form for name in self.film.layers.names}
        return self.screen_motion or not forms.isdisjoint(("id", "matte"))

    @property
    def scouts(self) -> bool:
        """Whether extra paths look for the first surface, where chance decides which it is."""
        chance = self.media.present or self.materials.mixtures or self.materials.free_panes
        return self.film.layers.of_surfaces and bool(chance)

    @property
    @macro("FILM_WEIGHTS")
    def film_weights(self) -> bool:
        """Whether samples serve several pixels, whose sums are then divided by their weights."""
        return self.film.filter.reach > 0 and not self.transport.light_paths

    @property
    def group_words(self) -> int:
        """Words of a pixel that paths add to."""
        return GROUP_WORDS + SUM_WORDS * (self.film_weights + self.film.alpha)

    @property
    def film_groups(self) -> int:
        """Groups of sums of a pixel: of all paths, or of the camera's paths and of light paths."""
        return 1 + self.transport.weighed

    @property
    def film_words(self) -> int:
        """Words of a pixel of the film: of all its groups."""
        beside = self.transport.weighed and not self.transport.light_paths
        return self.film.first_word + self.group_words + GROUP_WORDS * beside

    @property
    @macro("FILM_GROUP", of_number=True)
    def group_begins(self) -> int | None:
        """The first word of a pixel that paths add to, where a film has two groups."""
        return self.film.first_word if self.transport.weighed else None

    @property
    @macro("FILM_WORDS")
    def words_of_groups(self) -> int:
        """Words of a pixel, where a film has two groups."""
        return self.film_words if self.transport.weighed else 0

    @property
    def footprint_words(self) -> int:
        """Words of the sums of a slot around its pixel, see kernels/film/exposure.cl."""
        side = 2 * self.film.filter.reach + 1
        return side * side * 8 * (1 + self.film.alpha) if self.film_weights else 0
