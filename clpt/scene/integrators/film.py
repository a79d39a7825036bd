"""The film and its pixel filters: how samples become a picture."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from clpt import arrays
from clpt.arrays import Floats, is_number, whole, wholes
from clpt.errors import SceneError, UnknownKindError
from clpt.scene import roles
from clpt.scene.layers import LAYERS
from clpt.scene.params import Kind, Shorthand, choice, host, real
from clpt.scene.roles import Param
from clpt.spectra import Sensor, illuminants, spaces
from clpt.spectra.emission import LIGHT
from clpt.spectra.sensors import OBSERVERS
from clpt.spectra.spaces import TEMPERATURES
from clpt.spectra.spectrum import LONGEST, SHORTEST

MOST_BANDS = 1024
MOST_TIME_BINS = 1 << 16
LIGHT_SPEED = LIGHT / 1e9  # [m/ns]
GAUSSIAN_CUT = 4.0  # radius of a Gaussian without `radius` [standard deviations]
NARROWEST = 0.01  # [nm], a range of wavelengths


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

    With `time_bins` light is sorted by its time from the lamp to the film: the range of times has
    so many equal parts, and a pixel holds the light of each part beside the picture.
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
    time_bins: int = host(0, "of light by its time from the lamp to the film; 0: none")
    time_min: float = real(0.0, "where the first of them begins", "ns", 0.0)
    time_max: float = real(100.0, "where the last ends; light goes 0.3 m in 1 ns", "ns", 0.0)
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

    @property
    def time_edges(self) -> np.ndarray:
        """The ends of the bins of time (time_bins + 1,) float64 [ns]."""
        return np.linspace(self.time_min, self.time_max, self.time_bins + 1)

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
        whole(self.time_bins, 0, MOST_TIME_BINS, where="film.time_bins")
        if self.time_bins and not self.time_min < self.time_max < np.inf:
            raise SceneError("must be above time_min, and finite", where="film.time_max")
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
