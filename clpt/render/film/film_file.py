"""Films as files, `NAME.film` and `NAME.resume.exr`, with a checksum as their seal.

A file is an OpenEXR image of several parts. The first part is the picture so far, which any viewer
opens; its attribute `clpt` holds the film's origin, form and sessions in JSON. The other parts hold
words as channels of type UINT: the film's words, a channel each, and the state of adaptive
sampling. A seal of fixed length ends the file: SEAL, the number of bytes before it, and their
SHA-256. The reader checks it first.
"""

from __future__ import annotations

import dataclasses
import hashlib
import itertools
import json
import math
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import OpenEXR
from numpy.typing import NDArray

from clpt.choices import MOST_SAMPLES
from clpt.errors import SceneError
from clpt.files import input_files, output_files
from clpt.images import exr_files
from clpt.render.film.pictures import PictureForm
from clpt.render.film.saved_film import Origin, SavedFilm, Session
from clpt.render.film.state import FilmState
from clpt.render.records.film import LayerNames
from clpt.scene.fingerprint import Fingerprint
from clpt.spectra.spaces import chromaticities

_Parts = Mapping[str, Mapping[str, NDArray[np.uint32]]]  # channels by name, of parts by name

FORMAT = 2  # format 1 had lists of length 1 of films and of counts
ATTRIBUTE = "clpt"
SUFFIXES = (".film", ".exr")
SEAL = b"clpt film"
SEAL_BYTES = len(SEAL) + 8 + 32
EXR_MAGIC = b"\x76\x2f\x31\x01"
PIECE = 1 << 20  # bytes of a read
ROW = 1024  # words of a row of an array that is no picture
HALF_MAX = 65504.0
LOST = "it was not written to its end, or was damaged later"
ADVICE = "use a copy, or render it again"


def write(path: str | Path, saved: SavedFilm) -> None:
    """Write a film; replace an existing file.

    Raises OSError; the existing file is then unchanged.
    """
    with output_files.replacing(path) as partial:
        parts = [_picture(saved), *_words(saved), *_arrays(saved)]
        try:
            exr_files.write_parts(partial, parts)
        except RuntimeError as error:
            raise OSError(f"cannot be written: {error}") from error
        with partial.open("r+b") as file:
            size = file.seek(0, os.SEEK_END)
            file.write(SEAL + size.to_bytes(8, "little") + _hashed(file, size))


def read(path: str | Path) -> SavedFilm:
    """Read a film, equal to the bit to the film that was written.

    Raises SceneError for a file that does not exist, is no film, is damaged, or comes from a later
    version of clpt.
    """
    path = Path(path)
    with _as_scene_errors(path):
        return _restored(*_stored(path))


def read_header(path: str | Path) -> dict[str, Any]:
    """Return the JSON of a film file, without its words. Raises as `read` does."""
    path = Path(path)
    with _as_scene_errors(path):
        return _stored(path, header_only=True)[0]


def _stored(path: Path, **options: bool) -> tuple[dict[str, Any], _Parts]:
    """Check the seal of a file; return its JSON, and its parts but for the picture."""
    _check_seal(path)
    with exr_files.opened(path, **options) as stored:
        header = _header(path, stored[0].header.get(ATTRIBUTE))
        parts = {
            part.name(): {name: channel.pixels for name, channel in part.channels.items()}
            for part in stored[1:]
        }
    return header, parts


@contextmanager
def _as_scene_errors(path: Path) -> Iterator[None]:
    """Raise SceneError for any error within: of a file with a seal that clpt did not write."""
    try:
        yield
    except SceneError:
        raise
    except Exception as error:
        message = str(error).splitlines()[0] if str(error) else ""
        _fail(path, f"no readable film: {type(error).__name__}: {message}")


def _check_seal(path: Path) -> None:
    """Raise SceneError for a file that differs from the written file in any bit."""
    try:
        with input_files.opened(path) as file:
            size = file.seek(0, os.SEEK_END)
            file.seek(0)
            is_exr = file.read(len(EXR_MAGIC)) == EXR_MAGIC
            file.seek(max(size - SEAL_BYTES, 0))
            seal = file.read()
            if not seal.startswith(SEAL) or len(seal) != SEAL_BYTES:
                problem = f"a picture without a film, or {LOST}" if is_exr else "not a film of clpt"
                _fail(path, f"{problem}: {ADVICE}")
            length, digest = seal[len(SEAL) :][:8], seal[-32:]
            if int.from_bytes(length, "little") != size - SEAL_BYTES:
                _fail(path, f"its length is wrong: {LOST}: {ADVICE}")
            if _hashed(file, size - SEAL_BYTES) != digest:
                _fail(path, f"its checksum is wrong: it was damaged later: {ADVICE}")
    except OSError as error:
        _fail(path, f"cannot be read: {error.strerror}")


def _hashed(file: Any, size: int) -> bytes:
    """Return the SHA-256 of the first `size` bytes of a file; leave the file at its end."""
    hashed = hashlib.sha256()
    file.seek(0)
    while size > 0 and (piece := file.read(min(PIECE, size))):
        hashed.update(piece)
        size -= len(piece)
    file.seek(0, os.SEEK_END)
    return hashed.digest()


def _fail(path: Path, message: str) -> NoReturn:
    raise SceneError(message, file=path)


