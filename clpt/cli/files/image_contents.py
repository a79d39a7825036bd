"""An image file or a film as `clpt info` and `clpt inspect` show it: values, colours, facts."""

from __future__ import annotations

import contextlib
import dataclasses
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from clpt import images
from clpt.images import spectral_exr

from ...errors import SceneError
from ...spectra.spaces import SPACES, chromaticities
from ..console import shown
from .targets import is_film

Pixel = tuple[int, int]  # x, y from the top left
LAYOUT = (
    "pixelAspectRatio", "screenWindowWidth", "name", "view", "chunkCount", "version",
    "spectralLayoutVersion", "emissiveUnits", "EV", "cameraResponse", "lensTransmission",
)  # fmt: skip
TYPES = {"float16": "half", "float32": "float", "uint32": "uint"}  # of channels, in EXR's words
MATTES = "cryptomatte/"  # begins their attributes
MOST_STOPS = 64.0  # of a film's display_exposure
LETTERS = {1: "Y", 2: "YA", 3: "RGB", 4: "RGBA"}


@dataclass(frozen=True)
class ImageContents:
    """An image as it is inspected.

    values: (h, w, n); labels: a wavelength or a channel's name per value; lambdas: (n,) [nm], None
    where the image is not spectral; colours: (h, w, 3) linear Rec. 709, None where it has none;
    quantity: of the values, with its unit; facts: further entries of the file; stops: by so many
    screens show the colours brighter.
    """

    path: Path
    values: np.ndarray
    labels: tuple[str, ...]
    lambdas: np.ndarray | None
    colours: np.ndarray | None
    quantity: str
    facts: dict[str, str]
    stops: float = 0.0

    def pixel(self, pixel: Pixel) -> np.ndarray:
        """Return a pixel's values (n,). Raises SceneError outside of the image."""
        (x, y), (height, width) = pixel, self.values.shape[:2]
        if x >= width or y >= height:
            raise SceneError(
                f"{x},{y} is outside of the image of {width} x {height} pixels, whose last one is "
                f"{width - 1},{height - 1}",
                file=self.path,
            )
        return np.asarray(self.values[y, x])

    def hex_colour(self, pixel: Pixel) -> str | None:
        """Return a pixel's colour as #rrggbb in sRGB; None where the image has no colours."""
        if self.colours is None:
            return None
        x, y = pixel
        colours = self.colours[y : y + 1, x : x + 1]
        return "#" + bytes(images.to_srgb8(colours, self.stops)[0, 0]).hex()


def contents(path: Path) -> ImageContents:
    """Return an image, a film or a checkpoint. Raises SceneError."""
    return film_contents(path) if is_film(path) else read_contents(path)


def read_contents(path: Path) -> ImageContents:
    """Read any image file; an .exr and a .png tell how they were made. Raises SceneError."""
    image, suffix = _read(path), path.suffix.lower()
    if suffix == ".png":
        return dataclasses.replace(image, facts=image.facts | _provenance(images.png_text(path)))
    if suffix != ".exr":
        return image
    attributes, parts = images.attributes(path), images.part_names(path)
    facts = image.facts | _stored(attributes) | _provenance(attributes)
    if len(parts) > 1:
        facts["parts"] = f"{', '.join(parts)}; the first one is shown"
    return dataclasses.replace(image, facts=facts)


def _stored(attributes: dict[str, Any]) -> dict[str, str]:
    """Describe the form of an .exr: space of its colours, compression, window."""
    facts = {}
    if "chromaticities" in attributes:
        stated = np.ravel(attributes["chromaticities"])
        near = [s for s in SPACES if np.allclose(stated, chromaticities(s), atol=1e-4)]
        facts["colours"] = ", ".join(near) or "of other primaries"
    facts["compression"] = attributes["compression"].name.removesuffix("_COMPRESSION").lower()
    (x, y), _ = attributes["dataWindow"]
    low, high = attributes["displayWindow"]
    if (x, y) != (low[0], low[1]):
        whole = f"{high[0] - low[0] + 1} x {high[1] - low[1] + 1}"
        facts["window"] = f"from {x - low[0]},{y - low[1]} of {whole}"
    return facts


