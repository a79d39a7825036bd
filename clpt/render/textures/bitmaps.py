"""The images of bitmaps: decoded in threads, halved where too large, packed for the device.

Images of 8 bits a channel stay small: a number takes a byte, a colour four bytes, or as a spectrum
eight: its sigmoid's argument at three wavelengths, of 21 bits each. Other images are floats.

An image with levels has its smaller copies behind it. They are means of linear values; where a
colour becomes a spectrum, that of the mean colour.
"""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import images, spectra
from clpt.arrays import Words
from clpt.errors import SceneError
from clpt.files import budget
from clpt.images import Stored
from clpt.images.stored import checked
from clpt.render.records.tables import LoweringCache, TableStore, version
from clpt.render.records.textures import KINDS, MIPS
from clpt.render.textures.texels import negative_notes, texel_words
from clpt.scene.pixels import channel, image_file
from clpt.scene.roles import EMISSION, REAL, REFLECTANCE, Role
from clpt.scene.textures import Bitmap

NODES = np.array([400.0, 550.0, 700.0])  # [nm] of packed spectra, as in spectral.cl
LARGEST = 2**31 - 1  # words in `images` that an index reaches
THREADS = 8
UNKNOWN, NEW, PACKED = range(3)
CHUNK = 1 << 17  # texels of an image that are packed at a time
RUN = 64  # neighbouring colours with a common row in the table of packed spectra


@dataclass
class _Form:
    """The form of an image, without its pixels.

    shape: (h, w, c); bytes: whether its numbers are bytes; encoded: see `Stored.encoded`; profiled:
    whether its colours are floats without a transfer function; notes: warnings about the image as
    raw data, and as colours.
    """

    shape: tuple[int, ...]
    bytes: bool
    encoded: bool
    profiled: bool
    notes: dict[bool, tuple[str, ...]]


class _Pixels:
    """The pixels of an image; a file is decoded in a thread, and forgotten when packed."""

    def __init__(self, image: Any):
        self._image = image
        self._stored: Future[Stored] | None = None
        self._form: _Form | None = None
        self._is_file = image_file(image) is not None
        self.begin()

    def begin(self) -> None:
        """Take the pixels of an array, or begin to read those of a file."""
        if self._is_file:
            self._stored = _pool(os.getpid()).submit(
                budget.carried(images.read_stored), self._image
            )
        else:
            self._stored = Future()
            self._stored.set_result(images.from_array(self._image, "bitmap.image"))

    @property
    def stored(self) -> Stored:
        """The image; it is read again after `let_go`. Raises SceneError."""
        if self._stored is None:
            self.begin()
        assert self._stored is not None
        return self._stored.result()

    @property
    def form(self) -> _Form:
        """The form of the image, also after `let_go`. Raises SceneError."""
        if self._form is None:
            stored = self.stored
            self._form = _Form(
                stored.values.shape,
                stored.values.dtype == np.uint8,
                stored.encoded,
                stored.is_profiled,
                {raw: stored.notes_of(raw) for raw in (False, True)},
            )
        return self._form

    def let_go(self) -> None:
        """Forget the pixels of a file."""
        if self._is_file and self._form is not None:
            self._stored = None


@dataclass
class _Packed:
    """The words of an image, later a view of the joined table; size: height and width.

    levels (n, 3): first word, width and height of each level, the first is the image itself; notes:
    warnings about its values.
    """

    words: Words
    size: tuple[int, ...]
    levels: NDArray[np.int64] | None = None
    notes: list[str] = field(default_factory=list)


@dataclass
class _Image:
    """An image in a role, and the rows of `textures` that show it."""

    texture: Bitmap
    role: Role
    pixels: _Pixels
    rows: list[np.ndarray] = field(default_factory=list)
    halvings: int = 0

    @property
    def has_levels(self) -> bool:
        return has_levels(self.texture, self.role)

    @property
    def form(self) -> _Form:
        """The form of the image as raw data or as colours, as the texture asks."""
        form = self.pixels.form
        if self.texture.raw or not form.profiled:
            return form
        return replace(form, bytes=False, encoded=False)


