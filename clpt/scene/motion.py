"""Motion while the shutter is open: keys of transforms, and the shutter itself. Times are in s."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import transforms
from clpt.arrays import in_memory, number
from clpt.errors import SceneError

SHAPES = {"box": (1.0, 1.0), "triangle": (0.0, 1.0, 0.0)}  # of shutters, by name


@dataclass(frozen=True, eq=False)
class Keys:
    """A transform that changes with time: affine (4, 4) matrices at times [s].

    Between two keys translation and scale change linearly, and a rotation turns evenly on the
    shortest way (Shoemake and Duff 1992: a matrix is T R S, S symmetric). Before the first key and
    after the last key nothing moves. A turn of half a circle or more needs keys in between.

    Raises SceneError for times that do not ascend, matrices that are not affine, singular or not
    finite, and a mirror image between two keys.
    """

    times: Sequence[float]
    transforms: Any

    def __post_init__(self) -> None:
        try:
            times = np.asarray(self.times, np.float64).reshape(-1)
            matrices = np.asarray(in_memory(self.transforms), np.float64)
        except (TypeError, ValueError) as error:
            raise SceneError(f"its keys are not numbers: {error}", where="motion") from error
        if not len(times):
            raise SceneError("must have at least one key", where="motion")
        if matrices.shape != (len(times), 4, 4):
            counts = f"{len(times)} times and transforms {matrices.shape}"
            raise SceneError(f"needs a 4x4 matrix for each time, found {counts}", where="motion")
        check_times(times.tolist(), "motion")
        for i, matrix in enumerate(matrices):
            where = f"motion.transforms[{i}]"
            if not np.isfinite(matrix).all() or matrix[3].tolist() != [0.0, 0.0, 0.0, 1.0]:
                raise SceneError("must be finite and affine", where=where)
            lengths = np.linalg.norm(matrix[:3, :3], axis=0)
            if not lengths.all() or abs(np.linalg.det(matrix[:3, :3] / lengths)) < 1e-12:
                raise SceneError("is singular: it flattens space", where=where)
        signs = np.sign(np.linalg.det(matrices[:, :3, :3]))
        if np.ptp(signs):
            at = int(np.argmax(signs != signs[0]))
            message = "mirrors space and the key before does not: no motion leads there"
            raise SceneError(message, where=f"motion.transforms[{at}]")
        object.__setattr__(self, "times", tuple(times.tolist()))
        object.__setattr__(self, "transforms", matrices)

    def at(self, time: float) -> NDArray[np.float64]:
        """Return the transform at a time [s], (4, 4) float64."""
        times = self.times
        if len(times) == 1 or time <= times[0]:
            return np.array(self.transforms[0])
        if time >= times[-1]:
            return np.array(self.transforms[-1])
        i = int(np.searchsorted(times, time, "right")) - 1
        a = (time - times[i]) / (times[i + 1] - times[i])
        (t0, q0, s0), (t1, q1, s1) = (decomposed(self.transforms[k]) for k in (i, i + 1))
        matrix = np.eye(4)
        matrix[:3, :3] = rotation(slerp(q0, q1, a)) @ (s0 + a * (s1 - s0))
        matrix[:3, 3] = t0 + a * (t1 - t0)
        return matrix


@dataclass(frozen=True, eq=False)
class Deformation:
    """Points that move by themselves: where each is at times [s], linear in between.

    points: (k, n, 3) for k times and n vertices of a mesh, (k, n, 4) for points of curves and for
    many spheres with the radii, which spheres may do without.
    normals: (k, n, 3) of a mesh's vertices, or None. Both become float32.
    Before the first time and after the last time nothing moves.

    Raises SceneError for times that do not ascend, arrays of other shapes, and values that are not
    finite.
    """

    times: Sequence[float]
    points: Any
    normals: Any = None

    def __post_init__(self) -> None:
        where = "deformation"
        try:
            times = np.asarray(self.times, np.float64).reshape(-1)
        except (TypeError, ValueError) as error:
            raise SceneError(f"its times are not numbers: {error}", where=where) from error
        if not len(times):
            raise SceneError("must have at least one key", where=where)
        check_times(times.tolist(), where)
        points = _keyed(self.points, f"{where}.points", len(times), (3, 4))
        normals = self.normals
        if normals is not None:
            normals = _keyed(normals, f"{where}.normals", len(times), (3,))
            if normals.shape[1] != points.shape[1]:
                counts = f"{normals.shape[1]} for {points.shape[1]} points"
                raise SceneError(f"needs as many normals as points, found {counts}", where=where)
        object.__setattr__(self, "times", tuple(times.tolist()))
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "normals", normals)

    def at(self, time: float) -> tuple[NDArray[np.float32], NDArray[np.float32] | None]:
        """Return the points (n, 3 or 4) float32 at a time [s], and the normals (n, 3) or None."""
        times = self.times
        i = int(np.searchsorted(times, time, "right")) - 1
        if i < 0 or i >= len(times) - 1:
            share, i, j = 0.0, max(i, 0), max(i, 0)
        else:
            share, j = (time - times[i]) / (times[i + 1] - times[i]), i + 1
        interpolated = []
        for values in (self.points, self.normals):
            still = values is None or share == 0.0
            key = None if values is None else values[i]
            between = key if still else (1.0 - share) * values[i] + share * values[j]
            interpolated.append(None if between is None else np.asarray(between, np.float32))
        return interpolated[0], interpolated[1]  # type: ignore[return-value]

    def while_open(self, shutter: Shutter) -> tuple[float, ...]:
        """Return the times [s] of keys while a shutter is open, its opening and its closing.

        Points at rest have a single time.
        """
        inner = [t for t in self.times if shutter.open < t < shutter.close]
        times = (shutter.open, *inner, shutter.close)
        first, turned = self.at(times[0])
        for time in times[1:]:
            points, normals = self.at(time)
            same = np.array_equal(points, first)
            bent = normals is not None and turned is not None
            if not same or (bent and not np.array_equal(np.asarray(normals), np.asarray(turned))):
                return times
        return times[:1]


def _keyed(values: Any, where: str, count: int, widths: tuple[int, ...]) -> NDArray[np.float32]:
    """Return an array (count, n, w) float32 with a width w in `widths`. Raises SceneError."""
    try:
        rows = [np.shape(key) for key in values]
        odd = next((i for i, shape in enumerate(rows) if shape != rows[0]), None)
        array = np.asarray(in_memory(values) if odd is None else (), np.float32)
    except (TypeError, ValueError) as error:
        raise SceneError(f"are not numbers: {error}", where=where) from error
    if odd is not None:
        message = f"key {odd} has {rows[odd]}, the first {rows[0]}: all must have as many"
        raise SceneError(message, where=where)
    if array.ndim != 3 or len(array) != count or array.shape[2] not in widths:
        columns = " or ".join(map(str, widths))
        message = f"must be ({count}, n, {columns}) for {count} times, found {array.shape}"
        raise SceneError(message, where=where)
    wrong = ~np.isfinite(array).all(axis=(1, 2))
    if wrong.any():
        raise SceneError(f"key {int(np.argmax(wrong))} is not finite", where=where)
    return array


def placement(movable: object) -> NDArray[np.float64] | None:
    """Return the placement (4, 4) of a shape, light or camera; None if it has none."""
    if hasattr(movable, "to_world"):
        return np.asarray(movable.to_world, np.float64)
    if hasattr(movable, "position"):
        return transforms.translate(movable.position)
    if hasattr(movable, "direction"):
        d = np.asarray(movable.direction, np.float64)
        up = [0.0, 1.0, 0.0] if abs(d[1]) < 0.9 * np.linalg.norm(d) else [1.0, 0.0, 0.0]
        return transforms.look_at([0.0, 0.0, 0.0], d, up)
    return None


def through(movable: Any, times: Sequence[float], placements: ArrayLike) -> Any:
    """Return a shape, light or camera that is at placements (k, 4, 4) at times [s], by keys.

    It turns about its own origin. Raises SceneError as `Keys` does.
    """
    keys = Keys(times, placements)
    if hasattr(movable, "to_world"):
        return replace(movable, to_world=np.eye(4), motion=keys)
    if hasattr(movable, "position"):
        return replace(movable, position=(0.0, 0.0, 0.0), motion=keys)
    return replace(movable, direction=(0.0, 0.0, 1.0), motion=keys)


def check_times(times: Sequence[float], where: str) -> None:
    """Raise SceneError for times that are not finite or do not ascend."""
    for i, time in enumerate(times):
        if not math.isfinite(time):
            raise SceneError(f"{time} is no time", where=f"{where}.times[{i}]")
        if i and not time > times[i - 1]:
            message = f"{time:g} s must be later than {times[i - 1]:g} s, the key before"
            raise SceneError(message, where=f"{where}.times[{i}]")


@dataclass(frozen=True)
class Shutter:
    """When light comes to the film: from `open` to `close` [s].

    shape: "box", "triangle", or numbers: how far the shutter is open at even steps from its
    beginning to its end, linear in between. Each path has a time by this density, and the picture
    is as bright as with a box. Without length all is still, as it is when the shutter opens.

    readout: [s] of a rolling shutter, from the exposure of the first row of the film to that of the
    last; 0: all rows get light at once. A row gets light for close - open - readout: the first row
    from `open` on, the last until `close`.

    Raises SceneError for a shutter that closes before it opens, a shape that is never open, and a
    readout that is longer than all of it.
    """

    open: float = 0.0
    close: float = 1.0
    shape: str | Sequence[float] | NDArray[Any] = "box"
    readout: float = 0.0

    def __post_init__(self) -> None:
        for name in ("open", "close", "readout"):
            value = vars(self)[name]
            time = number(value, f"shutter.{name}", "a time [s]")
            object.__setattr__(self, name, time)
        if self.close < self.open:
            message = f"{self.close:g} s is before it opens, {self.open:g} s"
            raise SceneError(message, where="shutter.close")
        if not 0.0 <= self.readout <= self.close - self.open:
            message = f"must be 0 to {self.close - self.open:g} s, while it is open"
            raise SceneError(message, where="shutter.readout")
        self.density()

    def density(self) -> NDArray[np.float64]:
        """Return how far it is open at even steps, (n,) float64, n at least 2, mean 1."""
        if isinstance(self.shape, str) and self.shape not in SHAPES:
            names = ", ".join(SHAPES)
            message = f"{self.shape!r} is none of {names}; or a list of numbers"
            raise SceneError(message, where="shutter.shape")
        named = SHAPES[self.shape] if isinstance(self.shape, str) else self.shape
        try:
            values = np.asarray(named, np.float64)
        except (TypeError, ValueError):
            values = np.zeros(0)
        usable = values.ndim == 1 and 2 <= len(values) <= 256 and np.isfinite(values).all()
        if not usable or (values < 0.0).any() or not values.any():
            message = "must be 2 to 256 numbers from zero, one at least above it"
            raise SceneError(message, where="shutter.shape")
        return values / (values[1:] + values[:-1]).mean() * 2.0


def decomposed(
    matrix: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return translation (3,), rotation as a unit quaternion (4,), w last, and S (3, 3).

    The linear part is R S, S symmetric (polar decomposition); S takes a mirror image along.
    """
    turn = rotations(matrix[None, :3, :3])[0]
    return matrix[:3, 3], quaternion(turn), turn.T @ matrix[:3, :3]