def _provenance(attributes: Mapping[str, Any]) -> dict[str, str]:
    """Return the attributes that the writer of a file gave it, without those of its layout."""
    plain = {
        k: v
        for k, v in attributes.items()
        if isinstance(v, (str, int, float)) and not k.startswith(MATTES)
    }
    said = {
        k: f"{v:g}" if isinstance(v, float) else str(v) for k, v in plain.items() if k not in LAYOUT
    }
    return said | _mattes(attributes)


def _mattes(attributes: Mapping[str, Any]) -> dict[str, str]:
    """The mattes of Cryptomatte that a file has, and how many names each knows."""
    mattes = {}
    for key, manifest in attributes.items():
        if key.startswith(MATTES) and key.endswith("/manifest"):
            name = str(attributes.get(key.replace("/manifest", "/name"), key))
            with contextlib.suppress(ValueError):
                mattes[name] = f"Cryptomatte, {len(json.loads(manifest))} names"
    return mattes


def _read(path: Path) -> ImageContents:
    if spectral_exr.is_spectral(path):
        return _spectral(path)
    more: dict[str, str] = {}
    stops = 0.0
    if path.suffix.lower() == ".exr":
        channels = images.read_channels(path)
        stops = _stops(images.attributes(path))
        if len({channel.shape for channel in channels.values()}) != 1:
            raise SceneError("its channels are of different sizes", file=path)
        more = {"layers": "\n".join(_layers(channels))}
        layers = {name: np.asarray(channel, np.float32) for name, channel in channels.items()}
        if set("RGB") <= layers.keys():  # before others, in the usual order
            layers = {name: layers[name] for name in ("R", "G", "B")} | layers
        labels, values = tuple(layers), np.stack(list(layers.values()), axis=2)
    else:
        values = images.read(path)
        count = values.shape[2]
        labels = tuple(LETTERS.get(count, ())) or tuple(str(i) for i in range(count))
    colours = values[..., :3] if labels[:3] == tuple("RGB") else None
    if colours is not None and path.suffix.lower() == ".exr":
        with contextlib.suppress(SceneError):  # chromaticities that span no colours
            matrix = images.matrix_of(images.attributes(path))
            colours = colours if matrix is None else colours @ matrix.T.astype(np.float32)
    if labels[0] == "Y":
        colours = np.repeat(values[..., :1], 3, axis=2)
    facts = {"size": size_text(values), "channels": ", ".join(labels), **more}
    return ImageContents(path, values, labels, None, colours, "value (linear)", facts, stops)


def _stops(attributes: Mapping[str, Any]) -> float:
    """The stops that brighten a picture on screens, 0 where the file has no usable number."""
    stated = attributes.get(images.STOPS, 0.0)
    usable = isinstance(stated, (int, float)) and abs(stated) <= MOST_STOPS
    return float(stated) if usable else 0.0


def _spectral(path: Path) -> ImageContents:
    image = spectral_exr.read(path)
    lambdas, layers = image.lambdas, spectral_exr.layer_names(path)
    quantity = "reflectance"
    if image.emissive:
        quantity = f"radiance [{image.units}]" if image.units else "radiance"
    facts = {
        "size": size_text(image.values),
        "holds": "light" if image.emissive else "reflectances",
        "bands": f"{len(lambdas)}, {lambdas[0]:g} to {lambdas[-1]:g} nm",
        **({"units": image.units} if image.units else {}),
        **({"exposure": f"{image.exposure:g} stops"} if image.exposure else {}),
        **({"response": "of the camera is given"} if image.response else {}),
        **({"transmission": "of the lens is given"} if image.transmission else {}),
        **({"layers": ", ".join(layers)} if layers else {}),
        **({"note": "; ".join(image.warnings)} if image.warnings else {}),
    }
    colours = image.to_rgb() * np.float32(2.0**image.exposure)
    labels = tuple(f"{nm:g} nm" for nm in lambdas)
    return ImageContents(path, image.values, labels, lambdas, colours, quantity, facts)


