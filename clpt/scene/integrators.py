"""Integrators, samplers, filters and the film: how a scene becomes a picture."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from clpt import arrays
from clpt.arrays import Floats, is_number, is_whole, plain, whole, wholes
from clpt.choices import AUTO, MOST_LIGHT_PATHS
from clpt.errors import SceneError, UnknownKindError
from clpt.scene import roles
from clpt.scene.layers import LAYERS
from clpt.scene.params import Kind, Shorthand, choice, emission, fields_of, flag, host, real
from clpt.scene.roles import Param
from clpt.scene.values import SpectrumLike
from clpt.spectra import Sensor, illuminants, spaces
from clpt.spectra.sensors import OBSERVERS
from clpt.spectra.spaces import TEMPERATURES
from clpt.spectra.spectrum import LONGEST, SHORTEST

MOST_BANDS = 1024
GAUSSIAN_CUT = 4.0  # radius of a Gaussian without `radius` [standard deviations]
FEWEST_LIGHT_PATHS = 1.0 / 64
MOST_GUIDE_PATHS = 1 << 24  # sums of their contributions have 32 bits
DEEPEST = 4000  # path state has 12 bits for the depth
MOST_GROUPS = 64  # of wavelengths
MOST_PHOTON_MEMORY = 8192  # [MiB]; words of photons are numbered by 31 bits
NARROWEST = 0.01  # [nm], a range of wavelengths


@dataclass(frozen=True, kw_only=True, eq=False)
class Integrator(Kind):
    """Base of all integrators, with values for kinds that lack a parameter."""

    max_depth = -1
    rr_depth = DEEPEST
    hide_lights = False
    free_panes = False
    guiding = False
    guide_paths = 0
    light_tracing = True
    merging = False
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


LIGHT_FINDING = {"light_paths", "guiding", "guide_paths"}  # parameters of how light is found
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
    `perspective` or `thin_lens`. A number below 1 is a share: with 0.5 every second sample has a
    light path. "auto" starts light paths if a surface is specular and a light is small.
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
    free_panes: bool = flag(
        True, "thin glass is as a null surface where light goes straight through it: no depth"
    )
    guiding: bool = host(
        False, "directions are learned from light paths before the first sample; without others"
    )
    guide_paths: int = host(0, "light paths from which `guiding` learns; 0: a million")

    def check(self) -> None:
        super().check()
        light_paths: Any = plain(self.light_paths)
        object.__setattr__(self, "light_paths", light_paths)
        if self.guiding and light_paths not in (0, AUTO):
            message = "guiding is for paths from the camera alone: ask for no light_paths"
            raise SceneError(message, where=f"{self.kind}.guiding")
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
    pixel is a light path for every pixel of the film. The camera must be `perspective` or
    `thin_lens`.
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


@dataclass(frozen=True, kw_only=True, eq=False)
class Filter(Kind):
    """Base of the pixel filters; see `Film.filtering` for how samples meet them.

    A filter is the product of a function of x and the same function of y. Definitions are Mitsuba
    3's, so that equal names give equal images.
    """

    is_constant: ClassVar[bool] = False

    if TYPE_CHECKING:
        radius: float

    @property
    def half_width(self) -> float:
        """The distance from its centre to its end [pixels]."""
        return self.radius

    @property
    def reach(self) -> int:
        """The number of pixels beside its own that a sample may serve, to each side of an axis."""
        return max(math.ceil(self.half_width - 0.5), 0)

    @property
    def taps(self) -> int:
        """The largest number of pixels of an axis whose filters hold a point."""
        return math.ceil(2.0 * self.half_width)

    def profile(self, distances: Floats) -> Floats:
        """Return its values (n,), not normalised, at distances within `half_width` [pixels]."""
        raise NotImplementedError

    def value(self, distance: ArrayLike) -> Floats:
        """Return its values at signed distances from the centre [pixels], not normalised."""
        x = np.abs(np.asarray(distance, np.float64))
        inside = x <= self.half_width
        return np.where(inside, self.profile(np.where(inside, x, 0.0)), 0.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class Box(Filter):
    """Constant over the pixel."""

    is_constant: ClassVar[bool] = True

    radius: float = real(0.5, "half width", "pixels", 0.01, 16.0)

    def profile(self, distances: Floats) -> Floats:
        """Return 1 everywhere."""
        return np.ones_like(distances)


@dataclass(frozen=True, kw_only=True, eq=False)
class Tent(Filter):
    """Linear fall to zero at the radius."""

    radius: float = real(1.0, "half width", "pixels", 0.01, 16.0)

    def profile(self, distances: Floats) -> Floats:
        """Return a line from 1 to 0."""
        return 1.0 - distances / self.radius


@dataclass(frozen=True, kw_only=True, eq=False)
class Gaussian(Filter):
    """A bell, lowered so that it ends at zero."""

    stddev: float = real(0.5, "standard deviation", "pixels", 0.01, 4.0)
    radius: float = real(0.0, "half width; 0: four standard deviations", "pixels", 0.0, 16.0)

    @property
    def half_width(self) -> float:
        """Its radius, or `GAUSSIAN_CUT` standard deviations [pixels]."""
        return self.radius or GAUSSIAN_CUT * self.stddev

    def profile(self, distances: Floats) -> Floats:
        """Return the bell less its value at the radius: so it ends at zero."""
        end = self.half_width / self.stddev
        return np.exp(-0.5 * (distances / self.stddev) ** 2) - np.exp(-0.5 * end**2)


@dataclass(frozen=True, kw_only=True, eq=False)
class Mitchell(Filter):
    """Mitchell and Netravali 1988, with negative lobes."""

    b: float = real(1 / 3, "blur")
    c: float = real(1 / 3, "ringing")
    radius: float = real(2.0, "half width", "pixels", 0.01, 16.0)

    def profile(self, distances: Floats) -> Floats:
        """Return Mitchell and Netravali 1988 eq. 8."""
        b, c, x = self.b, self.c, distances * (2.0 / self.radius)
        near = (12 - 9 * b - 6 * c) * x**3 + (-18 + 12 * b + 6 * c) * x**2 + (6 - 2 * b)
        far = (-b - 6 * c) * x**3 + (6 * b + 30 * c) * x**2
        far = far + (-12 * b - 48 * c) * x + (8 * b + 24 * c)
        return np.where(x < 1.0, near, far) / 6.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Lanczos(Filter):
    """The sinc function under a window, the main lobe of a wider sinc; with negative lobes."""

    radius: float = real(3.0, "half width", "pixels", 0.01, 16.0)
    lobes: float = real(3.0, "where the window would end", "pixels", 0.01, 16.0)

    def profile(self, distances: Floats) -> Floats:
        """Return a sinc in the main lobe of another that is `lobes` wide (Duchon 1979)."""
        return np.sinc(distances) * np.sinc(distances / self.lobes)


@dataclass(frozen=True, kw_only=True, eq=False)
class BlackmanHarris(Filter):
    """The Blackman-Harris window; radius 1.5."""

    radius: float = real(1.5, "half width", "pixels", 0.01, 16.0)

    def profile(self, distances: Floats) -> Floats:
        """Return the four-term window of Harris 1978, -92 dB."""
        t = np.pi * (distances / self.radius + 1.0)
        return 0.35875 - 0.48829 * np.cos(t) + 0.14128 * np.cos(2 * t) - 0.01168 * np.cos(3 * t)


def _width_and_height(size: tuple[int, int]) -> dict[str, int]:
    numbers = wholes(size, 2)
    if numbers is None:
        raise SceneError(f"must be (width, height), not {size!r}", where="size")
    return {"width": numbers[0], "height": numbers[1]}


@dataclass(frozen=True, kw_only=True, eq=False)
class Film(Kind):
    """The recorded picture: size, mode, wavelengths, filter, and the conversion of light to colour.

    With `bands` the range of wavelengths has so many equal parts, and a pixel holds the mean
    radiance of each part [W m^-2 sr^-1 nm^-1]. `white_balance` makes its illuminant the white of
    `output_space` (Bradford). Without it colours are those of the sensor. `bands` and a `sensor`
    other than cie1931 need the spectral mode.
    """

    shorthands = (
        Shorthand(
            {"size": Param(roles.host("size"), "(width, height)", "pixels")},
            ("width", "height"),
            _width_and_height,
        ),
    )

    width: int = host(768, "pixels")
    height: int = host(576, "pixels")
    crop: tuple[int, int, int, int] | None = host(
        None,
        "part that is rendered: (x, y, width, height), from the upper left",
        "pixels",
        form="crop",
    )
    mode: str = choice("spectral", "what light is made of", ("spectral", "rgb"))
    filter: Filter = host(Box(), "pixel filter", form="filter")
    filtering: str = choice(
        "auto",
        "splatting: a sample counts for all pixels whose filters reach it; importance: for a "
        "single pixel, at a point drawn from the filter; auto: splatting, but importance with "
        "`noise`",
        ("auto", "splatting", "importance"),
    )
    lambda_min: float = real(360.0, "shortest wavelength", "nm", SHORTEST, LONGEST)
    lambda_max: float = real(830.0, "longest wavelength", "nm", SHORTEST, LONGEST)
    wavelengths: str = choice(
        "auto",
        "how they are drawn: as suits the scene, as the eye responds, or as lights and sensor do",
        ("auto", "visible", "scene"),
    )
    sensor: str | Sensor = host(
        "cie1931", "its curves: cie1931, cie1964 or a clpt.spectra.Sensor", form="sensor"
    )
    bands: int = host(0, "of a spectral picture; 0: a picture of three colours")
    white_balance: str | float | tuple[float, float] = host(
        "none",
        "the colour that becomes white: none, an illuminant, a temperature [K], or (x, y)",
        form="white_balance",
    )
    output_space: str = choice("rec709", "colour space of the picture", spaces.SPACES)
    exposure: float = real(1.0, "factor on the picture, of bands too", low=0.0)
    display_exposure: float = real(
        0.0, "brightens pictures for screens; other files keep the light", "stops", -64.0, 64.0
    )
    alpha: bool = host(
        False, "transparent: the camera sees no sky, and a fourth channel holds the coverage"
    )
    layers: tuple[str, ...] = host(
        (), f"beside the picture: any of {', '.join(LAYERS)}", form="names"
    )

    if TYPE_CHECKING:  # an argument, and what is read is the property
        size: tuple[int, int] = (0, 0)
    else:

        @property
        def size(self) -> tuple[int, int]:
            """Width and height of the picture [pixels]."""
            return (self.width, self.height) if self.crop is None else self.crop[2:]

    @property
    def band_centres(self) -> np.ndarray:
        """The wavelengths in the middle of the bands (bands,) float64 [nm]."""
        ends = np.linspace(self.lambda_min, self.lambda_max, self.bands + 1)
        return (ends[1:] + ends[:-1]) / 2.0

    def check(self) -> None:
        for name, size in (("width", self.width), ("height", self.height)):
            whole(size, 1, 65536, where=f"film.{name}")
        if self.crop is not None:
            object.__setattr__(self, "crop", self._checked_crop())
        given_filter: object = self.filter
        if not isinstance(given_filter, Filter):
            message = f"must be of a kind of filter, not {given_filter!r}"
            raise SceneError(message, where="film.filter")
        if self.lambda_min >= self.lambda_max:
            raise SceneError("must be below lambda_max", where="film.lambda_min")
        if self.lambda_max - self.lambda_min < NARROWEST:
            raise SceneError(
                f"must be {NARROWEST:g} nm or more below lambda_max, as wavelengths are float32",
                where="film.lambda_min",
            )
        whole(self.bands, 0, MOST_BANDS, where="film.bands")
        named = isinstance(self.sensor, str) and self.sensor in OBSERVERS
        if not named and not isinstance(self.sensor, Sensor):
            known = f"{', '.join(OBSERVERS)}, nor a Sensor"
            raise SceneError(f"{self.sensor!r} is none of {known}", where="film.sensor")
        object.__setattr__(self, "white_balance", _white_balance(self.white_balance))
        names: str | tuple[str, ...] = self.layers
        object.__setattr__(self, "layers", (names,) if isinstance(names, str) else tuple(names))
        for name in self.layers:
            if name not in LAYERS:
                raise UnknownKindError("layer", str(name), LAYERS, where="film.layers")

    def _checked_crop(self) -> tuple[int, int, int, int]:
        """The crop as whole numbers. Raises SceneError where it does not lie in the film."""
        crop = wholes(self.crop, 4)
        if crop is None:
            raise SceneError(f"must be four whole numbers, not {self.crop!r}", where="film.crop")
        x, y, width, height = crop
        fits = min(x, y) >= 0 and x + width <= self.width and y + height <= self.height
        if not fits or min(width, height) < 1:
            film = f"{self.width}x{self.height}"
            raise SceneError(f"{crop} does not lie in the film of {film}", where="film.crop")
        return x, y, width, height


def _white_balance(value: Any) -> str | float | tuple[float, float]:
    """A name, a temperature [K] or (x, y), checked. Raises SceneError."""
    where = "film.white_balance"
    if isinstance(value, str):
        if value != "none" and value not in illuminants():
            raise UnknownKindError("illuminant", value, ("none", *illuminants()), where=where)
        return value
    if is_number(value):
        coolest, hottest = TEMPERATURES
        if not coolest <= value <= hottest:
            message = f"a colour temperature is {coolest:g} to {hottest:g} K, not {value:g}"
            raise SceneError(message, where=where)
        return float(value)
    try:
        x, y = (arrays.real(value) for value in value)
    except (TypeError, ValueError):
        message = f"must be none, an illuminant, a temperature [K] or (x, y), not {value!r}"
        raise SceneError(message, where=where) from None
    if not (x >= 0.0 and y > 0.0 and x + y <= 1.0):
        raise SceneError(f"({x:g}, {y:g}) is no chromaticity of light", where=where)
    return x, y


NO_AOV = (  # for scenes of former versions
    'the integrator aov is gone: name its channels in "film": {"layers": ["depth", ...]}, and '
    'write "integrator": {"type": "path", "max_depth": 1} where no picture is wanted'
)
KINDS = (Auto, Path, Vcm, Direct, Whitted, ParticleTracer)
HAVE_LAYERS = (Auto, Path, Vcm, Direct)  # beside the picture
SAMPLERS = (Sobol, Zsobol, Independent)
PIXELWISE = (Sobol, Independent)  # samplers whose pixels do not know of each other
FILTERS = (Box, Tent, Gaussian, Mitchell, Lanczos, BlackmanHarris)
