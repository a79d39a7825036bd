"""OpenEXR files as pictures, by the meaning of their attributes.

Attributes as in "Technical Introduction to OpenEXR" and "OpenEXR File Layout": a picture is its
display window; pixels outside of the data window are zero. Colours are as `colorInteropID` says,
else linear, of the primaries and the white in `chromaticities`, else of Rec. 709. Colours are
multiplied by alpha, and stay so.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.arrays import Floats32, Matrix
from clpt.errors import SceneError
from clpt.images import exr_files, interop
from clpt.images.checks import check_there, reading
from clpt.images.exr_files import Header, Window, window
from clpt.images.interop import Encoding
from clpt.images.stored import Stored
from clpt.spectra import spaces

FAVOURED = ("combined", "beauty", "rgba", "rgb", "color", "colour")  # Blender's is the first
STOPS = "displayExposure"  # attribute: stops that brighten pictures for screens
HALF_MAX = 65504.0
HALF_MIN = 2.0**-14  # halves from here on have 11 bits


@dataclass(frozen=True)
class Choice:
    """The channels of a picture.

    part: index of their part; names: in the order of the image; form: "rgb", "xyz", "grey",
    "chroma" (luminance and chroma) or "numbers"; all but the last may have alpha; note: a warning
    about the choice.
    """

    part: int
    names: tuple[str, ...]
    form: str
    note: str = ""


def choose(parts: Sequence[Sequence[str]]) -> Choice:
    """Return the channels of the picture, by the names of the channels of each part.

    A name is a layer, a dot and a letter; the letters of a picture are R, G, B and A, or Y, RY, BY
    and A ("Technical Introduction to OpenEXR", Channel Names), here in small letters too. The rule:

    1. of each part in turn, channels without a layer; X, Y and Z too, which are XYZ;
    2. else of each part in turn, channels of a layer: of a layer whose last word is in FAVOURED,
       else of the first layer;
    3. else, of the first part: its only channel; X, Y and Z of a layer; else all, as numbers.

    Deep parts have no names here, and are passed over.
    """
    layers = [_layers(names) for names in parts]
    for number, named_letters in enumerate(layers):
        if choice := _picture(number, named_letters.get("", {}), whole=True):
            return choice
    choice, taken = None, ""
    others: list[str] = []
    for number, named_letters in enumerate(layers):
        named = {layer: _picture(number, letters) for layer, letters in named_letters.items()}
        pictures = {layer: picture for layer, picture in named.items() if picture}
        others += pictures
        if choice is None and pictures:
            layer = min(pictures, key=_rank)  # the first layer of the lowest rank
            choice = pictures[layer]
            taken = layer
    if choice is None:
        number = next((i for i, names in enumerate(parts) if names), 0)
        return _numbers(number, parts[number], layers[number])
    if len(others) == 1 or _rank(taken) < len(FAVOURED):
        return choice
    note = f"its picture is taken from the layer {taken!r}; others with colours are left out"
    return Choice(choice.part, choice.names, choice.form, note)


def _layers(names: Sequence[str]) -> dict[str, dict[str, str]]:
    """The names by layer and letter, which is a capital; the name with a capital comes first."""
    layers: dict[str, dict[str, str]] = {}
    for name in sorted(names):
        layer, _, letter = name.rpartition(".")
        layers.setdefault(layer, {}).setdefault(letter.upper(), name)
    return layers


def _rank(layer: str) -> int:
    word = layer.rpartition(".")[2].lower()
    return next((i for i, favoured in enumerate(FAVOURED) if word == favoured), len(FAVOURED))


def _picture(part: int, letters: Mapping[str, str], whole: bool = False) -> Choice | None:
    """The picture that the letters of a layer make; whole: of no layer."""
    alpha = ("A",) if "A" in letters else ()
    for form, needed in _forms(letters, whole):
        if letters.keys() >= set(needed):
            return Choice(part, tuple(letters[letter] for letter in (*needed, *alpha)), form)
    return None


def _forms(letters: Mapping[str, str], whole: bool) -> Iterator[tuple[str, tuple[str, ...]]]:
    yield "rgb", ("R", "G", "B")
    yield "chroma", ("Y", "RY", "BY")
    if whole:
        yield "xyz", ("X", "Y", "Z")
    if "X" not in letters:  # else it is a coordinate
        yield "grey", ("Y",)


def _numbers(part: int, names: Sequence[str], layers: Mapping[str, Mapping[str, str]]) -> Choice:
    """The channels of a part without a picture."""
    if len(names) == 1:
        return Choice(part, tuple(names), "numbers")
    for letters in layers.values():
        if letters.keys() >= set("XYZ"):
            return Choice(part, tuple(letters[letter] for letter in "XYZ"), "numbers")
    every = tuple(sorted(names))
    note = f"has no channels R, G and B, nor Y: {', '.join(every)} are taken as they stand"
    return Choice(part, every, "numbers", note)


def read(path: Path) -> Stored:
    """Read the picture of a file. Raises SceneError for deep or too large pictures."""
    headers = exr_files.headers(path)
    choice = choose([exr_files.flat_channels(header) for header in headers])
    header = headers[choice.part]
    exr_files.check(path, header)
    read_ = exr_files.read_channels(path, choice.names, choice.part)
    names = choice.names
    if choice.form == "grey" and len(names) == 2:
        names = (names[0],) * 3 + names[1:]
    x0, y0, x1, y1 = window(header, "displayWindow")
    values = np.empty((y1 - y0, x1 - x0, len(names)), np.float32)
    for index, name in enumerate(names):
        values[..., index] = placed(_whole(read_[name], window(header, "dataWindow")), header)
    stated, notes = _encoding(header, choice)
    if choice.form == "chroma":
        values[..., :3] = _from_chroma(values[..., :3], _weights(header))
    return Stored(
        values, stated.encoded, stated.gamma, stated.matrix, _notes(header, choice), notes
    )


def placed(plane: NDArray[Any], header: Header) -> NDArray[Any]:
    """Return a channel (h, w) of the data window over the display window: zero outside, or cut."""
    data, shown = window(header, "dataWindow"), window(header, "displayWindow")
    if data == shown:
        return plane
    shown_plane = np.zeros((shown[3] - shown[1], shown[2] - shown[0]), plane.dtype)
    x0, y0, x1, y1 = common = _common(data, shown)
    if x0 < x1 and y0 < y1:
        shown_plane[_part(common, shown)] = plane[_part(common, data)]
    return shown_plane


def matrix_of(header: Header) -> Matrix | None:
    """From the colours of a part to linear Rec. 709, None where they are that or say nothing.

    Raises SceneError for chromaticities that span no colours.
    """
    stated = header.get("chromaticities")
    return None if stated is None else spaces.to_rec709(stated)


def _fits_half(pixels: Floats32) -> bool:
    """Return whether half numbers hold the brightest finite value, and most others precisely."""
    sizes = np.abs(pixels[np.isfinite(pixels) & (pixels != 0.0)])
    if not sizes.size:
        return True
    middle = (sizes.size - 1) // 2, sizes.size // 2
    median = np.partition(sizes, middle)[[*middle]].mean()  # np.median imports masked arrays
    return bool(median >= HALF_MIN and sizes.max() <= HALF_MAX)


def write(
    path: Path,
    pixels: Floats32,
    half: bool,
    metadata: Mapping[str, Any],
    layers: Mapping[str, ArrayLike],
    prefix: str,
) -> None:
    """Write an image and its layers, see `clpt.images.write`. Raises SceneError for shapes."""
    channels = {}
    letters_of = {1: "Y", 3: "RGB", 4: "RGBA"}[pixels.shape[2]]
    parts = [("", tuple(prefix + letter for letter in letters_of), pixels)]
    for name, array in layers.items():
        layer = np.asarray(array, np.float32)
        layer = layer[..., None] if layer.ndim == 2 else layer
        if layer.shape[:2] != pixels.shape[:2] or layer.shape[2] not in (1, 3, 4):
            message = f"layer {name!r} has shape {layer.shape}, the image {pixels.shape}"
            raise SceneError(message, file=path)
        letters = (".R", ".G", ".B", ".A")[: layer.shape[2]] if layer.shape[2] > 1 else ("",)
        parts.append((name, letters, layer))
    for name, letters, layer in parts:
        narrow = half and not name and _fits_half(layer)
        stored = np.clip(layer, -HALF_MAX, HALF_MAX).astype(np.float16) if narrow else layer
        for index, letter in enumerate(letters):
            channels[name + letter] = np.ascontiguousarray(stored[..., index])
    exr_files.write_channels(path, metadata, channels)


def _encoding(header: Header, choice: Choice) -> tuple[Encoding, tuple[str, ...]]:
    """Return how a picture's colours are encoded, and notes on attributes left out.

    `colorInteropID` comes before `chromaticities`.
    """
    if choice.form == "xyz":
        return Encoding(False, None, spaces.from_xyz("rec709")), ()
    name, notes = str(header.get("colorInteropID", "")), list[str]()
    if choice.form in ("rgb", "grey") and name not in interop.SILENT:
        stated = interop.encoding(name)
        if stated is not None:
            return stated if choice.form == "rgb" else replace(stated, matrix=None), ()
        notes.append(f"its colorInteropID {name!r} is left out: its colours are taken as linear")
    matrix = None
    if choice.form in ("rgb", "chroma"):
        try:
            matrix = matrix_of(header)
        except SceneError as error:
            notes.append(f"{error.message}: left out, its colours are taken as Rec. 709")
    return Encoding(False, None, matrix), tuple(notes)


def _notes(header: Header, choice: Choice) -> tuple[str, ...]:
    """Return notes on attributes of a picture that are left out."""
    notes = [choice.note] if choice.note else []
    aspect = float(header.get("pixelAspectRatio", 1.0))
    if aspect != 1.0:
        notes.append(f"its pixelAspectRatio of {aspect:g} is left out: its pixels are square")
    if getattr(header.get("envmap"), "name", "") == "ENVMAP_CUBE":
        notes.append("its envmap attribute says that it is a cube, which is left out")
    return tuple(notes)


def _common(a: Window, b: Window) -> Window:
    return max(a[0], b[0]), max(a[1], b[1]), min(a[2], b[2]), min(a[3], b[3])


def _part(part: Window, of: Window) -> tuple[slice, slice]:
    """Rows and columns of a part of a window."""
    rows = slice(part[1] - of[1], part[3] - of[1])
    return rows, slice(part[0] - of[0], part[2] - of[0])


def _whole(plane: NDArray[Any], data: Window) -> Floats32:
    """A channel with a value for each pixel, where it is subsampled by linear interpolation."""
    full = np.asarray(plane, np.float32)
    for axis, wanted in ((0, data[3] - data[1]), (1, data[2] - data[0])):
        count = full.shape[axis]
        if count != wanted:
            full = _finer(full, wanted // count, axis)
    return full


def _finer(values: Floats32, times: int, axis: int) -> Floats32:
    """Return values at `times` as many places along an axis; beyond the last they are constant."""
    after = np.roll(values, -1, axis)
    last = [slice(None)] * 2
    last[axis] = slice(-1, None)
    after[tuple(last)] = values[tuple(last)]
    share = np.arange(times, dtype=np.float32) / np.float32(times)
    between = [values + weight * (after - values) for weight in share]
    shape = list(values.shape)
    shape[axis] *= times
    return np.stack(between, axis + 1).reshape(shape)


def _weights(header: Header) -> NDArray[np.float64]:
    """The shares of red, green and blue in luminance, (3,), by a part's chromaticities."""
    stated = header.get("chromaticities", spaces.chromaticities("rec709"))
    try:
        matrix, _ = spaces.stated_to_xyz(stated)
    except SceneError:
        matrix = spaces.to_xyz("rec709")
    return np.asarray(matrix[1], np.float64)


def _from_chroma(values: Floats32, weights: NDArray[np.float64]) -> Floats32:
    """Red, green and blue of Y, RY = (R - Y) / Y and BY = (B - Y) / Y, (h, w, 3)."""
    y, ry, by = np.moveaxis(values, 2, 0)
    red, blue = (ry + 1.0) * y, (by + 1.0) * y
    green = (y - red * np.float32(weights[0]) - blue * np.float32(weights[2])) / weights[1]
    return np.stack([red, green.astype(np.float32), blue], axis=2)


def read_layers(path: str | Path) -> dict[str, NDArray[np.float32]]:
    """Every channel of an EXR file by name, each (h, w) float32. Raises SceneError."""
    return {name: np.asarray(c, np.float32) for name, c in read_channels(path).items()}


def read_channels(path: str | Path) -> dict[str, NDArray[Any]]:
    """Every channel of an EXR file by name, (h, w) float16, float32 or uint32, as it is stored.

    Of its data window, and of its first part. Raises SceneError.
    """
    path = Path(path)
    check_there(path)
    with reading(path):
        return dict(exr_files.read_channels(path))
