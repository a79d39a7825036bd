"""Spectral images: a spectrum in every pixel, and the OpenEXR files that hold them.

The layout is that of Fichet, Pacanowski and Wilkie 2021, "An OpenEXR layout for spectral images"
(JCGT 10(3)), version 1.0: a channel for every wavelength, `T.550,000000nm` of a reflectance or
transmittance, `S0.550,000000nm` of an emission, and R, G, B for whoever knows only these.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from clpt import images
from clpt.arrays import Floats32, in_memory, on_host, single
from clpt.errors import SceneError
from clpt.images import exr, exr_files
from clpt.images.checks import check_there, reading
from clpt.spectra import Tabulated, cie
from clpt.spectra.emission import LIGHT
from clpt.spectra.spectrum import d65

RADIANCE = "W.m^-2.sr^-1.nm^-1"
VERSION = "1.0"
HALF_MAX = 65504.0

PREFIXES = {
    "Y": 1e24, "Z": 1e21, "E": 1e18, "P": 1e15, "T": 1e12, "G": 1e9, "M": 1e6, "k": 1e3, "h": 1e2,
    "da": 1e1, "": 1.0, "d": 1e-1, "c": 1e-2, "m": 1e-3, "u": 1e-6, "n": 1e-9, "p": 1e-12,
}  # fmt: skip

_UNIT = rf"({'|'.join(p for p in PREFIXES if p)})?(m|Hz)"
_NUMBER = r"(\d+[,.]?\d*|[,.]\d+)((?:[Ee][+-]?\d+)?)"
_CHANNEL = re.compile(rf"(S[0-3]|T)\.{_NUMBER.replace('[,.]', ',')}{_UNIT}")
_RERADIATION = re.compile(_CHANNEL.pattern + rf"\.{_NUMBER.replace('[,.]', ',')}{_UNIT}")
_POINT = re.compile(rf"{_NUMBER}{_UNIT}:([-+.\deE]+);?")


@dataclass(frozen=True, eq=False)
class SpectralImage:
    """A spectrum in every pixel, row 0 at the top.

    values: (h, w, n) float32 at `lambdas` (n,) [nm], ascending. emissive: light, in `units`, dark
    beyond the ends; else reflectances or transmittances, which go on beyond the ends as they are
    there. exposure: stops that viewers add, not contained in the values.
    response, transmission: of the camera and the lens that took it. warnings: on further
    contents of the file. Raises SceneError where these do not fit together.
    """

    values: Floats32
    lambdas: NDArray[np.float64]
    emissive: bool = False
    units: str = RADIANCE
    exposure: float = 0.0
    response: Tabulated | None = None
    transmission: Tabulated | None = None
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        values = np.asarray(in_memory(on_host(self.values)))
        if values.dtype.kind != "f":
            raise SceneError(f"a spectral image holds floats, not {values.dtype}")
        values = single(values)
        lambdas = np.asarray(self.lambdas, np.float64)
        if values.ndim != 3 or values.size == 0:
            raise SceneError(f"a spectral image is (h, w, n) and not empty, not {values.shape}")
        if lambdas.shape != values.shape[2:]:
            raise SceneError(
                f"a spectral image of {values.shape[2]} bands needs as many wavelengths, "
                f"not {lambdas.shape}"
            )
        if not (np.isfinite(lambdas) & (lambdas > 0.0)).all() or (np.diff(lambdas) <= 0.0).any():
            raise SceneError("the wavelengths of a spectral image must ascend from above zero")
        object.__setattr__(self, "values", values)
        object.__setattr__(self, "lambdas", lambdas)

    def to_rgb(self) -> Floats32:
        """Linear Rec. 709 (h, w, 3) float32: reflectances under D65, light as it is; unclipped."""
        return self.values @ self._rgb_of_bands.astype(np.float32)

    @cached_property
    def _rgb_of_bands(self) -> NDArray[np.float64]:
        """The colour that each band adds at a value of 1, (n, 3): colour is linear in them."""
        bands = np.eye(len(self.lambdas))
        curves = np.array([self.spectrum(band).sample(cie.GRID) for band in bands])
        light = 1.0 if self.emissive else d65().sample(cie.GRID)
        return cie.xyz_to_rgb(cie.spectrum_to_xyz(curves * light))

    def spectrum(self, values: Iterable[float]) -> Tabulated:
        """The spectrum of a pixel's values (n,), as the renderer reads it."""
        return Tabulated(self.lambdas, values, "zero" if self.emissive else "hold")


