"""Lamps that a file of their maker describes: candela by direction, for a `goniometric` light.

IES files are ANSI/IES LM-63-1986 to -2019. EULUMDAT files (.ldt) have a value on each line, by
Stockmar's specification (1990); their intensities are in candela for 1000 lm of their lamps.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.arrays import Floats, Integers
from clpt.errors import SceneError
from clpt.files import input_files as text_files
from clpt.scene.lights import STRENGTHS, Goniometric
from clpt.scene.params import fields_of
from clpt.scene.textures import Bitmap
from clpt.spectra import RGBIlluminant

ROWS, COLUMNS = 360, 720  # of the image: half degrees
MOST_VALUES = 1 << 22
AROUND = ((0, 90), (0, 180), (0, 360), (90, 270))
NEW = ("IESNA:", "IES:")  # begin files of 1995 and later; IESNA91 or nothing begins older files
TYPES = {2: "B", 3: "A"}  # of photometry, about axes that lie; 1 is C, about the vertical
# names of the numbers after TILT, in their order
HEADER = (
    "lamps", "lumens", "multiplier", "vertical", "horizontal", "photometry", "units", "width",
    "length", "height", "ballast", "ballast_lamp", "watts",
)  # fmt: skip


@dataclass(frozen=True)
class Photometry:
    """Intensities of a lamp by direction, as an IES file holds them.

    vertical (v,): angles from straight down, 0 to 180; horizontal (h,): about the vertical, 0 to
    360 [degrees]; candela (h, v): intensity there [cd].
    """

    vertical: NDArray[np.float64]
    horizontal: NDArray[np.float64]
    candela: NDArray[np.float64]

    def intensity(self, vertical: ArrayLike, horizontal: ArrayLike) -> NDArray[np.float64]:
        """Return the intensity [cd] at angles [degrees] that broadcast; 0 where none was measured.

        Between the angles it is linear; what is measured of a half or a quarter is mirrored.
        """
        v, h = np.broadcast_arrays(np.asarray(vertical, float), np.asarray(horizontal, float))
        h = np.mod(h, 360.0)
        last = self.horizontal[-1]
        if last <= 180.0:
            h = np.where(h > 180.0, 360.0 - h, h)
        if last <= 90.0:
            h = np.where(h > 90.0, 180.0 - h, h)
        if self.horizontal[0] > 0.0:
            h = np.where(h < 90.0, 180.0 - h, np.where(h > 270.0, 540.0 - h, h))
        column, x = _between(self.horizontal, h)
        row, y = _between(self.vertical, v)
        near = np.minimum(column + 1, len(self.horizontal) - 1)
        down = np.minimum(row + 1, len(self.vertical) - 1)
        first = self.candela[column, row] * (1.0 - y) + self.candela[column, down] * y
        second = self.candela[near, row] * (1.0 - y) + self.candela[near, down] * y
        measured = (v >= self.vertical[0] - 1e-9) & (v <= self.vertical[-1] + 1e-9)
        return np.where(measured, first * (1.0 - x) + second * x, 0.0)


def read(path: Path) -> Photometry:
    """Read an IES file. Raises SceneError with the line that is broken or not supported."""
    return _IesReader(path).photometry()


def directional_image(lamp: Photometry) -> dict[str, Any]:
    """Return the `image` of a Goniometric: candela by direction, so that its `candela` is 1.

    In the light's own space -y is straight down, the vertical angle 0; horizontal angles go from
    +z to +x.
    """
    vertical = 180.0 - (np.arange(ROWS) + 0.5) / ROWS * 180.0
    around = COLUMNS if len(lamp.horizontal) > 1 else 1
    horizontal = (0.5 - (np.arange(around) + 0.5) / around) * 360.0
    values = lamp.intensity(vertical[:, None], horizontal)
    image = values[:, :, None].astype(np.float32)
    bitmap = Bitmap(image=image, raw=True, wrap="repeat", wrap_v="clamp")
    return {"image": bitmap, "candela": 1.0}


def _between(angles: NDArray[np.float64], at: Floats) -> tuple[Integers, Floats]:
    """The angle before each of `at`, and how far it is on the way to the next."""
    index = np.clip(np.searchsorted(angles, at, "right") - 1, 0, max(len(angles) - 2, 0))
    if len(angles) == 1:
        return index, np.zeros(np.shape(at))
    low, high = angles[index], angles[index + 1]
    return index, np.clip((at - low) / (high - low), 0.0, 1.0)


class _IesReader:
    """The lines of a file, then its numbers, each with its line."""

    def __init__(self, path: Path):
        self.path, self.line = path, 1
        self.lines = text_files.read(path).splitlines()

    def fail(self, message: str) -> NoReturn:
        raise SceneError(message, file=self.path, line=self.line)

    def photometry(self) -> Photometry:
        tilt = next((i for i, line in enumerate(self.lines) if line.strip()[:5] == "TILT="), None)
        if tilt is None:
            self.fail("is no IES file: it has no line TILT=")
        self.line = tilt + 1
        kind = self.lines[tilt].strip()[5:].strip().upper()
        self.numbers = self._numbers(tilt + 1)
        if kind == "INCLUDE":
            self._many("lamp's tilt", 1)
            pairs = self._count("angles of tilt")
            self._many("tilt", 2 * pairs)
        elif kind != "NONE":
            self.fail(f"TILT={kind[:40]} is a file of its own; write TILT=NONE or INCLUDE")
        head = dict(zip(HEADER[:3], self._many("header", 3), strict=True))
        sizes = [self._count(f"{name} angles") for name in ("vertical", "horizontal")]
        if math.prod(sizes) > MOST_VALUES:
            self.fail(
                f"{sizes[0]} x {sizes[1]} values are more than the {MOST_VALUES} that are read"
            )
        geometry = self._many("header", len(HEADER) - 5)
        photometry = geometry[0]
        if photometry in TYPES:
            self.fail(f"photometry of type {TYPES[int(photometry)]}; only type C is supported")
        if photometry != 1.0:
            self.fail(f"the type of photometry is 1, 2 or 3, not {photometry:g}")
        vertical, horizontal = (
            self._angles(name, n) for name, n in zip(("vertical", "horizontal"), sizes, strict=True)
        )
        if vertical[0] < -1e-9 or vertical[-1] > 180.0 + 1e-9:
            self.fail("vertical angles must lie between 0 and 180 degrees")
        scale = head["multiplier"] * geometry[5] * (geometry[6] if self._factor_of_lamps() else 1.0)
        values = self._many("candela", math.prod(sizes))
        candela = np.array(values).reshape(sizes[1], sizes[0]) * scale
        horizontal, candela = self._around(horizontal, candela)
        if not (np.isfinite(candela).all() and (candela >= 0.0).all() and candela.any()):
            self.fail("candela must not be negative, and not all zero")
        return Photometry(vertical, horizontal, candela)

    def _factor_of_lamps(self) -> bool:
        """Return whether the ballast-lamp photometric factor counts: in editions before 1995.

        LM-63-1995 keeps its place for the future. LM-63-2019 has a kind of file there.
        """
        first = next((line.strip().upper() for line in self.lines if line.strip()), "")
        return not first.startswith(NEW)

    def _around(
        self, angles: NDArray[np.float64], candela: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return horizontal angles and candela (h, v) that go around wholly, or cover a half or a
        quarter.

        Some files leave out 360, which repeats 0: their even steps would end there with another
        step. Raises SceneError.
        """
        if len(angles) == 1:
            return angles, candela
        steps = np.diff(angles)
        open_ = len(angles) > 2 and angles[-1] > 180.0 + 1e-6 and np.ptp(steps) < 1e-3 * steps[0]
        if open_ and abs(angles[0]) < 1e-6 and abs(angles[-1] + steps[0] - 360.0) < 1e-3 * steps[0]:
            return np.append(angles, 360.0), np.vstack([candela, candela[:1]])
        ends = angles[[0, -1]]
        if not any(np.abs(ends - known).max() < 1e-6 for known in AROUND):
            extent = f"{angles[0]:g} to {angles[-1]:g}"
            message = "horizontal angles go from 0 to 90, 180 or 360, or from 90 to 270 degrees"
            self.fail(f"{message}, not from {extent}")
        return angles, candela

    def _angles(self, name: str, count: int) -> NDArray[np.float64]:
        angles = np.array(self._many(f"{name} angles", count))
        if not (np.diff(angles) > 0.0).all():
            self.fail(f"{name} angles must rise")
        return angles

    def _numbers(self, first: int) -> Iterator[float]:
        for number, text in enumerate(self.lines[first:], first + 1):
            for word in text.replace(",", " ").split():
                self.line = number
                try:
                    value = float(word)
                except ValueError:
                    value = math.nan
                if not math.isfinite(value):
                    self.fail(f"{word[:20]!r} is no number")
                yield value

    def _many(self, quantity: str, count: int) -> list[float]:
        values = [value for _, value in zip(range(count), self.numbers, strict=False)]
        if len(values) < count:
            self.line = len(self.lines)
            self.fail(f"ends early: {len(values)} of {count} numbers of its {quantity}")
        return values

    def _count(self, quantity: str) -> int:
        value = self._many(f"number of {quantity}", 1)[0]
        if value != int(value) or not 1 <= value <= MOST_VALUES:
            self.fail(f"the number of {quantity} must be a whole one from 1, not {value:g}")
        return int(value)