class Images:
    """The images of a scene, each in its roles; `finish` appends them to the tables.

    budget: [bytes] of all images, None for any number; cache: of decoded and packed images.
    """

    def __init__(
        self, spectral: bool, budget: int | None = None, cache: LoweringCache | None = None
    ):
        self.spectral, self.budget, self.cache = spectral, budget, cache or LoweringCache()
        self._wanted: dict[Any, _Image] = {}
        self._decoding: dict[bool, int] = {}
        self._placed: list[tuple[int, _Packed]] = []  # the first word of each in the table
        self._spectra: dict[bool, _Spectra] = defaultdict(_Spectra)

    def add(self, texture: Bitmap, role: Role, row: np.ndarray) -> None:
        """Ask for an image; `finish` writes its first word into the texture's row.

        Raises SceneError for a value that is no image.
        """
        channel_of = role is REAL and texture.channel
        levels = has_levels(texture, role)
        key = (texture.image_key, texture.raw, role, channel_of, levels)
        if key not in self._wanted:
            spectral = texture.spectral(role)
            image = texture.image if spectral is None else spectral.to_rgb()
            self._wanted[key] = _Image(texture, role, self._read(image))
        self._wanted[key].rows.append(row)

    def finish(self, store: TableStore, roles: set[tuple[str, str]]) -> list[str]:
        """Append the images that were asked for; return warnings.

        roles: the (kind, role) pairs of the images are added to it. Raises SceneError for files
        that cannot be read.
        """
        wanted, self._wanted = list(self._wanted.values()), {}
        notes = [*_left_out(wanted), *self._fit(wanted)]
        for image in wanted:
            roles.add((self._put(image, store), image.role.name))
            notes += self._packed(image).notes
        for image in wanted:
            image.pixels.let_go()
        self._spectra.clear()
        return notes

    def _put(self, image: _Image, store: TableStore) -> str:
        """Append an image, and write its first word into its rows; return its kind."""
        packed = self._packed(image)
        height, width = packed.size
        bytes_ = _packs(image.form, image, self.spectral)
        kind = "packed_bitmap" if bytes_ else "bitmap"
        if image.has_levels:
            kind = next(name for name, level in MIPS.items() if level == kind)
        if store.size("images") + packed.words.size > LARGEST:
            raise SceneError("all images together have too many texels", where="bitmap.image")
        curved = image.form.encoded and not image.texture.raw and not _is_alpha(image)
        for row in image.rows:
            row["kind"], row["width"], row["height"] = KINDS.index(kind), width, height
            row["decode"] = self._decode(curved, store) if bytes_ else 0
        first = store.append("images", packed.words)
        self._placed.append((first, packed))
        for row in image.rows:
            row["first"] = first
        if packed.levels is not None:
            table = np.add(packed.levels, (first, 0, 0)).astype(np.uint32)
            at = store.append("textures", table.reshape(-1))
            for row in image.rows:
                row["levels"], row["table"] = len(table), at
        return kind

    def _packed(self, image: _Image) -> _Packed:
        """Return the words of an image, from the cache if nothing differs."""
        texture = image.texture
        by = (
            *(version(texture.image), texture.raw, image.role, texture.channel),
            *(image.halvings, self.spectral, image.has_levels),
        )
        packed: _Packed = self.cache(Images._words, self, image, by=by)
        return packed

    def joined(self, table: Words) -> None:
        """Keep the words of the images as views of the joined table."""
        for first, packed in self._placed:
            packed.words = table[first : first + packed.words.size]

    def _words(self, image: _Image) -> _Packed:
        """Return the words of an image: level by level, row by row from the top."""
        texture, stored = image.texture, image.pixels.stored.meant(image.texture.raw)
        packs = _packs(image.form, image, self.spectral)
        values = checked(stored.values, "bitmap.image")
        curved = stored.encoded and not texture.raw
        if image.halvings:
            values = _halved(values, curved, image.halvings)
        if not image.has_levels:
            return self._level(image, values, curved, packs)
        levels = [self._level(image, level, curved, packs) for level in _levels(values, curved)]
        firsts = np.cumsum([0, *(level.words.size for level in levels[:-1])])
        table = [(at, *level.size[::-1]) for at, level in zip(firsts, levels, strict=True)]
        words = np.concatenate([level.words for level in levels])
        return _Packed(words, levels[0].size, np.array(table, np.int64))

    def _level(self, image: _Image, values: NDArray[Any], curved: bool, packs: bool) -> _Packed:
        """Return the words of a level of an image.

        curved: the bytes are encoded; packs: they stay bytes.
        """
        budget.check_time()
        texture, role, size = image.texture, image.role, values.shape[:2]
        if role is REAL and packs:
            number = "rgba".find(texture.channel) if values.shape[2] > 1 else 0
            if texture.channel == "a" and values.shape[2] < 4:
                return _Packed(np.full(1, 0xFFFFFFFF, np.uint32), (1, 1))
            chosen = values[..., number].reshape(-1)
            return _Packed(np.pad(chosen, (0, -len(chosen) % 4)).view("<u4"), size)
        if packs:
            codes = _codes(values)
            words = self._spectra[curved].packed(codes, curved) if self.spectral else codes
            return _Packed(words, size)
        decoded = Stored(values, curved).decoded()
        if role is REAL:
            numbers = np.nan_to_num(channel(decoded, texture.channel).astype(np.float32))
            return _Packed(texel_words(numbers, role, self.spectral), size)
        is_light = role is EMISSION and texture.spectral(role) is None  # else colours of spectra
        name = image_file(texture.image) or "bitmap.image"
        notes = negative_notes(decoded[..., :3], name) if is_light else []
        words = texel_words(np.nan_to_num(decoded[..., :3]), role, self.spectral)
        return _Packed(words, size, notes=notes)

    def _read(self, image: object) -> _Pixels:
        """Return the pixels of an image; a file is decoded once."""
        file = image_file(image)
        return _Pixels(image) if file is None else self.cache(_Pixels, file, by=(version(file),))

    def _decode(self, curved: bool, store: TableStore) -> int:
        """Return the first of the 256 words that decode bytes."""
        if curved not in self._decoding:
            self._decoding[curved] = store.append("images", _meaning(curved).view(np.uint32))
        return self._decoding[curved]

    def _fit(self, wanted: list[_Image]) -> list[str]:
        """Halve the largest images until all fit into the budget."""
        if self.budget is None:
            return []
        sizes = [_size(image, self.spectral) for image in wanted]
        total = sum(sizes)
        while total > self.budget and sizes:
            worst = int(np.argmax(sizes))
            before = sizes[worst]
            wanted[worst].halvings += 1
            sizes[worst] = _size(wanted[worst], self.spectral)
            total += sizes[worst] - before
            if sizes[worst] == before:
                break  # single texels
        return [_note(image) for image in wanted if image.halvings]


