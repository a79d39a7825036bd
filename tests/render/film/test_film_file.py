"""Film files: exact, and whatever is wrong with one is told before it is read."""

from __future__ import annotations

import copy
import json
import pickle
import random
import resource
import signal
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

import clpt
from clpt.errors import SceneError
from clpt.render.film import film_file
from clpt.render.film.film_file import Origin, SavedFilm, Session
from clpt.render.film.pictures import PictureForm
from clpt.render.film.state import FilmState
from clpt.scene.fingerprint import Fingerprint

FLIPS = 2000


def made(words: tuple = (1, 10, 4, 5), bands: tuple = (1, 0, 3, 4, 5)) -> SavedFilm:
    """A film of random words."""
    rng = np.random.default_rng(1)
    state = FilmState(
        rng.integers(0, 2**32, words, np.uint32),
        rng.integers(0, 2**32, bands, np.uint32),
        ((0, 7), (9, 2**31 - 1)),
        2.0**-12,
    )
    origin = Origin(
        Fingerprint({"seed": 0, "film.crop": None, "camera.fov": 0.1 + 0.2, "a": "\u00fc"}),
        {"halves": words[0] == 2}, "abc", "0.1.0",
    )  # fmt: skip
    form = PictureForm(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), bands=bands[1])
    adaptive = {
        "noise": np.array(0.02),
        "stop": rng.integers(0, 2**62, 2500),
        "variance": rng.random((3, 7), np.float32),
        "dark": np.zeros(0),
    }
    session = Session("2026-01-01T00:00:00+00:00", 1.5, "0.1.0", {"device": "x", "lanes": 8})
    return SavedFilm(state, origin, form, {"samples": 140}, (session,), adaptive)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    film_file.write(tmp_path / "a.film", made())
    return tmp_path / "a.film"


def check_same(one: SavedFilm, other: SavedFilm) -> None:
    np.testing.assert_array_equal(one.film.words, other.film.words)
    np.testing.assert_array_equal(one.film.bands, other.film.bands)
    assert one.film.taken == other.film.taken and one.film.scale == other.film.scale
    for name in ("origin", "form", "counts", "sessions"):
        assert getattr(one, name) == getattr(other, name)
    assert one.adaptive.keys() == other.adaptive.keys()
    for name, array in one.adaptive.items():
        assert array.dtype == other.adaptive[name].dtype
        np.testing.assert_array_equal(array, other.adaptive[name])


@pytest.mark.parametrize(
    ("words", "bands"),
    [
        ((1, 10, 4, 5), (1, 0, 3, 4, 5)),
        ((2, 26, 1, 1), (2, 9, 3, 1, 1)),
        ((1, 13, 3, 70), (1, 0, 3, 3, 70)),
    ],
)
def test_what_is_read_is_what_was_written(tmp_path: Path, words, bands):
    film = made(words, bands)
    film_file.write(tmp_path / "a.exr", film)
    check_same(film_file.read(tmp_path / "a.exr"), film)
    assert film_file.read_header(tmp_path / "a.exr")["taken"] == [[0, 7], [9, 2**31 - 1]]


def test_films_of_format_1_are_read(tmp_path: Path, monkeypatch):
    """Their words have a row of films, always one, and their counts are in a list."""
    film, header_of = made(), film_file._header_of

    def of_format_1(saved: SavedFilm) -> dict:
        header = header_of(saved)
        header |= {"format": 1, "counts": [header["counts"]]}
        header["shapes"]["words"] = (1, *header["shapes"]["words"])
        return header

    monkeypatch.setattr(film_file, "_header_of", of_format_1)
    film_file.write(tmp_path / "a.film", film)
    check_same(film_file.read(tmp_path / "a.film"), film)
    header = film_file.read_header(tmp_path / "a.film")
    assert header["shapes"]["words"] == [1, 10, 4, 5] and header["counts"] == {"samples": 140}


