"""Layers beside the picture: from the words of a film (kernels/film/layers.cl), and as .exr files.

Channels of files have the names of clpt or of Blender.

Cryptomatte is a layer of the objects or materials that a pixel shows, with the coverage of each.
Specification 1.2 (Friedman and Jones, Psyop): names are hashed to float32; channels hold pairs of a
hash and a coverage, by falling coverage. The header has the names.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from clpt import images
from clpt.arrays import Floats32, Image, Words
from clpt.choices import Exposure
from clpt.images import exr_files, spectral_exr
from clpt.images.colour import View
from clpt.render.film.colour import output_matrix, sensor
from clpt.render.film.pictures import PictureForm, Pictures
from clpt.render.film.state import numbers
from clpt.render.records.film import layer_places
from clpt.scene.integrators import Film
from clpt.scene.layers import LAYERS
from clpt.spectra import cie
from clpt.spectra.spaces import chromaticities

RANKS = 6  # pairs of a pixel in a file
COUNT_BITS = 7  # lowest bits of a matte's word, see kernels/film/layers.cl
LETTERS = ("red", "green", "blue", "alpha")  # channels of two pairs in a file
SHORT_LETTERS = ("r", "g", "b", "a")  # their names in Blender


def murmur3_32(text: str) -> int:
    """Return MurmurHash3_x86_32 with the seed 0 of a text in UTF-8 (Appleby, public domain)."""
    data, mask = text.encode("utf-8", "replace"), 0xFFFFFFFF

    def scrambled(k: int) -> int:
        k = k * 0xCC9E2D51 & mask
        return ((k << 15 | k >> 17) & mask) * 0x1B873593 & mask

    h, whole = 0, len(data) // 4 * 4
    for i in range(0, whole, 4):
        h ^= scrambled(int.from_bytes(data[i : i + 4], "little"))
        h = ((h << 13 | h >> 19) * 5 + 0xE6546B64) & mask
    h ^= scrambled(int.from_bytes(data[whole:], "little")) ^ len(data)
    h = (h ^ h >> 16) * 0x85EBCA6B & mask
    h = (h ^ h >> 13) * 0xC2B2AE35 & mask
    return h ^ h >> 16


def name_bits(name: str) -> int:
    """Return the bits of the float32 that stands for a name: neither infinite, NaN nor tiny."""
    h = murmur3_32(name)
    exponent = h >> 23 & 255
    return h ^ 1 << 23 if exponent in (0, 255) else h


def pairs_of(slots: Words, samples: Words, names: Sequence[str]) -> Image:
    """Return RANKS pairs of hash and coverage of each pixel, (h, w, 2 RANKS) float32.

    slots: (slots, h, w), words of a matte; samples: (h, w), their numbers; names: by number.
    """
    codes = np.array([0, *map(name_bits, names)], np.uint32)
    hashes, counts = codes[slots >> COUNT_BITS], (slots & (1 << COUNT_BITS) - 1).astype(np.int64)
    hashes, counts = _joined(hashes, counts)
    order = np.argsort(-counts, axis=0, kind="stable")[:RANKS]
    hashes, counts = np.take_along_axis(hashes, order, 0), np.take_along_axis(counts, order, 0)
    present = counts > 0
    pairs = np.zeros((*slots.shape[1:], RANKS, 2), np.float32)
    pairs[..., 0] = np.moveaxis(
        np.where(present, hashes, 0).astype(np.uint32).view(np.float32), 0, 2
    )
    pairs[..., 1] = np.moveaxis(np.where(present, counts / np.maximum(samples, 1), 0.0), 0, 2)
    return pairs.reshape(*slots.shape[1:], 2 * RANKS)


def _joined(
    hashes: NDArray[np.uint32], counts: NDArray[np.int64]
) -> tuple[NDArray[np.uint32], NDArray[np.int64]]:
    """Return hashes and counts (slots, h, w) with the counts of equal hashes added up."""
    order = np.argsort(hashes, axis=0, kind="stable")
    hashes, counts = np.take_along_axis(hashes, order, 0), np.take_along_axis(counts, order, 0)
    for i in range(len(hashes) - 1):
        same = hashes[i] == hashes[i + 1]
        counts[i + 1] += np.where(same, counts[i], 0)
        counts[i] = np.where(same, 0, counts[i])
    return hashes, counts


def matte_channels(prefix: str, pairs: Image, letters: Sequence[str] = LETTERS) -> dict[str, Image]:
    """Return pairs (h, w, 2 n) as channels of a file, such as CryptoObject00.red."""
    return {f"{prefix}{i // 4:02d}.{letters[i % 4]}": pairs[..., i] for i in range(pairs.shape[2])}


def matte_attributes(prefix: str, names: Sequence[str]) -> dict[str, str]:
    """Return the attributes of a file with such channels: the names behind the hashes."""
    key = f"cryptomatte/{murmur3_32(prefix):08x}"[: len("cryptomatte/") + 7]
    manifest = {name: f"{name_bits(name):08x}" for name in dict.fromkeys(names)}
    return {
        f"{key}/name": prefix,
        f"{key}/hash": "MurmurHash3_32",
        f"{key}/conversion": "uint32_to_float32",
        f"{key}/manifest": json.dumps(manifest, ensure_ascii=False, separators=(",", ":")),
    }


UNITS = 2.0**22  # kernels/film/layers.cl
LONG_UNITS = (2.0**18, 2.0**-6, 2.0**-30, 2.0**-54)
GROUP = "light_"  # begins the name of a group's picture
AT_ONCE = 1 << 18  # pixels of pictures of light that are developed at once


def layers_of(
    arrays: Mapping[str, Words], picture: Pictures, variance: Image | None
) -> dict[str, Image]:
    """Return the layers of a film by name, (h, w, 1 to 12) float32.

    arrays: words by name, see `FilmState`; picture: the film's other pictures; variance: its layer
    of that name, None if the film has none. Where nothing was seen, as in the sky, a layer is 0, an
    id -1. `light_groups` becomes a layer light_NAME for each group.
    """
    layers: dict[str, Image] = {}
    form = picture.form
    first_samples = _first_samples(form, arrays["layers"])
    light = _light(form, arrays["light_layers"], picture)
    mattes = iter(arrays["mattes"])
    for name in form.layers:
        if LAYERS[name].form == "light":
            layers |= light[name]
        elif LAYERS[name].form == "matte":
            layers[name] = pairs_of(next(mattes), arrays["layers"][0], matte_names(form, name))
        elif name == "samples":
            layers[name] = picture.samples_per_pixel()[..., None]
        elif name == "variance" and variance is not None:
            layers[name] = variance
        else:
            layers[name] = first_samples[name]
    return layers


def matte_names(form: PictureForm, layer: str) -> tuple[str, ...]:
    """Return the names of objects or materials, by the number that a matte holds."""
    return form.names.materials if layer == "crypto_material" else form.names.objects


def _first_samples(form: PictureForm, words: Words) -> dict[str, Image]:
    """Return the layers that only the first samples of a pixel fill."""
    layers = {}
    for name, first in layer_places(form.layers).items():
        layer = LAYERS[name]
        layer_words = words[first : first + layer.words]
        if layer.form == "id":
            layers[name] = (layer_words[0].astype(np.float32) - np.float32(1.0))[..., None]
            continue
        sums = _near_one(layer_words) if layer.form == "near" else _long(layer_words)
        mean = np.moveaxis(sums, 0, -1) / np.maximum(words[0], 1)[..., None]
        if layer.is_colour:
            mean = mean @ np.asarray(form.paper).T
        layers[name] = mean.astype(np.float32)
    return layers


def _light(form: PictureForm, words: Words, picture: Pictures) -> dict[str, dict[str, Image]]:
    """Return the pictures of each layer of light, by the layer and by the picture's name."""
    names = [name for name in form.layers if LAYERS[name].form == "light"]
    if not names:
        return {}
    colours = _light_colours(form, words[: len(words) - _time_sums(form)], picture)
    light: dict[str, dict[str, Image]] = {}
    for i, name in enumerate(names):  # light_groups comes last: it takes all remaining pictures
        if name == "light_groups":
            groups = (f"{GROUP}{group}" for group in form.names.light_groups)
            light[name] = dict(zip(groups, colours[i:], strict=True))
        else:
            light[name] = {name: colours[i]}
    return light


