"""Features: what a lowered scene needs of the kernels. They alone decide the kernels' text."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from clpt.render.contract.texture_records import MIPS
from clpt.scene.layers import LAYERS, WORDS, Form
from clpt.scene.params import device_params
from clpt.scene.scatterer import Scatterer

Sources = frozenset[tuple[str, str, str]]

SUM_WORDS = 3  # kernels/core/fixed.cl
GROUP_WORDS = 3 * SUM_WORDS + 1  # of a pixel: three sums and a count, see kernels/film/film.cl


def disperses(leaves: Iterable[type[Scatterer]], sources: Sources) -> bool:
    """Whether the direction of light depends on its wavelength at some material."""
    indices = (
        (cls.kind, name, "table")
        for cls in leaves
        if cls.refracts
        for name, param in device_params(cls).items()
        if param.role == "index"
    )
    return any(cls.disperses for cls in leaves) or not sources.isdisjoint(indices)


def layer_places(names: Iterable[str]) -> dict[str, int]:
    """Return the first of a pixel's words for each layer of the first samples, after their number;
    those for denoisers come last."""
    places, word = {}, 1
    for name in names:
        if LAYERS[name].form in WORDS:
            places[name] = word
            word += LAYERS[name].words
    return places


@dataclass(frozen=True)
class Features:
    """What occurs in a scene.

    leaves: classes of leaf materials in their order, then of phase functions: a material word's
    upper bits count in it;
    lights: device kinds of lights (see clpt.render.contract.light_records); textures,
    texture_roles: kinds and (kind, role) pairs; analytic: kinds of shapes that rays meet as they
    are; sources: (kind, parameter, source) of all that is loaded, see
    clpt.render.codegen.parameters.
    """

    mode: str
    camera: str
    sampler: str
    filter: str
    filter_taps: int  # pixels of an axis that light may serve; 0: a sample serves its own
    filter_reach: int  # how far these are from its own
    integrator: str
    leaves: tuple[type[Scatterer], ...]
    transmitting: tuple[str, ...] = ()  # kinds of leaves of which some let light through
    shining: tuple[str, ...] = ()  # kinds of leaves on shapes that are lights
    lights: tuple[str, ...] = ()
    textures: tuple[str, ...] = ()
    texture_roles: tuple[tuple[str, str], ...] = ()
    texture_mappings: bool = False  # some texture makes uv of the place
    texture_depth: int = 0  # how many values their programs stack
    analytic: tuple[str, ...] = ()
    instances: bool = False
    only_instances: bool = False  # all triangles are of groups
    few_instances: int = 0  # how many, if a ray goes to each without a tree
    normals: bool = False
    uvs: bool = False
    tangents: bool = False
    vertex_tangents: int = 0  # where in `distributions` those lie that meshes say; 0: none does
    attributes: bool = False  # some texture reads what meshes say per vertex or face
    mixtures: int = 0  # how deep masks and blends nest
    normal_mapped: bool = False  # some material has a normal or a bump map
    null_surfaces: bool = False  # some surface lets light through as if it were not there
    free_panes: bool = False  # thin glass does, where light goes straight through; among them
    infinite: bool = False
    light_paths: bool = False  # paths start at lights
    weighed: bool = False  # light paths have sums of the film beside those of the camera's paths
    joined: bool = False  # those are joined to the camera
    merged: bool = False  # those leave photons, which paths from the camera gather
    guided: bool = False  # directions of the camera's paths are learned
    aimed: bool = False  # some of these start toward what is sharp
    light_filter: tuple[int, int, int] = (0, 0, 0)  # of those: taps, reach and profile
    film_group: int = 0  # words of a pixel before those that paths add to
    visible_lights: bool = False  # some light is no delta light: a camera may see it
    two_sided_lights: bool = False  # some shape emits from its back too
    light_tree: bool = False  # a tree chooses among the lights
    many_lights: bool = False  # too many to be chosen by the number that also places the point
    dispersion: bool = False
    absorption: bool = False  # inside of a dielectric
    media: bool = False  # inside or outside of shapes, or around the camera
    chromatic_media: bool = False  # of which some extinction depends on the wavelength
    emissive_media: bool = False  # of which some give out light
    emissive_grids: bool = False  # of these some have a density on a grid
    hot_grids: bool = False  # of these some have a temperature
    medium_aims: int = 0  # places of lamps near which flights through media end
    sealed_media: bool = False  # which no ray to a light can leave
    grids: bool = False  # of which some have a density on a grid
    tinted_grids: bool = False  # of these some have an albedo on a grid
    dyed_media: bool = False  # of media some have a dye that gives out light
    coloured_grids: bool = False  # of these some have colours of their extinction on a grid
    mixed_grids: int = 0  # parts of that of these which is made of most
    byte_grids: bool = False  # of these some have 8 bits for each number
    bodies: bool = False  # that may overlap, of different priorities
    moving: tuple[str, ...] = ()  # while the shutter is open: "camera", "instances", ...
    motion_scales: bool = False  # some of it scales
    motion_row: int = 0  # where in `distributions` its table begins
    glass_lens: bool = False  # of a glass that disperses
    lens_losses: bool = False  # surfaces of the camera's lens reflect a part of the light
    lens_ghosts: bool = False  # and samples follow it
    lit_ghosts: bool = False  # light paths are these ghosts, and no more
    bands: bool = False  # a spectral film
    alpha: bool = False  # a film that tells what is covered
    layers: tuple[str, ...] = ()  # beside the picture
    material_numbers: int = 0  # where in `distributions` that of each row of `shapes` stands
    light_groups: int = 0  # of lights, where there is a layer for each
    light_group_row: int = 0  # where in `distributions` the group of each light stands
    tabulated_density: bool = False  # of wavelengths
    filter_profile: int = 0  # where in `distributions` its values begin
    spectra_size: int = 0
    spectra_step: float = 1.0
    sources: Sources = frozenset()

    @property
    def mips(self) -> bool:
        """Whether some image has smaller copies, which the cones around rays choose."""
        return not MIPS.keys().isdisjoint(self.textures)

    @property
    def film_weights(self) -> bool:
        """Whether samples serve several pixels, whose sums are then divided by their weights."""
        return self.filter_reach > 0 and not self.light_paths

    @property
    def shadow_media(self) -> bool:
        """Whether rays to lights may go through several media."""
        return self.media and (self.null_surfaces or self.grids)

    @property
    def light_media(self) -> bool:
        """Whether media are known around lights, as paths start there."""
        return self.media and (self.light_paths or self.weighed) and not self.lit_ghosts

    @property
    def balanced(self) -> bool:
        """Whether paths from the camera are weighed against these light paths."""
        return self.weighed and not self.lit_ghosts

    @property
    def passes(self) -> tuple[Features, ...]:
        """The features of each kind of paths, in their order; those of the film are the last."""
        if self.guided:
            return self._from_lights(), self
        if not self.weighed:
            return (self,)
        taps, reach, profile = self.light_filter
        from_lights = replace(
            self._from_lights(),
            filter_taps=taps,
            filter_reach=reach,
            filter_profile=profile,
            film_group=self.group_words,
            layers=self.light_layers,
            light_groups=self.light_groups,
            light_group_row=self.light_group_row,
        )
        return from_lights, self

    def _from_lights(self) -> Features:
        """The features of paths that start at lights beside those of the camera."""
        return replace(
            self, integrator="particle_tracer", light_paths=True, alpha=False, layers=(),
            light_groups=0, material_numbers=0, light_group_row=0,
        )  # fmt: skip

    @property
    def shows_lights(self) -> bool:
        """Whether paths that start at lights join these to the camera."""
        return self.joined and self.light_paths and self.visible_lights and not self.weighed

    @property
    def group_words(self) -> int:
        """Words of a pixel that paths add to."""
        return GROUP_WORDS + SUM_WORDS * (self.film_weights + self.alpha)

    @property
    def film_groups(self) -> int:
        """Groups of sums of a pixel: of all paths, or of the camera's paths and of light paths."""
        return 1 + self.weighed

    @property
    def film_words(self) -> int:
        """Words of a pixel of the film: of all its groups."""
        beside = GROUP_WORDS if self.weighed and not self.light_paths else 0
        return self.film_group + self.group_words + beside

    @property
    def footprint_words(self) -> int:
        """Words of what a slot sums around its pixel, see kernels/film/splatting.cl."""
        side = 2 * self.filter_reach + 1
        return side * side * 8 * (1 + self.alpha) if self.film_weights else 0

    @property
    def layer_places(self) -> dict[str, int]:
        """The first word of each layer of the first samples."""
        return layer_places(self.layers)

    @property
    def layer_words(self) -> int:
        """Words of a pixel that these have, with the number of samples, which mattes need too."""
        if not self.layer_places and not self.mattes:
            return 0
        return 1 + sum(LAYERS[name].words for name in self.layers)

    @property
    def screen_motion(self) -> bool:
        """Whether a layer tells how what is seen moves across the film, and anything may."""
        return "motion" in self.layers and bool(self.moving)

    @property
    def mattes(self) -> tuple[str, ...]:
        """The layers that are lists of names."""
        return self._layers_of("matte")

    @property
    def light_layers(self) -> tuple[str, ...]:
        """The layers of light; `light_groups`, which comes last, is a picture for each group."""
        return self._layers_of("light")

    @property
    def light_pictures(self) -> int:
        """How many pictures of light there are beside the picture, of each group of sums."""
        groups = self.light_groups if "light_groups" in self.light_layers else 1
        return len(self.light_layers) - 1 + groups if self.light_layers else 0

    def _layers_of(self, form: Form) -> tuple[str, ...]:
        return tuple(name for name in self.layers if LAYERS[name].form == form)

    @property
    def materials(self) -> tuple[str, ...]:
        """Names of the leaf materials, in their order."""
        return tuple(cls.kind for cls in self.leaves)

    def sources_of(self, kind: str) -> dict[str, frozenset[str]]:
        """Return the sources of each parameter of a kind that has some."""
        found: dict[str, frozenset[str]] = {}
        for owner, name, source in self.sources:
            if owner == kind:
                found[name] = found.get(name, frozenset()) | {source}
        return found