def test_pickles_of_always_one_film_are_read():
    film = made()
    check_same(pickle.loads(pickle.dumps(film)), film)
    old, state = copy.copy(film), copy.copy(film.film)
    state.__dict__["words"] = state.words[None]
    old.__dict__.update(film=state, counts=(film.counts,))
    check_same(pickle.loads(pickle.dumps(old)), film)


def test_any_viewer_opens_the_picture(tmp_path: Path):
    film_file.write(tmp_path / "a.exr", made())
    assert clpt.read_image(tmp_path / "a.exr").shape == (4, 5, 3)


def test_every_flipped_bit_is_found(path: Path):
    content, rng = path.read_bytes(), random.Random(3)
    for _ in range(FLIPS):
        at, bit = rng.randrange(len(content)), rng.randrange(8)
        damaged = bytearray(content)
        damaged[at] ^= 1 << bit
        path.write_bytes(damaged)
        with pytest.raises(SceneError, match=r"a\.film: (its|a picture|not a film)"):
            film_file.read(path)


def test_every_truncation_is_found(path: Path):
    content, rng = path.read_bytes(), random.Random(4)
    lengths = {*range(80), *range(len(content) - 80, len(content))}
    for length in sorted(lengths | {rng.randrange(len(content)) for _ in range(500)}):
        path.write_bytes(content[:length])
        with pytest.raises(SceneError, match=r"a\.film: (its|a picture|not a film)"):
            film_file.read(path)
    path.write_bytes(content + b"\0")
    with pytest.raises(SceneError, match="not written to its end, or was damaged"):
        film_file.read(path)


def test_foreign_files(tmp_path: Path):
    path = tmp_path / "a.exr"
    clpt.write_image(path, np.ones((4, 4, 3)))
    with pytest.raises(SceneError, match=r"a\.exr: a picture without a film"):
        film_file.read(path)
    path.write_bytes(b"not a film" * 50)
    with pytest.raises(SceneError, match="not a film of clpt"):
        film_file.read_header(path)
    with pytest.raises(SceneError, match="cannot be read: No such file"):
        film_file.read(tmp_path / "b.film")
    with pytest.raises(SceneError, match="is a folder, not a file"):
        film_file.read(tmp_path)


def sealed(path: Path, attribute: object) -> None:
    """A file whose seal is whole, and whose attribute is this."""
    header = {} if attribute is None else {film_file.ATTRIBUTE: attribute}
    OpenEXR.File(header, {"Y": np.zeros((2, 2), np.float32)}).write(str(path))
    with path.open("r+b") as file:
        size = file.seek(0, 2)
        digest = film_file._hashed(file, size)
        file.write(film_file.SEAL + size.to_bytes(8, "little") + digest)


@pytest.mark.parametrize(
    ("attribute", "message"),
    [
        (json.dumps({"format": 3, "clpt": "9.0"}), "its format is 3, of clpt 9.0; .* a newer clpt"),
        (json.dumps({"format": 1, "clpt": "0.1"}), "no readable film: KeyError"),
        ("{", "no readable film: JSONDecodeError"),
        ("[]", "no readable film: TypeError"),
        (None, "does not say what it is of"),
    ],
)
def test_sealed_files_that_this_version_does_not_write(tmp_path: Path, attribute, message):
    sealed(tmp_path / "a.film", attribute)
    with pytest.raises(SceneError, match=message):
        film_file.read(tmp_path / "a.film")


def test_a_full_disk_leaves_the_former_file(path: Path):
    """A file that may not grow stands for a disk that is full, at each size up to the whole."""
    before, size = path.read_bytes(), path.stat().st_size
    action = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    try:
        for most in (1, 1000, size // 2, size - film_file.SEAL_BYTES, size - 1):
            resource.setrlimit(resource.RLIMIT_FSIZE, (most, limits[1]))
            with pytest.raises(OSError):
                film_file.write(path, made())
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)
            assert path.read_bytes() == before
            assert [p.name for p in path.parent.iterdir()] == [path.name]
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, action)