def times_of(form: PictureForm, words: Words, picture: Pictures) -> Floats32:
    """Return light by time, (h, w, time_bins + 1, 3) float32; arguments are those of `_light`."""
    colours = _light_colours(form, words[len(words) - _time_sums(form) :], picture)
    return np.ascontiguousarray(np.moveaxis(colours, 0, 2))


def _time_sums(form: PictureForm) -> int:
    """The sums of a pixel's light by time, which come last."""
    return 3 * (form.time_bins + 1) if form.time_bins else 0


def _light_colours(form: PictureForm, words: Words, picture: Pictures) -> Floats32:
    """Return the pictures of sums of light (3 n, 3, h, w) in colours, (n, h, w, 3) float32."""
    samples, size = picture.samples_per_pixel(), words.shape[2:]
    count = len(words) // 3 // (1 + form.weighed)
    colours = np.empty((count, *size, 3), np.float32)
    step = max(1, AT_ONCE // math.prod(size))
    for i in range(0, count, step):
        part = slice(3 * i, 3 * min(i + step, count))
        means = numbers(np.moveaxis(words[part], 1, 0)) / np.maximum(samples, 1.0)
        if form.weighed:
            brought = numbers(np.moveaxis(words[3 * count :][part], 1, 0))
            paths = max(picture.light_paths_per_pixel(), 1e-30)
            means = means + brought * ((samples > 0) / np.float32(paths))
        first, second, third = np.moveaxis(means.reshape(-1, 3, *size), 1, 0)
        for c, (a, b, d) in enumerate(form.to_output):
            colours[i : i + step, ..., c] = a * first + b * second + d * third
    return colours


def white_paper(film: Film, mode: str) -> NDArray[np.float64]:
    """Return the matrix (3, 3) from the sensor's sums of a reflectance to the output space.

    A surface that reflects all light becomes (1, 1, 1); a channel without a response in the film's
    range is not scaled.
    """
    matrix = output_matrix(film, mode)
    seen = np.ones(3)
    if mode == "spectral":
        lambdas = np.arange(film.lambda_min, film.lambda_max + 1e-6)
        seen = sensor(film).sample(lambdas).sum(axis=0) / cie.CIE_Y_INTEGRAL
    white = matrix @ seen
    return matrix / np.where(white == 0.0, 1.0, white)[:, None]


def _near_one(words: Words) -> NDArray[np.float64]:
    return words.view(np.int32) / UNITS


def _long(words: Words) -> NDArray[np.float64]:
    """Return sums of four words each; two words lie 24 bits apart, so two are a whole number."""
    parts = words.view(np.int32).reshape(-1, len(LONG_UNITS), *words.shape[1:])
    whole = (parts[:, ::2].astype(np.int64) << 24) + parts[:, 1::2]
    return whole[:, 0] * LONG_UNITS[1] + whole[:, 1] * LONG_UNITS[3]


def viewable(name: str, layer: Image) -> Image:
    """Return the values (h, w, 1 to 4) of a layer as colours in [0, 1], (h, w, 3) float32."""
    if name.endswith("albedo"):
        return layer
    if name.endswith("_normal"):
        return layer * np.float32(0.5) + np.float32(0.5)
    if name in ("depth", "z"):  # the nearest point is white; twice as far, half as bright
        near = np.min(layer, where=layer > 0, initial=np.inf)
        return np.repeat(np.divide(near, layer, where=layer > 0, out=np.zeros_like(layer)), 3, 2)
    if name.endswith("_id"):  # consecutive numbers differ in hue; black where nothing is seen
        hue = layer * np.float32(0.618034) + np.arange(3, dtype=np.float32) / np.float32(3.0)
        shown = 0.5 + 0.5 * np.cos(2 * np.pi * hue)
        return np.where(layer < 0, 0.0, shown).astype(np.float32)
    if name == "motion":  # hue: direction; brightness: length over the greatest length
        motion = layer[..., 2:] - layer[..., :2]
        turn = np.arctan2(motion[..., 1:], motion[..., :1])
        far = np.linalg.norm(motion, axis=2, keepdims=True)
        wheel = 0.5 + 0.5 * np.cos(turn - 2 * np.pi / 3 * np.arange(3))
        return (wheel * (far / max(float(far.max()), 1e-6))).astype(np.float32)
    cells = np.mod(layer, np.float32(1.0))  # positions and uv: colours repeat in every unit
    return np.pad(cells, ((0, 0), (0, 0), (0, 3 - cells.shape[2])))


VIEW_LAYER = "ViewLayer."  # prefix of Blender's names
PICTURE = {"clpt": "", "blender": f"{VIEW_LAYER}Combined."}  # prefix of R, G and B of the picture
SETS = tuple(PICTURE)
BESIDE = {"noisy": "Noisy Image", "denoised_error": "Denoised Error"}  # Blender's names


def write_layers(
    path: str | Path,
    source: Pictures,
    *,
    names: str = "clpt",
    metadata: Mapping[str, str | int | float] | None = None,
) -> None:
    """Write the picture of a renderer or film and its layers as an .exr.

    path: of the file. source: the renderer or film. names: a name of SETS; "blender" gives names
    such as ViewLayer.Combined.R. metadata: further attributes of the file. The picture is stored in
    half floats; bands, layers and light by time are stored in float32. The data window of a crop is
    its part of the whole film. Raises SceneError.
    """
    source = source.developed()
    layers, form = source.layers(), source.form
    if form.adaptive:
        layers.setdefault("samples", source.samples_per_pixel()[..., None])
    channels = channels_of(layers, names)
    channels |= _beside(source, names)
    if form.time_bins:
        channels |= time_channels(source.times())
    if form.bands and form.alpha:
        channels["A"] = source.picture()[..., 3]
    place = exr_files.windows(source.colours().shape, form.place)
    stated = {**(metadata or {}), **attributes_of(form, names), **place}
    if form.bands:
        said = {**stated, "chromaticities": chromaticities(form.output_space)}
        spectral = source.spectral_image()
        preview = source.colours() * np.float32(2.0**spectral.exposure)
        spectral_exr.write(path, spectral, preview=preview, metadata=said, layers=channels)
    else:
        images.write(
            path, source.image(), metadata=stated, layers=channels, space=form.output_space,
            prefix=PICTURE[names],
        )  # fmt: skip


def write_picture(
    path: Path,
    source: Pictures,
    *,
    names: str = "clpt",
    metadata: Mapping[str, str | int | float] | None = None,
    exposure: Exposure = 0.0,
    tone: str = "none",
    view: View | None = None,
) -> None:
    """Write the picture of a renderer or film in the format of a path's suffix.

    An .exr holds its layers, bands and light by time; an .npy light by time, or else bands, or else
    colours. Other parameters are as in `write_layers` and `clpt.write_image`. Raises SceneError.
    """
    suffix, form = path.suffix.lower(), source.form
    if form.time_bins and suffix == ".npy":
        images.write_npy(path, source.developed().times())
    elif form.bands and suffix == ".npy":
        images.write_npy(path, source.image())
    elif suffix == ".exr":
        write_layers(path, source, names=names, metadata=metadata)
    else:
        images.write(
            path, source.picture(), metadata=metadata, space=form.output_space, tone=tone,
            view=view, exposure=images.raised(exposure, form.display_exposure),
        )  # fmt: skip


def channels_of(layers: Mapping[str, Image], names: str = "clpt") -> dict[str, Image]:
    """Return the channels of layers as an .exr has them, (h, w) by names such as depth.Z.

    layers: as `Renderer.layers` returns them; names: a name of SETS, "blender" gives names such as
    ViewLayer.Position.X.
    """
    channels: dict[str, Image] = {}
    for name, image in layers.items():
        prefix, layer = _prefix(name, names), LAYERS[_kind(name)]
        if layer.form == "matte":
            blender = names == "blender"
            letters = SHORT_LETTERS if blender else LETTERS
            channels |= matte_channels(prefix, image, letters)
            continue
        exr_names = layer.exr if names == "clpt" else ()
        for i, letter in enumerate(layer.channels):
            flipped = names == "blender" and letter in layer.flipped
            channel = exr_names[i] if exr_names else f"{prefix}.{letter}"
            channels[channel] = -image[..., i] if flipped else image[..., i]
    return channels


def time_channels(times: Floats32) -> dict[str, Image]:
    """Return the channels of light by time (h, w, bins + 1, 3) by names such as time_0000.R."""
    names = [*(f"time_{i:04d}" for i in range(times.shape[2] - 1)), "time_outside"]
    return {
        f"{name}.{letter}": times[:, :, i, c]
        for i, name in enumerate(names)
        for c, letter in enumerate("RGB")
    }


def _beside(source: Pictures, names: str) -> dict[str, Image]:
    channels: dict[str, Image] = {}
    for name, picture in source.extra_pictures.items():
        prefix = VIEW_LAYER + BESIDE[name] if names == "blender" else name
        if picture.ndim == 2:
            channels[f"{prefix}.X" if names == "blender" else prefix] = picture
        else:
            channels |= {f"{prefix}.{letter}": picture[..., i] for i, letter in enumerate("RGB")}
    return channels


def attributes_of(form: PictureForm, names: str = "clpt") -> dict[str, str | float]:
    """Return the attributes of an .exr: the stops for screens, and the names in mattes."""
    attributes: dict[str, str | float] = {}
    if form.display_exposure:
        attributes[images.STOPS] = form.display_exposure
    for name in form.layers:
        if LAYERS[name].form == "matte":
            attributes |= matte_attributes(_prefix(name, names), matte_names(form, name))
    return attributes


def _kind(name: str) -> str:
    """Return the key of a layer in LAYERS."""
    return name if name in LAYERS else "light_groups"


def _prefix(name: str, names: str) -> str:
    layer = LAYERS[_kind(name)]
    if names == "blender":
        group = "" if name in LAYERS else f"_{name.removeprefix(GROUP)}"
        return f"{VIEW_LAYER}{layer.blender}{group}"
    return layer.blender if layer.form == "matte" else name
