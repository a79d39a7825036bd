"""Files of densities: numpy's .npy, Mitsuba's .vol of version 3, NanoVDB's .nvdb, OpenVDB's .vdb.

A .vol has 48 bytes of header, then float32 with x fastest."""

from __future__ import annotations

import contextlib
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import transforms
from clpt.errors import SceneError
from clpt.files import budget, input_files, numpy_files
from clpt.formats.volumes import nvdb, vdb
from clpt.scene.volumes import Volume, check_density
from clpt.spectra import RGBUnbounded
from clpt.transforms import IDENTITY

VOL_HEADER = struct.Struct("<3sB5i6f")
FLOAT32 = 1  # the only encoding that Mitsuba 3 reads


def read_vol(path: Path) -> Volume:
    """Return the values (nx, ny, nz) of a single channel, and their box. Raises SceneError."""
    values, box = read_channels(path)
    if values.shape[3] != 1:
        raise SceneError(f"has {values.shape[3]} channels; a density has one")
    return Volume(values[..., 0], box)


def read_channels(path: Path) -> tuple[np.ndarray, transforms.Matrix]:
    """Return values (nx, ny, nz, channels) float32, and what takes the unit cube to their box.

    Raises SceneError, OSError.
    """
    data = input_files.read_bytes(path)
    budget.take(len(data), "its values", path)
    if len(data) < VOL_HEADER.size or data[:3] != b"VOL":
        raise SceneError("is no .vol file: it does not begin with VOL")
    _, version, encoding, nx, ny, nz, channels, *box = VOL_HEADER.unpack_from(data)
    if version != 3 or encoding != FLOAT32:
        message = f"is a .vol of version {version}, encoding {encoding}; read are 3 and float32 (1)"
        raise SceneError(message)
    if min(nx, ny, nz, channels) < 1 or channels > 6:
        raise SceneError(f"cannot be {nx} x {ny} x {nz} of {channels} channels")
    count = nx * ny * nz * channels
    if len(data) != VOL_HEADER.size + 4 * count:
        message = (
            f"must have {VOL_HEADER.size + 4 * count:,} bytes by its header, found {len(data):,}"
        )
        raise SceneError(message)
    values = np.frombuffer(data, "<f4", count, VOL_HEADER.size).reshape(nz, ny, nx, channels)
    low, high = np.array(box[:3]), np.array(box[3:])
    if not (np.isfinite(box).all() and (low < high).all()):
        raise SceneError("its box is empty")
    matrix = transforms.translate(low) @ transforms.scale(high - low)
    return np.ascontiguousarray(values.transpose(2, 1, 0, 3), np.float32), matrix


_GREY = 1e-4  # relative difference of colours from multiples of a single colour


def read(path: str | Path, grid: str = "") -> Volume:
    """Read the density in a file, with its box: float32 values (nx, ny, nz).

    grid: its name in a .nvdb or .vdb of several; "" is "density", else the first. A .npy has the
    box of the unit cube. Raises SceneError for any other file, and for numbers that are negative or
    not finite.
    """
    path = Path(path)
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        message = f"unknown format {path.suffix!r} of a density; known: {' '.join(READERS)}"
        raise SceneError(message, file=path)
    with _reading(path):
        volume = reader(path, grid)
        check_density(volume.values, "")
    return volume


def names(path: str | Path) -> tuple[str, ...]:
    """Return the names of the grids of a .nvdb, of any other file none. Raises SceneError."""
    path = Path(path)
    if path.suffix.lower() != ".nvdb":
        return ()
    with _reading(path):
        return nvdb.names(path)


def read_colours(path: str | Path) -> Volume:
    """Read colours (nx, ny, nz, 3) float32 with their box, of a .npy or a .vol.

    Raises SceneError as `read` does.
    """
    path = Path(path)
    with _reading(path):
        if path.suffix.lower() == ".npy":
            return _npy(path, axes=4)
        return Volume(*read_channels(path))


def factored(
    values: NDArray[Any],
) -> tuple[RGBUnbounded, NDArray[np.float32], NDArray[np.float32] | None]:
    """Return colour, density (nx, ny, nz) and colours, or None, of an extinction (nx, ny, nz, 3).

    A `Grid` takes these. If the extinction is a colour times a density, there are no colours; else
    the colour is twice white, the density the largest component, and colours (nx, ny, nz, 3) are
    half of each component's share of it: colours that may exceed 1 have the spectra of halves, in
    PBRT, Mitsuba and `RGBUnbounded`.
    """
    values = np.asarray(values, np.float64)
    most = values.max(axis=(0, 1, 2))
    density = values.mean(axis=3) / max(float(most.mean()), 1e-30)
    if np.allclose(values, density[..., None] * most, _GREY, 1e-5 * most.max()):
        return RGBUnbounded(*most.tolist()), density.astype(np.float32), None
    highest = values.max(axis=3)
    colours = 0.5 * values / np.maximum(highest, 1e-30)[..., None]
    white = RGBUnbounded(2.0, 2.0, 2.0)
    return white, highest.astype(np.float32), colours.astype(np.float32)


def distances(path: Path) -> np.ndarray:
    """Read signed distances (nx, ny, nz) float32 of a .npy or .vol file. Raises SceneError."""
    with _reading(path):
        if path.suffix.lower() == ".vol":
            return read_vol(path).values
        return np.ascontiguousarray(_array(path), np.float32)


@contextlib.contextmanager
def _reading(path: Path) -> Iterator[None]:
    """Name the file in errors of its reader."""
    try:
        yield
    except MemoryError:
        raise SceneError("does not fit in memory", file=path) from None
    except SceneError as error:
        raise SceneError(error.message, file=path) from None


def _npy(path: Path, grid: str = "", axes: int = 3) -> Volume:
    values = _array(path, axes)
    check_density(values, "")
    return Volume(np.ascontiguousarray(values, np.float32), IDENTITY)


def _array(path: Path, axes: int = 3) -> np.ndarray:
    """The numbers of a .npy file, of three axes, or of four with colours."""
    values = numpy_files.array(path)
    if values.ndim != axes or not values.size:
        wanted = "(nx, ny, nz)" if axes == 3 else "(nx, ny, nz, 3)"
        raise SceneError(f"must hold an array {wanted}, not {values.shape}")
    if values.dtype.kind not in "fui":
        raise SceneError(f"must hold numbers, not {values.dtype}")
    budget.check(12 * values.size, "its values")
    budget.take(4 * values.size, "its values")
    return values


READERS: dict[str, Callable[[Path, str], Volume]] = {
    ".npy": _npy,
    ".vol": lambda path, _: read_vol(path),
    ".nvdb": nvdb.read,
    ".vdb": vdb.read,
}
