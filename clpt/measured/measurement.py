"""Measured reflection of a material, by direction and wavelength, and its files.

Dupuy and Jakob's laboratory publishes them as tensor files (.bsdf).
"""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.arrays import in_memory
from clpt.errors import SceneError
from clpt.files import input_files, output_files

MAGIC, VERSION = b"tensor_file\0", (1, 0)
TYPES = (
    "u1", "i1", "<u2", "<i2", "<u4", "<i4", "<u8", "<i8", "<f2", "<f4", "<f8",
)  # fmt: skip
MOST_FIELDS, MOST_AXES = 256, 16
ALIGNED = 8  # [bytes] values begin at multiples
REDUCTIONS = (1, 2, 4)  # symmetric parts of the azimuths; a file stores the first
AXES = {
    "ndf": "(rows, columns)", "sigma": "(rows, columns)",
    "vndf": "(phi, theta, rows, columns)", "luminance": "(phi, theta, rows, columns)",
    "spectra": "(phi, theta, wavelengths, rows, columns)",
}  # fmt: skip
MOST_VALUES = 1 << 28
FILE_TABLES = ("phi_i", "theta_i", "ndf", "sigma", "vndf", "luminance")


def read_tensors(path: str | Path) -> dict[str, np.ndarray]:
    """Return the arrays of a tensor file by their names. Raises SceneError.

    Tensor files are named arrays, as Dupuy and Jakob publish measurements: "tensor_file" and a zero
    byte, two bytes of version (1, 0), the number of fields (u32); for each field its name (u16
    length, then the letters), the number of axes (u16), the type (u8), the offset of its values
    (u64) and its shape (u64 an axis). Numbers are little-endian. All of them are checked.
    """
    path = Path(path)
    try:
        return _fields(input_files.read_bytes(path))
    except SceneError as error:
        raise SceneError(error.message, file=path) from None
    except struct.error:
        raise SceneError("is damaged: it ends within its list of fields", file=path) from None


def write_tensors(path: str | Path, fields: Mapping[str, np.ndarray]) -> None:
    """Write arrays by their names. Raises OSError."""
    head, at = [MAGIC, struct.pack("<BBI", *VERSION, len(fields))], len(MAGIC) + 6
    arrays = {name.encode(): np.ascontiguousarray(values) for name, values in fields.items()}
    at += sum(13 + len(name) + 8 * values.ndim for name, values in arrays.items())
    body = []
    for name, values in arrays.items():
        at += (pad := -at % ALIGNED)
        shape = struct.pack(f"<{values.ndim}Q", *values.shape)
        kind = TYPES.index(values.dtype.newbyteorder("<").str.replace("|", "")) + 1
        head.append(struct.pack("<H", len(name)) + name)
        head.append(struct.pack("<HBQ", values.ndim, kind, at) + shape)
        body += [bytes(pad), values.astype(TYPES[kind - 1], copy=False).tobytes()]
        at += values.nbytes
    output_files.write(path, b"".join(head + body))


def _fields(data: bytes) -> dict[str, np.ndarray]:
    if not data.startswith(MAGIC):
        raise SceneError("is no tensor file: it does not begin with tensor_file")
    at = len(MAGIC)
    *version, count = struct.unpack_from("<BBI", data, at)
    if tuple(version) != VERSION:
        shown = ".".join(map(str, version))
        raise SceneError(f"is a tensor file of version {shown}; 1.0 is read")
    if count > MOST_FIELDS:
        raise SceneError(f"is damaged: it cannot have {count:,} fields")
    at += 6
    fields: dict[str, np.ndarray] = {}
    for _ in range(count):
        (length,) = struct.unpack_from("<H", data, at)
        name = data[at + 2 : at + 2 + length].decode("utf8", "replace")
        at += 2 + length
        axes, kind, offset = struct.unpack_from("<HBQ", data, at)
        if axes > MOST_AXES:
            raise SceneError(f"is damaged: the field {name!r} cannot have {axes} axes")
        shape = struct.unpack_from(f"<{axes}Q", data, at + 11)
        at += 11 + 8 * axes
        if not 1 <= kind <= len(TYPES):
            raise SceneError(f"is damaged: the field {name!r} is of an unknown type ({kind})")
        dtype, size = np.dtype(TYPES[kind - 1]), math.prod(shape)
        # also an empty field must have a shape that NumPy can hold
        if max(offset + size * dtype.itemsize, *shape, 0) > len(data):
            raise SceneError(f"is damaged: the field {name!r} goes beyond its end")
        fields[name] = np.frombuffer(data, dtype, size, offset).reshape(shape)
    return fields