def has_levels(texture: Bitmap, role: Role) -> bool:
    """Return whether an image has smaller copies in a role: lights are sampled by the image."""
    return texture.filter == "trilinear" and role is not EMISSION


@cache
def _pool(process: int) -> ThreadPoolExecutor:
    """Return the threads of a process, by its id: a fork has none of its parent's threads."""
    return ThreadPoolExecutor(min(THREADS, os.cpu_count() or 1), "clpt-images")


def _is_alpha(image: _Image) -> bool:
    return image.role is REAL and image.texture.channel == "a"


def _packs(form: _Form, image: _Image, spectral: bool) -> bool:
    """Return whether bytes stay bytes on the device."""
    if not form.bytes:
        return False
    if image.role is REAL:
        return form.shape[2] == 1 or image.texture.channel != "luminance"
    return not spectral or image.role is REFLECTANCE


def _size(image: _Image, spectral: bool) -> int:
    """Return the bytes of an image on the device."""
    form = image.form
    height, width = (max(1, -(-n >> image.halvings)) for n in form.shape[:2])
    packed = _packs(form, image, spectral)
    if image.role is REAL:
        texel = 1 if packed else 4
    elif packed:
        texel = 8 if spectral else 4
    else:
        texel = 16 if spectral else 12
    sizes = _level_sizes(height, width) if image.has_levels else [(height, width)]
    return sum(h * w for h, w in sizes) * texel