SYMMETRY, PLANES, ANGLES, FACTOR, SETS = 2, 3, 5, 23, 25  # lines, counted from 0
PER_SET, RATIOS = 6, 10  # lines of a set of lamps, and of direct ratios
FLUX = 2  # of a set's lines
KINDS = 5  # of symmetry


def read_eulumdat(path: Path) -> Photometry:
    """Read an EULUMDAT file. Raises SceneError with the broken line."""
    return _EulumdatReader(path).photometry()


class _EulumdatReader:
    """The lines of a file."""

    def __init__(self, path: Path):
        self.path = path
        self.lines = text_files.read(path).splitlines()

    def photometry(self) -> Photometry:
        symmetry = self._count(SYMMETRY, "kind of symmetry", 0, KINDS - 1)
        planes = self._count(PLANES, "number of C planes", 1, MOST_VALUES)
        angles = self._count(ANGLES, "number of angles", 1, MOST_VALUES)
        sets = self._count(SETS, "number of sets of lamps", 1, 20)
        if planes * angles > MOST_VALUES:
            self._fail(PLANES, f"{planes} x {angles} values are more than the {MOST_VALUES} read")
        first = SETS + 1 + PER_SET * sets + RATIOS
        around = self._rising(first, planes, "C angles")
        vertical = self._rising(first + planes, angles, "angles")
        if around[0] < 0.0 or around[-1] > 360.0 or vertical[0] < 0.0 or vertical[-1] > 180.0:
            self._fail(first, "angles lie from 0 to 360 around, and from 0 to 180 from below")
        kept = {0: planes, 1: 1, 2: planes // 2 + 1, 3: planes // 2 + 1, 4: planes // 4 + 1}
        rows = kept[symmetry]
        start = first + planes + angles
        values = self._numbers(start, rows * angles, "intensities").reshape(rows, angles)
        if (values < 0.0).any() or not values.any():
            self._fail(start, "intensities must not be negative, and not all zero")
        candela = values * self._lumens(sets) / 1000.0 * self._number(FACTOR, "conversion factor")
        return Photometry(vertical, *self._whole(symmetry, around, candela))

    def _whole(
        self, symmetry: int, around: NDArray[np.float64], candela: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the angles and intensities as Photometry mirrors them."""
        if symmetry == 1:
            return np.zeros(1), candela
        if symmetry == 0 and around[-1] == 360.0:
            return around, candela
        if symmetry == 0:
            return np.append(around, around[0] + 360.0), np.vstack([candela, candela[:1]])
        ends = {2: 180.0, 3: 180.0, 4: 90.0}
        angles = np.linspace(0.0, ends[symmetry], len(candela))
        if symmetry != 3:
            measured = around[: len(candela)]
            if len(candela) < 2 or abs(measured[-1] - ends[symmetry]) > 1e-6 or measured[0]:
                self._fail(SYMMETRY, "its C planes do not cover what its symmetry needs")
            return measured, candela
        if len(candela) < 2:
            self._fail(SYMMETRY, "its C planes do not cover what its symmetry needs")
        return 90.0 + angles, candela[::-1]  # from 270 over 0 to 90, mirrored

    def _lumens(self, sets: int) -> float:
        """Return the light of the first set of lamps [lm]; further sets are alternatives."""
        line = SETS + 1 + FLUX
        lumens = abs(self._number(line, "luminous flux"))
        if not lumens > 0.0:
            self._fail(line, "the luminous flux of its lamps is 0")
        return lumens

    def _rising(self, first: int, count: int, name: str) -> NDArray[np.float64]:
        values = self._numbers(first, count, name)
        if not (np.diff(values) > 0.0).all():
            self._fail(first, f"{name} must rise")
        return values

    def _numbers(self, first: int, count: int, name: str) -> NDArray[np.float64]:
        return np.array([self._number(first + i, name) for i in range(count)])

    def _number(self, line: int, name: str) -> float:
        if line >= len(self.lines):
            self._fail(len(self.lines) - 1, f"ends early, before its {name}")
        text = self.lines[line].strip().replace(",", ".")
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            self._fail(line, f"{text[:20]!r} is no number: its {name} stands here")
        return value

    def _count(self, line: int, name: str, low: int, high: int) -> int:
        value = self._number(line, name)
        if value != int(value) or not low <= value <= high:
            self._fail(line, f"the {name} must be a whole number from {low} to {high}")
        return int(value)

    def _fail(self, line: int, message: str) -> NoReturn:
        raise SceneError(message, file=self.path, line=max(line, 0) + 1)


EULUMDAT = ".ldt"


def parameters(path: Path) -> dict[str, Any]:
    """Return `image` and `candela` of a Goniometric from an .ies or .ldt file.

    Raises SceneError with the broken line.
    """
    reader = read_eulumdat if path.suffix.lower() == EULUMDAT else read
    return directional_image(reader(path))


def joined(lamp: Goniometric, file: dict[str, Any]) -> Goniometric:
    """Return a lamp with the table of its file.

    A number of its intensity and its own `candela` are factors. Its own `power` or `lumens` are of
    all its light: the table then says only how it is distributed.
    """
    intensity, image = lamp.intensity, file["image"]
    candela = file["candela"] if lamp.candela is None else lamp.candela
    alike = isinstance(intensity, RGBIlluminant) and intensity.r == intensity.g == intensity.b
    values = fields_of(lamp)
    if any(values.get(name) is not None for name in STRENGTHS if name != "candela"):
        shares = np.asarray(image.image, np.float32) / np.float32(mean(image.image))
        return dataclasses.replace(lamp, image=dataclasses.replace(image, image=shares))
    if isinstance(intensity, RGBIlluminant) and alike:
        if intensity.r == 0.0:  # switched off
            return dataclasses.replace(lamp, image=image, candela=None)
        candela, intensity = candela * intensity.r, RGBIlluminant(1.0, 1.0, 1.0)
    return dataclasses.replace(lamp, image=image, candela=candela, intensity=intensity)


def mean(image: ArrayLike) -> float:
    """Return the mean over all directions of a table (h, w, 1) in latitude and longitude."""
    values = np.asarray(image, np.float64)
    edges = np.cos(np.linspace(0.0, np.pi, len(values) + 1))
    return float(values.mean(axis=(1, 2)) @ -np.diff(edges)) / 2.0