@dataclass(frozen=True, eq=False, kw_only=True)
class Measurement:
    """A reflection in the adaptive coordinates of Dupuy and Jakob 2018, as their files store it.

    The viewer is at `phi_i`, `theta_i` [rad]; with a single azimuth the material is isotropic. The
    halfway direction lies at (sqrt(2 theta / pi), (phi + pi) / 2 pi) in the unit square, x over
    columns; an isotropic material's phi counts from the viewer's. `vndf` is a density over this
    square: `clpt.measured.fit` takes points of a second square to halfway directions. `spectra`
    and `luminance` are tables over the second square: the reflected light f cos(theta) [1/sr],
    divided by ndf / (4 sigma) if `jacobian`, and the density that samples it.

    wavelengths: (n,) [nm]; () if `spectra` are red, green and blue.

    Raises SceneError for shapes that do not match, angles or wavelengths that do not ascend, and
    numbers that are negative or not finite.
    """

    phi_i: NDArray[Any]
    theta_i: NDArray[Any]
    ndf: NDArray[Any]
    sigma: NDArray[Any]
    vndf: NDArray[Any]
    luminance: NDArray[Any]
    spectra: NDArray[Any]
    wavelengths: NDArray[Any] = field(default_factory=lambda: np.zeros(0, np.float32))
    jacobian: bool = True
    description: str = ""

    def __post_init__(self) -> None:
        fields = dict(vars(self))
        for name in ("phi_i", "theta_i", "wavelengths"):
            object.__setattr__(self, name, _ascending(name, fields[name]))
        for name in AXES:
            object.__setattr__(self, name, _table(name, fields[name]))
        if not len(self.phi_i) or not len(self.theta_i):
            raise SceneError("'phi_i' and 'theta_i' must have an angle each, at least")
        if self.theta_i[0] < -1e-3 or self.theta_i[-1] > 0.5 * math.pi + 1e-3:
            raise SceneError("'theta_i' must lie within 0 and pi / 2")
        both = len(self.phi_i), len(self.theta_i)
        tables = {"vndf": self.vndf, "luminance": self.luminance, "spectra": self.spectra}
        for name, table in tables.items():
            if (shape := table.shape)[:2] != both:
                raise SceneError(
                    f"{name!r} is of {shape[0]} x {shape[1]} viewers, but 'phi_i' and 'theta_i'"
                    f" of {both[0]} x {both[1]}"
                )
        if self.spectra.shape[3:] != self.luminance.shape[2:]:
            raise SceneError("'luminance' and 'spectra' must have the same rows and columns")
        expected = len(self.wavelengths) or 3
        if self.spectra.shape[2] != expected:
            raise SceneError(f"'spectra' has {self.spectra.shape[2]} colours, not {expected}")
        if not self.isotropic and self.reduction not in REDUCTIONS:
            raise SceneError(
                f"'phi_i' covers 1 / {self.reduction} of the circle; known are all, 1 / 2 and 1 / 4"
            )
        if not self.ndf.any() or not self.sigma.all():
            raise SceneError("'ndf' and 'sigma' must be above 0")

    @property
    def isotropic(self) -> bool:
        """Whether turning the surface changes nothing."""
        return len(self.phi_i) <= 2

    @property
    def reduction(self) -> int:
        """The number of symmetric parts of the azimuths; the first is stored."""
        if self.isotropic:
            return 1
        return round(2.0 * math.pi / float(self.phi_i[-1] - self.phi_i[0]))


def _ascending(name: str, values: ArrayLike) -> NDArray[Any]:
    numbers = np.asarray(in_memory(values), np.float32)
    if numbers.ndim != 1 or not np.isfinite(numbers).all() or not (np.diff(numbers) > 0.0).all():
        raise SceneError(f"{name!r} must be finite numbers that ascend")
    return numbers


def _table(name: str, values: ArrayLike) -> NDArray[Any]:
    table = np.asarray(in_memory(values), np.float32)
    if table.ndim != AXES[name].count(",") + 1:
        raise SceneError(f"{name!r} must be {AXES[name]}, not {table.shape}")
    if min(table.shape[-2:]) < 2 or not table.size:
        raise SceneError(f"{name!r} must have two rows and columns at least, not {table.shape}")
    if table.size > MOST_VALUES:
        raise SceneError(f"{name!r} has {table.size:,} numbers; at most {MOST_VALUES:,} are read")
    if not (np.isfinite(table) & (table >= 0.0)).all():
        raise SceneError(f"{name!r} has a number that is negative or not finite")
    return table


def read(path: str | Path) -> Measurement:
    """Read a measured material. Raises SceneError that names the wrong field."""
    fields = read_tensors(path)
    try:
        return _measurement(fields)
    except SceneError as error:
        raise SceneError(error.message, file=Path(path)) from None


def _measurement(fields: dict[str, np.ndarray]) -> Measurement:
    colours = "spectra" if "spectra" in fields else "rgb"
    needed = [*FILE_TABLES, colours, *(["wavelengths"] if colours == "spectra" else [])]
    for name in needed:
        if name not in fields:
            known = ", ".join(map(repr, fields)) or "none"
            raise SceneError(f"has no field {name!r}; it has {known}")
        if fields[name].dtype.kind != "f":
            raise SceneError(f"the field {name!r} must be of floats, not {fields[name].dtype}")
    flag = fields.get("jacobian", np.ones(1, np.uint8))
    if flag.size != 1:
        raise SceneError(f"the field 'jacobian' must be one number, not {flag.shape}")
    text = fields.get("description", np.zeros(0, np.uint8))
    return Measurement(
        **{name: fields[name] for name in FILE_TABLES},
        spectra=fields[colours],
        wavelengths=fields["wavelengths"] if colours == "spectra" else np.zeros(0),
        jacobian=bool(flag.reshape(-1)[0]),
        description=text.astype(np.uint8).tobytes().decode("utf8", "replace"),
    )


def write(path: str | Path, measurement: Measurement) -> None:
    """Write a measured material, so that `read` returns it. Raises SceneError."""
    spectral = len(measurement.wavelengths) > 0
    fields = {
        "description": np.frombuffer(measurement.description.encode(), np.uint8),
        "jacobian": np.array([measurement.jacobian], np.uint8),
        **{name: vars(measurement)[name] for name in FILE_TABLES},
        **({"wavelengths": measurement.wavelengths} if spectral else {}),
        "spectra" if spectral else "rgb": measurement.spectra,
    }
    try:
        write_tensors(path, fields)
    except OSError as error:
        raise SceneError(f"cannot be written: {error.strerror}", file=Path(path)) from None