def find(image: object, *, emissive: bool, where: str = "image") -> SpectralImage | None:
    """`image` itself if it is spectral, or what is in the file it names; None: it is another image.

    where: it stands, for errors that have no file. Raises SceneError if it holds reflectances where
    an emission is needed, or the reverse.
    """
    if isinstance(image, SpectralImage):
        if image.emissive != emissive:
            raise SceneError(_other_kind(emissive), where=where)
        return image
    if isinstance(image, (str, Path)) and is_spectral(image):
        return read(image, emissive=emissive)
    return None


def is_spectral(path: str | Path) -> bool:
    """Whether this is a readable EXR file with spectral channels."""
    if Path(path).suffix.lower() != ".exr" or not Path(path).is_file():
        return False
    try:
        names = exr_files.channel_names(images.attributes(Path(path)))
    except Exception:  # whoever reads it tells what is wrong
        return False
    return any(map(_is_spectral, names))


def read(path: str | Path, *, emissive: bool | None = None) -> SpectralImage:
    """Read a spectral EXR file.

    path: of the file. emissive: True for light, False for reflectances, where a file holds both;
    None: light if any. Polarisation (S1 to S3) is left out with a warning.

    Raises SceneError for other files, and for a file that lacks the part, or holds a wavelength
    twice, or fluorescence.
    """
    path = Path(path)
    header, channels = _contents(path)
    parts = _parts(path, channels)
    light = "S0" in parts if emissive is None else emissive
    bands = parts.get("S0" if light else "T", [])
    if not bands:
        _fail(path, _other_kind(light))
    for (shorter, first), (longer, second) in itertools.pairwise(bands):
        if shorter == longer:
            _fail(path, f"the channels {first} and {second} are of the same wavelength")
    if len({channels[name].shape for _, name in bands}) > 1:
        _fail(path, "its channels are of different sizes")
    with reading(path):
        return SpectralImage(
            np.stack([channels[name] for _, name in bands], axis=2).astype(np.float32, copy=False),
            np.array([nm for nm, _ in bands]),
            light,
            str(header.get("emissiveUnits", "")) if light else "",
            _exposure(header.get("EV", 0.0)),
            _curve(path, header.get("cameraResponse")),
            _curve(path, header.get("lensTransmission")),
            _left_out(parts, light),
        )


def write(
    path: str | Path,
    image: SpectralImage,
    *,
    half: bool = False,
    preview: Floats32 | None = None,
    metadata: Mapping[str, Any] | None = None,
    layers: Mapping[str, Floats32] | None = None,
) -> None:
    """Write a spectral EXR file; what `read` gives back is the same to the bit unless `half`.

    path: of the file. preview: linear Rec. 709 (h, w, 3) for its R, G, B; the image's own colour,
    with its exposure, by default. metadata: further attributes of the file. layers: further
    channels, name -> (h, w), in float. Raises SceneError if the suffix is not .exr or the file
    cannot be made.
    """
    path = Path(path)
    if path.suffix.lower() != ".exr":
        _fail(path, f"a spectral image is written to .exr, not to {path.suffix!r}")
    if preview is None:
        preview = image.to_rgb() * np.float32(2.0**image.exposure)
    if preview.shape != (*image.values.shape[:2], 3):
        _fail(path, f"the preview is {preview.shape}, the image {image.values.shape}")
    stored = _channels(image, preview, half)
    stored |= {name: np.ascontiguousarray(v, np.float32) for name, v in (layers or {}).items()}
    header = {**(metadata or {}), "spectralLayoutVersion": VERSION, "EV": float(image.exposure)}
    if image.emissive:
        header["emissiveUnits"] = image.units
    for name, curve in (
        ("cameraResponse", image.response), ("lensTransmission", image.transmission),
    ):  # fmt: skip
        if curve is not None:
            points = zip(curve.lambdas, curve.values, strict=True)
            header[name] = "".join(f"{nm!r}nm:{value!r};" for nm, value in points)
    try:
        images.write_channels(path, header, stored)
    except (OSError, RuntimeError, ValueError) as error:
        raise SceneError(f"cannot be written: {error}", file=path) from error