def rotations(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rotations in linear maps (n, 3, 3) by polar decomposition."""
    u, _, v = np.linalg.svd(linear)
    turn = u @ v
    return turn * np.where(np.linalg.det(turn) < 0.0, -1.0, 1.0)[:, None, None]


def quaternion(r: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the unit quaternion (x, y, z, w) of a rotation matrix (3, 3) (Shepperd 1978)."""
    diagonal = np.array([r[0, 0], r[1, 1], r[2, 2], np.trace(r)])
    i = int(np.argmax(diagonal))
    q = np.empty(4)
    if i == 3:
        q[:] = r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], 1.0 + diagonal[3]
    else:
        j, k = (i + 1) % 3, (i + 2) % 3
        q[i] = 1.0 - diagonal[3] + 2.0 * r[i, i]
        q[j], q[k] = r[j, i] + r[i, j], r[k, i] + r[i, k]
        q[3] = r[k, j] - r[j, k]
    return q / np.linalg.norm(q)


def rotation(q: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rotation matrix (3, 3, ...) of unit quaternions (4, ...): x, y, z, w."""
    x, y, z, w = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def arc(q0: NDArray[np.float64], q1: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Return the unit quaternion across q0 on the way to q1, and the angle between them [rad]."""
    q1 = q1 if q0 @ q1 >= 0.0 else -q1
    across = q1 - (q0 @ q1) * q0
    length = float(np.linalg.norm(across))
    angle = math.atan2(length, float(q0 @ q1))
    return (across / length, angle) if length > 1e-9 else (np.zeros(4), 0.0)


def slerp(q0: NDArray[np.float64], q1: NDArray[np.float64], share: float) -> NDArray[np.float64]:
    """Return the rotation on the shortest way from q0 to q1 (Shoemake 1985)."""
    across, angle = arc(q0, q1)
    return np.asarray(math.cos(share * angle) * q0 + math.sin(share * angle) * across)
