"""Films as files, `NAME.film` and `NAME.resume.exr`, with a checksum as their seal.

A file is an OpenEXR image of several parts. The first part is the picture so far, which any viewer
opens; its attribute `clpt` holds the film's origin, form and sessions in JSON. The other parts hold
words as channels of type UINT: the film's words, a channel each, and the state of adaptive
sampling. A seal of fixed length ends the file: SEAL, the number of bytes before it, and their
SHA-256. The reader checks it first. A film's file continues it: it has the origin of its samples
and the sessions of rendering.
"""

from __future__ import annotations

import dataclasses
import hashlib
import itertools
import json
import math
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import OpenEXR
from numpy.typing import NDArray

from clpt.choices import MOST_SAMPLES
from clpt.errors import SceneError
from clpt.files import input_files, output_files
from clpt.images import exr_files
from clpt.render.film.developed import Developed
from clpt.render.film.pictures import PictureForm, Pictures
from clpt.render.film.state import FilmState, Ranges
from clpt.render.records.film import LayerNames
from clpt.scene import integrators
from clpt.scene.fingerprint import Fingerprint, Plain
from clpt.scene.integrators import Integrator, Vcm
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


MOST_NAMED = 8  # differences that an error names


@dataclass(frozen=True)
class Session:
    """A session of rendering: a process added samples to a film.

    began: ISO 8601 in UTC; seconds: of rendering; clpt: its version; device: label, driver, lanes
    of its kernels and layout of its trees; the last bits depend on them.
    """

    began: str
    seconds: float
    clpt: str
    device: Mapping[str, Plain]


@dataclass(frozen=True)
class Origin:
    """The origin of a film's samples.

    scene: its fingerprint; settings: choices that were made for it, such as the integrator of
    `auto`; kernels: the digest of their texts; clpt: the version that has these kernels.
    """

    scene: Fingerprint
    settings: Mapping[str, Plain]
    kernels: str
    clpt: str

    def differences(self, other: Origin) -> list[str]:
        """Return why the samples of another film differ, such as "seed: 0 -> 3"."""
        differences = self.scene.differences(other.scene)
        differences += Fingerprint(self.settings).differences(Fingerprint(other.settings))
        if self.kernels != other.kernels:
            differences.append(f"kernels: of clpt {self.clpt} -> others, of clpt {other.clpt}")
        return differences

    @property
    def chosen_integrator(self) -> Integrator | None:
        """The integrator, without its depths, that `auto` may have chosen; else None."""
        names = ("integrator", "light_paths", "guide_paths", "reuse")
        kind, paths, guide, reuse = (self.settings.get(f"chosen.{name}") for name in names)
        if kind == Vcm.kind:
            return Vcm(light_paths=int(paths or 1))
        if kind == integrators.Path.kind:
            count = int(guide or 0)
            return integrators.Path(
                light_paths=float(paths or 0),
                guiding=count > 0,
                guide_paths=count,
                reuse=bool(reuse),
            )
        return None

    def check_same(self, other: Origin) -> None:
        """Raise SceneError, which names the differences, if samples of another film differ."""
        if differences := self.differences(other):
            raise SceneError(f"the film is of something else: {differences_text(differences)}")


@dataclass(frozen=True, eq=False)
class SavedFilm(Pictures):
    """A film with all that continues it, as `Renderer.save_state` writes it.

    form: how its words become pictures; counts: of paths and rays, by name; sessions: of rendering;
    adaptive: arrays of the state of adaptive sampling by name, empty without it.
    """

    film: FilmState
    origin: Origin
    form: PictureForm
    counts: Mapping[str, int]
    sessions: tuple[Session, ...]
    adaptive: Mapping[str, NDArray[Any]]

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        """Restore a pickle; in old pickles `counts` is a tuple of length 1."""
        self.__dict__.update(state)
        if isinstance(state["counts"], tuple):
            (self.__dict__["counts"],) = state["counts"]

    def developed(self, *words: str) -> Developed:
        """Return the pictures of the film."""
        return Developed(self.film, self.form)

    def check_fits(self, origin: Origin, film: FilmState) -> None:
        """Raise SceneError if its samples have another origin, or `film` has other shapes."""
        self.origin.check_same(origin)
        saved = self.film.arrays
        if any(array.shape != saved[name].shape for name, array in film.arrays.items()):
            raise SceneError("the film has another form than this scene's")

    def saved_film(self, *, held: bool = False) -> SavedFilm:
        """Return itself; held: has a meaning only for renderers."""
        return self

    @property
    def seconds(self) -> float:
        """The time that all sessions have rendered [s]."""
        return sum(session.seconds for session in self.sessions)

    def merged(self, other: SavedFilm) -> SavedFilm:
        """Return the film of the samples of both.

        Raises SceneError if their origins differ, or a sample is in both.
        """
        self.origin.check_same(other.origin)
        counts = {name: value + other.counts[name] for name, value in self.counts.items()}
        return dataclasses.replace(
            self,
            film=self.film.merged(other.film),
            form=dataclasses.replace(self.form, adaptive=self.form.adaptive or other.form.adaptive),
            counts=counts,
            sessions=(*self.sessions, *other.sessions),
            adaptive={},
        )


def other_devices(sessions: Iterable[Session], device: Mapping[str, Plain]) -> list[str]:
    """Return how the devices of a film's sessions differ from `device`; empty if they do not."""
    named: dict[str, None] = {}
    for session in sessions:
        for name, value in session.device.items():
            if value != device.get(name):
                named[f"{name}: {value} -> {device.get(name)}"] = None
    return list(named)


def classes_text(others: list[str]) -> str:
    """Return a warning that names the differences from `other_devices`."""
    return "samples of several classes of devices are in one film: " + "; ".join(others)


def differences_text(differences: list[str]) -> str:
    """Return differences for people, at most MOST_NAMED of them."""
    more = len(differences) - MOST_NAMED
    return "; ".join(differences[:MOST_NAMED]) + (f"; and {more} more" if more > 0 else "")


def ranges_text(taken: Ranges) -> str:
    """Return ranges of samples for people, such as "0 to 1023"."""
    return ", ".join(f"{first} to {end - 1}" for first, end in taken) or "none"