def _layers(channels: dict[str, np.ndarray]) -> Iterator[str]:
    """Yield a line for each layer of an .exr: its channels, how they are stored, their values."""
    groups: dict[str, list[str]] = {}
    for name in channels:
        layer, _, letter = name.rpartition(".")
        picture = not layer and letter in "RGBAY"
        groups.setdefault(layer or ("picture" if picture else letter), []).append(name)
    for layer, names in sorted(groups.items(), key=lambda group: group[0] != "picture"):
        letters = sorted((name.rpartition(".")[2] for name in names), key=in_order)
        stored = " ".join(sorted({TYPES[str(channels[name].dtype)] for name in names}))
        values = np.stack([channels[name] for name in names])
        finite = values[np.isfinite(values)]
        spread = f", {finite.min():.4g} to {finite.max():.4g}" if finite.size else ""
        lost = values.size - finite.size
        bad = f", {lost:,} not finite" if lost else ""
        letters_shown = "" if [layer] == letters else f" {' '.join(letters)}"
        yield f"{layer}{letters_shown}: {stored}{spread}{bad}"


def in_order(letter: str) -> tuple[int, str]:
    """Return the key that sorts channels as people name them: R before G, and X before Y."""
    return "RGBA".find(letter) if letter in "RGBA" else len("RGBA"), letter


def size_text(values: np.ndarray) -> str:
    """Return the size of an image (h, w, n)."""
    return f"{values.shape[1]} x {values.shape[0]}"


def film_summary(path: Path) -> dict[str, Any]:
    """Return the description of a film file. Raises SceneError."""
    from ...render.film import film_file  # here: an image needs no renderer

    header = film_file.read_header(path)
    height, width = header["shapes"]["words"][-2:]
    origin, sessions, form = header["scene"], header["sessions"], header["form"]
    film: dict[str, Any] = {"width": width, "height": height, "bands": form["bands"]}
    crop = origin.get("film.crop")  # numbers with commas
    part = {} if crop is None else {"crop": [round(float(n)) for n in str(crop).split(",")]}
    return {
        "format": "film",
        "clpt": header["clpt"],
        "samples": [f"{first} to {end - 1}" for first, end in header["taken"]],
        "film": film | part,
        "holds": ["picture", *form["layers"], *["alpha"] * form["alpha"]],
        "integrator": header["settings"]["chosen.integrator"],
        "sampler": origin["sampler.type"],
        "seed": origin["seed"],
        "noise": "noise" in header["adaptive"],
        "seconds": round(sum(session["seconds"] for session in sessions), 3),
        "sessions": [
            f"{session['began']}  {session['seconds']:.1f} s  {session['device']['device']}"
            for session in sessions
        ],
    }


def film_contents(path: Path) -> ImageContents:
    """Return the picture of a film, and what it says of itself. Raises SceneError."""
    from clpt.render.film.layers import channels_of

    from ...render.film import film_file

    picture, summary = film_file.read(path).developed(), film_summary(path)
    form, lambdas, quantity = picture.form, None, "value (linear)"
    colours = picture.colours()
    values = picture.image()
    if form.bands:
        lambdas, quantity = picture.spectral_image().lambdas, "radiance [W m^-2 sr^-1 nm^-1]"
        labels = [f"{nm:g} nm" for nm in lambdas]
    else:
        beside = channels_of(picture.layers()) if form.layers else {}
        beside |= {"samples.X": picture.samples_per_pixel()} if form.adaptive else {}
        labels = [*"RGBA"[: values.shape[2]], *beside]
        values = np.dstack([values, *beside.values()])
    facts = {"size": size_text(values)} | {k: shown(v).plain for k, v in summary.items()}
    stops = form.display_exposure
    return ImageContents(path, values, tuple(labels), lambdas, colours, quantity, facts, stops)