def _channels(image: SpectralImage, preview: Floats32, half: bool) -> dict[str, NDArray[Any]]:
    """Return the preview and the bands by their names in a file."""
    kind, part = (np.float16 if half else np.float32), "S0" if image.emissive else "T"
    channels = dict(zip("RGB", np.moveaxis(preview, 2, 0), strict=True))
    for nm, band in zip(image.lambdas, np.moveaxis(image.values, 2, 0), strict=True):
        channels[f"{part}.{_decimal(nm)}nm"] = band
    if half:
        channels = {name: np.clip(v, -HALF_MAX, HALF_MAX) for name, v in channels.items()}
    return {name: np.ascontiguousarray(values, kind) for name, values in channels.items()}


def _fail(path: Path | None, message: str) -> NoReturn:
    raise SceneError(message, file=path)


def _contents(path: Path) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Attributes and channels of an EXR file, in its display window. Raises SceneError."""
    check_there(path)
    with reading(path):
        header = images.attributes(path)
        names = [n for n in exr_files.channel_names(header) if _is_spectral(n)]
        channels = exr_files.read_channels(path, names)
        return header, {name: exr.placed(channels[name], header) for name in names}


def _is_spectral(name: str) -> bool:
    return bool(_CHANNEL.fullmatch(name) or _RERADIATION.fullmatch(name))


def _parts(path: Path, names: Iterable[str]) -> dict[str, list[tuple[float, str]]]:
    """The spectral channels by part (S0 to S3, T): wavelengths [nm], ascending, and names."""
    parts: dict[str, list[tuple[float, str]]] = {}
    for name in names:
        if _RERADIATION.fullmatch(name):
            _fail(path, f"{name} holds fluorescence, which cannot be read as an image")
        if match := _CHANNEL.fullmatch(name):
            parts.setdefault(match[1], []).append((_nanometres(path, *match.groups()[1:]), name))
    if not parts:
        _fail(path, "not a spectral image: no channel is named like S0.550,0nm or T.550,0nm")
    return {part: sorted(bands) for part, bands in parts.items()}


def layer_names(path: str | Path) -> tuple[str, ...]:
    """Return the channels that a spectral EXR file has beside its bands and its preview."""
    names = exr_files.channel_names(images.attributes(Path(path)))
    return tuple(n for n in names if not _CHANNEL.fullmatch(n) and n not in ("R", "G", "B", "A"))


def _other_kind(emissive: bool) -> str:
    held, wanted = ("reflectances (T)", "light (S0)")[:: 1 if emissive else -1]
    return f"this spectral image holds {held}, where {wanted} is needed"


def _left_out(parts: Mapping[str, Any], light: bool) -> tuple[str, ...]:
    """Return notes on parts of a file that are not read."""
    polarised = any(part in parts for part in ("S1", "S2", "S3"))
    notes = ["its polarisation (S1 to S3) is left out"] if light and polarised else []
    if {"S0", "T"} <= parts.keys():
        notes.append(f"its {'reflectances (T)' if light else 'light (S0)'} are left out")
    return tuple(notes)


def _nanometres(path: Path, digits: str, exponent: str, prefix: str | None, unit: str) -> float:
    """A wavelength [nm] from the parts of its name; of a frequency, that of light in vacuum."""
    value = float(digits.replace(",", ".") + exponent)
    if unit == "m" and prefix == "n":
        return value
    size = value * PREFIXES[prefix or ""]
    if not 0.0 < size < float("inf"):
        _fail(path, f"a channel of wavelength {digits}{exponent} {prefix or ''}{unit}")
    return LIGHT / size * 1e9 if unit == "Hz" else size * 1e9


def _decimal(nm: float) -> str:
    """A wavelength as names hold it, with six digits, or as many as it takes to be exact."""
    short = f"{nm:.6f}"
    return (short if float(short) == nm else repr(float(nm))).replace(".", ",")


def _exposure(value: Any) -> float:
    """The stops in an EV attribute, a number or a text; 0 for other values."""
    try:
        stops = float(value)
    except (TypeError, ValueError):
        return 0.0
    return stops if np.isfinite(stops) else 0.0


def _curve(path: Path, text: object) -> Tabulated | None:
    """A spectrum in an attribute: 400nm:0.5;410nm:0.6; and so on."""
    points = {}
    for digits, exponent, prefix, unit, value in _POINT.findall(
        text if isinstance(text, str) else ""
    ):
        try:
            points[_nanometres(path, digits, exponent, prefix, unit)] = float(value)
        except ValueError:
            _fail(path, f"{value!r} in the spectrum of an attribute is not a number")
    return Tabulated(sorted(points), [points[nm] for nm in sorted(points)]) if points else None