def _left_out(wanted: Iterable[_Image]) -> list[str]:
    """Return warnings of parts of image files that are left out, without repetition."""
    notes = [
        f"{image.texture.image}: {note}"
        for image in wanted
        for note in image.pixels.form.notes[image.texture.raw]
    ]
    return list(dict.fromkeys(notes))


def _note(image: _Image) -> str:
    height, width = image.pixels.form.shape[:2]
    small = " x ".join(str(max(1, -(-n >> image.halvings))) for n in (width, height))
    name = image_file(image.texture.image) or "an image"
    return f"{name}: {width} x {height} texels made {small}, to keep to the texture budget"


def _meaning(curved: bool) -> NDArray[np.float32]:
    """Return the values (256,) that bytes stand for; curved: encoded as by sRGB."""
    return Stored(np.arange(256, dtype=np.uint8).reshape(-1, 1, 1), curved).decoded().reshape(-1)


def _halved(values: NDArray[Any], curved: bool, times: int) -> NDArray[Any]:
    """Return means of 2x2 texels of linear light, `times` over; bytes become bytes again."""
    linear = Stored(values, curved).decoded()
    for _ in range(times):
        budget.check_time()
        odd = [(0, n % 2 if n > 1 else 0) for n in linear.shape[:2]]
        linear = np.pad(linear, (*odd, (0, 0)), "edge")
        linear = linear if linear.shape[0] == 1 else 0.5 * (linear[0::2] + linear[1::2])
        linear = linear if linear.shape[1] == 1 else 0.5 * (linear[:, 0::2] + linear[:, 1::2])
    return _stored_as(values, linear, curved)


def _level_sizes(height: int, width: int) -> list[tuple[int, int]]:
    """Return heights and widths of an image's levels: halves, rounded down, to a single texel."""
    count = max(height, width).bit_length()
    return [(max(height >> i, 1), max(width >> i, 1)) for i in range(count)]


def _levels(values: NDArray[Any], curved: bool) -> list[NDArray[Any]]:
    """Return an image (h, w, c) and its smaller copies.

    A texel is the mean of linear light over its area in the level before. A texel there counts by
    the share of its area, so all levels have the same mean.
    """
    linear, levels = Stored(values, curved).decoded(), [values]
    for height, width in _level_sizes(*values.shape[:2])[1:]:
        linear = _means(_means(linear, height).swapaxes(0, 1), width).swapaxes(0, 1)
        levels.append(_stored_as(values, linear, curved))
    return levels