def _header(path: Path, text: object) -> dict[str, Any]:
    """Return the attribute's JSON in the present format. Raises SceneError."""
    if not isinstance(text, str):
        _fail(path, "not a film of clpt: its header does not say what it is of")
    header = json.loads(text)
    if header["format"] > FORMAT:
        _fail(
            path,
            f"its format is {header['format']}, of clpt {header['clpt']}; this clpt reads "
            f"{FORMAT} and older: use a newer clpt",
        )
    if header["format"] == 1:
        del header["shapes"]["words"][0]
        (header["counts"],) = header["counts"]
    _check_ranges(path, header["taken"])
    return dict(header)


def _check_ranges(path: Path, taken: list[list[int]]) -> None:
    """Raise SceneError for ranges of samples that no render takes."""
    ends = [-1, *(number for span in taken for number in span), MOST_SAMPLES + 1]
    if not all(a < b for a, b in itertools.pairwise(ends)):
        message = "no film of clpt: its ranges of samples must ascend, be apart, and lie within "
        _fail(path, f"{message}0 to {MOST_SAMPLES}, not {taken}")


def _picture(saved: SavedFilm) -> Any:
    """Return the first part: the picture so far, and the film's JSON."""
    form, pixels = saved.form, saved.developed().picture()
    letters = "RGBA"[: pixels.shape[2]]
    stored = np.clip(np.nan_to_num(pixels), -HALF_MAX, HALF_MAX).astype(np.float16)
    channels = {n: np.ascontiguousarray(stored[..., i]) for i, n in enumerate(letters)}
    header = {
        **_header_of_part(saved, OpenEXR.ZIP_COMPRESSION),
        "chromaticities": chromaticities(form.output_space),
        ATTRIBUTE: json.dumps(_header_of(saved)),
    }
    return OpenEXR.Part(header, channels, "picture")


def _header_of(saved: SavedFilm) -> dict[str, Any]:
    state = saved.film
    return {
        "format": FORMAT,
        "clpt": saved.origin.clpt,
        "taken": [list(samples) for samples in state.taken],
        "scale": state.scale,
        "shapes": {name: array.shape for name, array in state.arrays.items()},
        "scene": dict(saved.origin.scene.values),
        "settings": dict(saved.origin.settings),
        "kernels": saved.origin.kernels,
        "form": dataclasses.asdict(saved.form),
        "counts": dict(saved.counts),
        "sessions": [dataclasses.asdict(session) for session in saved.sessions],
        "adaptive": {n: [a.dtype.str, a.shape] for n, a in saved.adaptive.items()},
    }


def _header_of_part(saved: SavedFilm, compression: object) -> dict[str, Any]:
    """Return the header of every part: all parts of a file share a display window."""
    height, width = saved.film.words.shape[-2:]
    window = np.zeros(2, np.int32), np.array([width - 1, height - 1], np.int32)
    return {"compression": compression, "type": OpenEXR.scanlineimage, "displayWindow": window}


def _words(saved: SavedFilm) -> Iterator[Any]:
    """Yield the parts of the film's arrays that are not empty; each plane is a channel."""
    for name, planes in saved.film.arrays.items():
        planes = planes.reshape(-1, *planes.shape[-2:])
        if len(planes):
            yield _part(saved, name, {f"{i:05d}": plane for i, plane in enumerate(planes)})


def _arrays(saved: SavedFilm) -> Iterator[Any]:
    """Yield a part for each array of adaptive sampling; its rows have ROW words."""
    for name, array in saved.adaptive.items():
        words = np.ascontiguousarray(array).reshape(-1).view(np.uint32)
        rows = np.zeros((max(-(-len(words) // ROW), 1), ROW), np.uint32)
        rows.reshape(-1)[: len(words)] = words
        yield _part(saved, f"adaptive.{name}", {"0": rows})


def _part(saved: SavedFilm, name: str, channels: Mapping[str, NDArray[np.uint32]]) -> Any:
    header = _header_of_part(saved, OpenEXR.RLE_COMPRESSION)
    stored = {n: np.ascontiguousarray(plane, np.uint32) for n, plane in channels.items()}
    return OpenEXR.Part(header, stored, name)


def _restored(header: dict[str, Any], parts: _Parts) -> SavedFilm:

    def words(name: str) -> NDArray[np.uint32]:
        shape = tuple(header["shapes"][name])
        if not math.prod(shape):
            return np.zeros(shape, np.uint32)
        planes = [parts[name][f"{i:05d}"] for i in range(math.prod(shape[:-2]))]
        return np.stack(planes).astype(np.uint32, copy=False).reshape(shape)

    def array(name: str, kind: str, shape: list[int]) -> NDArray[Any]:
        dtype = np.dtype(kind)
        stored = parts[f"adaptive.{name}"]["0"].reshape(-1)
        size = math.prod(shape) * dtype.itemsize // 4
        return stored[:size].copy().view(dtype).reshape(shape)

    form = {"adaptive": bool(header["adaptive"]), **header["form"]}
    rows = {name: tuple(map(tuple, form[name])) for name in ("to_output", "paper")}
    names: dict[str, Any] = {"layers": tuple(form["layers"])}
    names["names"] = LayerNames(**{n: tuple(v) for n, v in form.get("names", {}).items()})
    names["place"] = tuple(form["place"]) if form.get("place") else None
    taken = tuple((int(first), int(end)) for first, end in header["taken"])
    return SavedFilm(
        film=FilmState(
            taken=taken, scale=float(header["scale"]), **{n: words(n) for n in header["shapes"]}
        ),
        origin=Origin(
            Fingerprint(header["scene"]), header["settings"], header["kernels"], header["clpt"]
        ),
        form=PictureForm(**{**form, **rows, **names}),
        counts=header["counts"],
        sessions=tuple(Session(**session) for session in header["sessions"]),
        adaptive={n: array(n, *about) for n, about in header["adaptive"].items()},
    )
