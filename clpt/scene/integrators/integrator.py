"""Integrators, which follow light, and samplers, the sources of their random numbers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar

from clpt.arrays import is_number, is_whole, plain, whole
from clpt.choices import AUTO, MOST_LIGHT_PATHS
from clpt.errors import SceneError
from clpt.scene.params import Kind, emission, fields_of, flag, host, real
from clpt.scene.values import SpectrumLike

FEWEST_LIGHT_PATHS = 1.0 / 64
MOST_GUIDE_PATHS = 1 << 24  # sums of their contributions have 32 bits
DEEPEST = 4000  # path state has 12 bits for the depth
MOST_GROUPS = 64  # of wavelengths
MOST_PHOTON_MEMORY = 8192  # [MiB]; words of photons are numbered by 31 bits


@dataclass(frozen=True, kw_only=True, eq=False)
class Integrator(Kind):
    """Base of all integrators, with values for kinds that lack a parameter."""

    max_depth = -1
    rr_depth = DEEPEST
    hide_lights = False
    free_panes = False
    guiding = False
    guide_paths = 0
    reuse = False
    light_tracing = True
    merging = False
    aimed = 0.7  # share of the light paths that start toward specular surfaces
    has_photons: ClassVar[bool] = False  # a pass may leave photons: no variance tells their blur
    from_lights_alone: ClassVar[bool] = False  # all paths start at lights
    asks_photons: ClassVar[bool] = False  # the scene may decide for photons too
    has_escape_rays: ClassVar[bool] = False  # out of sealed media, see kernels/media/escape.cl

    @property
    def light_paths(self) -> float | str:
        """Paths from lights for each sample of the camera, weighed against it."""
        return 0

    @property
    def leaves_choice(self) -> bool:
        """Whether the scene decides if paths start at lights."""
        return self.light_paths == AUTO

    def for_denoiser(self) -> Integrator:
        """Return the integrator that replaces this integrator if the picture is denoised."""
        return self

    @property
    def ambient(self) -> SpectrumLike | None:
        """The radiance that reaches every surface; None: there is none."""
        return None

    def check(self) -> None:
        for name, depth in (("max_depth", self.max_depth), ("rr_depth", self.rr_depth)):
            unlimited = name == "max_depth" and depth == -1
            if not is_whole(depth) or (depth < 1 and not unlimited):
                least = "1 or more, or -1 for no limit" if name == "max_depth" else "1 or more"
                raise SceneError(f"must be {least}, not {depth!r}", where=f"{self.kind}.{name}")


LIGHT_FINDING = {
    "light_paths",
    "aimed",
    "guiding",
    "guide_paths",
    "reuse",
}  # parameters of how light is found
LONG = 64  # least depth of paths where panes of thin glass on the way do not matter


def is_long(max_depth: int) -> bool:
    """Return whether paths are so long that it does not matter whether panes of glass count.

    Other renderers count them. Light of so many bounces is below a thousandth of the picture.
    """
    return max_depth == -1 or max_depth >= LONG


@dataclass(frozen=True, kw_only=True, eq=False)
class Path(Integrator):
    """Path tracing with next-event estimation and multiple importance sampling (power heuristic).

    `max_depth` counts surfaces and the light: 1 shows only lights, 2 adds direct light.

    With `light_paths` some paths start at lights. Each vertex of them is connected to the camera,
    with a weight (MIS). So caustics converge that the camera sees directly. The camera must be
    `perspective`, `thin_lens` or `calibrated`. A number below 1 is a share: with 0.5 every second
    sample has a light path. "auto" starts light paths if a surface is specular and a light is
    small.
    """

    has_escape_rays = True

    max_depth: int = host(8, "longest path; -1: no limit")
    rr_depth: int = host(3, "depth from which Russian roulette may end a path")
    hide_lights: bool = flag(False, "the camera sees through lights, also those on shapes")
    light_paths: float | str = host(
        AUTO,
        "paths from lights for each sample, weighed against it; 0: none; auto: as suits the scene",
        form="number_or_auto",
    )
    aimed: float = real(
        0.7,
        "share of the light paths that start toward specular surfaces, for caustics; above a half "
        "the others mostly end at diffuse surfaces; light_paths auto chooses it, too",
        low=0.0,
        high=0.95,
    )
    free_panes: bool = flag(
        True, "thin glass is as a null surface where light goes straight through it: no depth"
    )
    guiding: bool = host(
        False, "directions are learned from light paths before the first sample; without others"
    )
    guide_paths: int = host(0, "light paths from which `guiding` learns; 0: a million")
    reuse: bool = host(
        False,
        "pixels close to each other share the second surfaces of their paths; without light paths",
    )

    def for_denoiser(self) -> Integrator:
        """Return `path` without reuse, which makes the noise of pixels alike."""
        return replace(self, reuse=False) if self.reuse else self

    def check(self) -> None:
        super().check()
        light_paths: Any = plain(self.light_paths)
        object.__setattr__(self, "light_paths", light_paths)
        if self.guiding and light_paths not in (0, AUTO):
            message = "guiding is for paths from the camera alone: ask for no light_paths"
            raise SceneError(message, where=f"{self.kind}.guiding")
        if self.reuse and (self.guiding or light_paths not in (0, AUTO)):
            message = "paths are reused without light_paths and guiding: ask for one of these"
            raise SceneError(message, where=f"{self.kind}.reuse")
        whole(self.guide_paths, 0, MOST_GUIDE_PATHS, where=f"{self.kind}.guide_paths")
        if isinstance(light_paths, str) and light_paths == AUTO:
            return
        if not is_number(light_paths) or not (
            light_paths == 0 or FEWEST_LIGHT_PATHS <= light_paths <= MOST_LIGHT_PATHS
        ):
            fewest = f"{FEWEST_LIGHT_PATHS:g}"
            message = f"must be 0, {fewest} to {MOST_LIGHT_PATHS}, or {AUTO!r}, not {light_paths!r}"
            raise SceneError(message, where=f"{self.kind}.light_paths")


@dataclass(frozen=True, kw_only=True, eq=False)
class Vcm(Integrator):
    """`path` with light paths and photons: vertex connection and merging (Georgiev 2012).

    A pass is a sample of every pixel. A light path that has met a specular surface leaves photons
    on later surfaces. Paths from the camera gather the photons of their pass in a radius around
    their vertices. So caustics converge in mirrors and behind glass, also those of points and suns.
    In homogeneous media photons are gathered along rays (Krivanek 2014). The radius blurs the
    gathered light, and shrinks from pass to pass. A `max_depth` of -1 or beyond 65 counts as 65.
    """

    has_photons = True

    max_depth: int = host(8, "longest path, as of `path`; -1: 65")
    rr_depth: int = host(3, "depth from which Russian roulette may end a path")
    hide_lights: bool = flag(False, "the camera sees through lights, also those on shapes")
    free_panes: bool = flag(True, "as of `path`")
    light_paths: int = host(1, "paths from lights for each sample of the camera")
    light_tracing: bool = host(True, "light paths are joined to the camera")
    merging: bool = host(True, "photons are gathered")
    radius: float = real(0.0, "of the disk of the first pass; 0: as suits the picture", "m", 0.0)
    wavelength_groups: int = host(
        0, "of paths that have the same wavelengths in a pass; 0: as suits the scene"
    )
    photon_memory: int = host(256, "most that photons take", "MiB")

    def check(self) -> None:
        super().check()
        for name, value, least, most in (
            ("light_paths", self.light_paths, 1, MOST_LIGHT_PATHS),
            ("wavelength_groups", self.wavelength_groups, 0, MOST_GROUPS),
            ("photon_memory", self.photon_memory, 1, MOST_PHOTON_MEMORY),
        ):
            whole(value, least, most, where=f"{self.kind}.{name}")


@dataclass(frozen=True, kw_only=True, eq=False)
class Auto(Integrator):
    """The integrator that suits the scene: `path`, `path` with light paths, or `vcm`.

    It uses light paths if a surface is specular and a light is small. It also uses photons if the
    camera sees mirrors or clear glass, and the scene has no limit of noise and no denoiser.
    """

    asks_photons = True

    max_depth: int = host(8, "longest path, as of `path`; -1: no limit")
    rr_depth: int = host(3, "depth from which Russian roulette may end a path")
    hide_lights: bool = flag(False, "the camera sees through lights, also those on shapes")
    free_panes: bool = flag(True, "as of `path`")

    @property
    def leaves_choice(self) -> bool:
        """It always does."""
        return True

    def for_denoiser(self) -> Integrator:
        """Return `path`, which has light paths as `auto` has: noise of photons is blotchy."""
        return Path(**shared(self, Path()))


def shared(integrator: Integrator, other: Integrator) -> dict[str, Any]:
    """Return the parameters that two integrators share, except LIGHT_FINDING."""
    known = fields_of(other).keys() - LIGHT_FINDING
    return {name: value for name, value in fields_of(integrator).items() if name in known}


@dataclass(frozen=True, kw_only=True, eq=False)
class Direct(Integrator):
    """Direct light only: `path` with a depth of 2."""

    max_depth = 2

    hide_lights: bool = flag(False, "the camera sees through lights, also those on shapes")


@dataclass(frozen=True, kw_only=True, eq=False)
class Whitted(Integrator):
    """The classic ray tracer (Whitted 1980): ambient, diffuse, highlight, hard shadows, mirrors."""

    max_depth: int = host(5, "most mirror reflections and the first hit")
    ambient: SpectrumLike = emission(
        0.05, "radiance that reaches every surface", "W m^-2 sr^-1 nm^-1"
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class ParticleTracer(Integrator):
    """Light tracing: paths start at lights, and every vertex is connected to the camera.

    It finds caustics, also of the smallest lights. Mirrors and smooth glass are black. A sample per
    pixel is a light path for every pixel of the film. The camera must be `perspective`,
    `thin_lens` or `calibrated`.
    """

    from_lights_alone = True

    max_depth: int = host(8, "longest path, as of `path`; -1: no limit")
    rr_depth: int = host(3, "depth from which Russian roulette may end a path")
    hide_lights: bool = flag(False, "lights shine, but are not seen to shine")
    free_panes: bool = flag(True, "as of `path`")


@dataclass(frozen=True, kw_only=True, eq=False)
class Sampler(Kind):
    """Base of all samplers: each number is a function of (seed, pixel, sample, dimension).

    rate: the variance of a mean of n samples falls about as n^-rate. octaves: the variance that
    samples of even and of odd octaves estimate (kernels/film/film.cl), over the true variance. If
    the variance falls as n^-p, the ratio is (2^p - 1) / (2 - 2^(p - 1)), here with p = 1.1.
    """

    rate = 1.05
    octaves = 1.22


@dataclass(frozen=True, kw_only=True, eq=False)
class Sobol(Sampler):
    """Owen-scrambled points, four dimensions at a time, in pairs as Sobol's (Ahmed 2025)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Zsobol(Sampler):
    """A single Sobol sequence for all pixels, so that the remaining noise is fine-grained.

    The errors of neighbouring pixels have opposite signs (Ahmed and Wonka 2020), best at the
    scene's `spp`. The error of a single pixel is that of `sobol`.
    """


@dataclass(frozen=True, kw_only=True, eq=False)
class Independent(Sampler):
    """Uniform random numbers."""

    rate = 1.0
    octaves = 1.0