def _means(values: NDArray[Any], count: int) -> NDArray[Any]:
    """Return means of `count` equal parts of the first axis."""
    n = len(values)
    if n == count:
        return values
    if n == 2 * count:
        means = np.empty((count, *values.shape[1:]), values.dtype)
        rows = max(CHUNK // max(values[0].size, 1), 1)
        for first in budget.steps(range(0, count, rows)):
            part = slice(first, first + rows)
            means[part] = 0.5 * (values[0::2][part] + values[1::2][part])
        return means
    edges = np.arange(count + 1) * (n / count)
    sums = np.concatenate([np.zeros_like(values[:1], np.float64), values.cumsum(0, np.float64)])
    below = np.minimum(edges.astype(int), n - 1)
    share = (edges - below).reshape(-1, *(1,) * (values.ndim - 1))
    at = sums[below] + share * values[below]
    return ((at[1:] - at[:-1]) * (count / n)).astype(values.dtype)


def _stored_as(values: NDArray[Any], linear: NDArray[Any], curved: bool) -> NDArray[Any]:
    """Return linear values in the form of `values`: encoded if curved, bytes if `values` are."""
    stored = images.linear_to_srgb(linear) if curved else linear
    if values.dtype != np.uint8 and not curved:
        return linear
    if values.shape[2] == 4:
        stored[..., 3] = linear[..., 3]
    if values.dtype != np.uint8:
        return stored
    return np.round(np.clip(stored, 0.0, 1.0) * 255.0).astype(np.uint8)


def _codes(values: NDArray[np.uint8]) -> Words:
    """Return words (n,) with r, g and b of each texel in the three lower bytes."""
    channels = np.zeros((values.shape[0] * values.shape[1], 4), np.uint8)
    for i in range(3):
        channels[:, i] = values[..., i % values.shape[2]].reshape(-1)
    return channels.view("<u4").reshape(-1)


class _Spectra:
    """Packed spectra of colours of 8 bits a channel; images share them."""

    def __init__(self) -> None:
        self.places = np.zeros((1 << 24) // RUN, np.uint32)  # a run's row; 0: no row
        self.runs = np.zeros(1, np.uint32)  # a row's run
        self.states = np.zeros(RUN, np.uint8)  # each colour of a row: UNKNOWN, NEW or PACKED
        self.words = np.zeros(RUN, np.uint64)

    def packed(self, codes: Words, curved: bool) -> Words:
        """Return two words for each colour of `_codes`, (2 n,)."""
        parts = np.split(codes, range(CHUNK, len(codes), CHUNK))
        self._add_rows(parts)
        for part in budget.steps(parts):
            at = self._at(part)
            self.states[at[self.states[at] == UNKNOWN]] = NEW
        self._pack(np.flatnonzero(self.states == NEW), curved)
        words = np.empty(len(codes), np.uint64)
        for first, part in zip(range(0, len(codes), CHUNK), budget.steps(parts), strict=True):
            words[first : first + CHUNK] = self.words[self._at(part)]
        return words.view(np.uint32)

    def _pack(self, new: NDArray[np.intp], curved: bool) -> None:
        """Pack the spectra of new colours (n), by their indices in `states`."""
        meaning = _meaning(curved)
        for first in range(0, len(new), CHUNK):
            at = new[first : first + CHUNK]
            colours = self.runs[at // RUN] * np.uint32(RUN) + (at % RUN).astype(np.uint32)
            channels = np.stack([colours & 255, colours >> 8 & 255, colours >> 16], axis=1)
            self.words[at] = pack(spectra.uplift(meaning[channels])).view(np.uint64).reshape(-1)
            self.states[at] = PACKED

    def _at(self, codes: Words) -> Words:
        """Return the indices of colours in `states` and `words`; their runs must have rows."""
        return self.places[codes // np.uint32(RUN)] * np.uint32(RUN) + codes % np.uint32(RUN)

    def _add_rows(self, parts: list[Words]) -> None:
        """Add rows for new runs of colours; a table of all runs would be slow to clear."""
        seen = np.zeros(len(self.places), bool)
        for part in parts:
            seen[part // np.uint32(RUN)] = True
        runs = np.flatnonzero(seen & (self.places == 0)).astype(np.uint32)
        self.places[runs] = np.arange(len(self.runs), len(self.runs) + len(runs), dtype=np.uint32)
        self.runs = np.concatenate([self.runs, runs])
        needed = RUN * len(self.runs)
        if needed > len(self.words):
            self.states = _longer(self.states, max(needed, 2 * len(self.states)))
            self.words = _longer(self.words, max(needed, 2 * len(self.words)))


def _longer(array: NDArray[Any], size: int) -> NDArray[Any]:
    """Return an array (n,) with zeros after it, (size,)."""
    padded = np.zeros(size, array.dtype)
    padded[: len(array)] = array
    return padded


def pack(coefficients: NDArray[np.float32]) -> Words:
    """Return sigmoid coefficients (n, 3) as two words each (n, 2): x at NODES, of 21 bits.

    The upper 21 bits of the words hold the first two nodes. The 10 and 11 lower bits that remain
    hold the third.
    """
    c = coefficients.astype(np.float64)[:, :, None]
    x = ((c[:, 0] * NODES + c[:, 1]) * NODES + c[:, 2]).astype(np.float32)
    bits = x.view(np.uint32) + np.uint32(0x400)  # to the nearest
    upper = bits & np.uint32(0xFFFFF800)
    third = bits[:, 2] >> np.uint32(11)
    first, second = upper[:, 0] | third >> np.uint32(10), upper[:, 1] | third & np.uint32(0x3FF)
    return np.stack([first, second], axis=1).astype(np.uint32)
