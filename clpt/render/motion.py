"""Motion as words: the tracks of moving objects, and the shutter."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.geometry.motion import Motions
from clpt.records import MOTION_SIZES
from clpt.render.records.tables import TableStore
from clpt.scene.motion import Keys, Shutter, arc, decomposed

STEP = MOTION_SIZES["step"]


def track(keys: Keys | None) -> NDArray[np.float32]:
    """Return the track of keys, None for a track at rest, see kernels/motion/motion.cl."""
    times: Sequence[float] = (0.0, 1.0) if keys is None else keys.times
    matrices: Any = np.stack([np.eye(4)] * 2) if keys is None else keys.transforms
    words = np.zeros(1 + STEP * (len(times) - 1), np.float32)
    words[:1] = np.array([len(times) - 1], np.int32).view(np.float32)
    upper = np.triu_indices(3)
    for i in range(len(times) - 1):
        step = words[1 + STEP * i : 1 + STEP * (i + 1)]
        (t0, q0, s0), (t1, q1, s1) = (decomposed(matrices[k]) for k in (i, i + 1))
        across, angle = arc(q0, q1)
        step[0], step[1] = times[i], 1.0 / (times[i + 1] - times[i])
        step[2:5], step[5:8], step[8:12], step[12:16] = t0, t1 - t0, q0, across
        step[16] = angle / (2.0 * math.pi)
        step[17:23], step[23:29] = s0[upper], (s1 - s0)[upper]
    return words


def shutter_words(shutter: Shutter) -> NDArray[np.float32]:
    """Return the words of a shutter.

    They are the number of steps, the opening time and the open time of a row [s], then for each
    step the share of light before it and the density at both ends, and last the readout [s].
    """
    density = shutter.density()
    shares = (density[1:] + density[:-1]) / 2.0
    shares, density = shares / shares.sum(), density / shares.mean()
    before = np.cumsum([0.0, *shares[:-1]])
    rows = np.column_stack([before, density[:-1], density[1:]])
    head = [len(shares), shutter.open, shutter.close - shutter.open - shutter.readout]
    return np.concatenate([head, rows.ravel(), [shutter.readout]]).astype(np.float32)


def lower_motion(motions: Motions, shapes: int, rows: list[int], store: TableStore) -> int:
    """Append the table of motion to `distributions`; return its first word.

    shapes: the number of the scene's shapes; rows: the index of each light without a shape, in the
    order of rows; -1 for a light at rest.
    """
    head = 4 + bool(motions.deforming)
    first = store.size("distributions")
    parts = [np.zeros(head, np.float32), shutter_words(motions.shutter), track(None)]
    still = head + len(parts[1])
    at = still + len(parts[-1])
    places: dict[int, int] = {}

    def place(keys: Keys | None) -> int:
        nonlocal at
        if keys is None:
            return first + still
        if id(keys) not in places:
            parts.append(track(keys))
            places[id(keys)] = first + at
            at += len(parts[-1])
        return places[id(keys)]

    camera = place(motions.camera)
    of_shapes = [place(motions.shapes.get(i)) for i in range(shapes)] or [first + still]
    of_lamps = [place(motions.lamps.get(i)) for i in rows] or [first + still]
    maps = np.array([*of_shapes, *of_lamps], np.int32).view(np.float32)
    heads = [first + head, camera, first + at, first + at + len(of_shapes)]
    if motions.deforming:
        heads.append(first + at + len(maps))
        maps = np.concatenate([maps, _deformations(motions, shapes, heads[-1])])
    parts[0] = np.array(heads, np.int32).view(np.float32)
    # kernels read a step beyond the last
    parts += [maps, np.zeros(STEP + 1, np.float32)]
    return store.append_floats("distributions", np.concatenate(parts))


def _deformations(motions: Motions, count: int, first: int) -> NDArray[np.float32]:
    """Return for each shape the first word of its steps, and the steps of all shapes.

    The words of a shape are the number of steps, then each step's begin [s] and inverse length
    [1/s]. A shape that does not deform has no steps. See kernels/motion/motion.cl.
    """
    places, parts, at = np.full(count, first + count, np.int32), [np.zeros(3, np.float32)], 3
    first_words: dict[tuple[float, ...], int] = {}
    for number, times in motions.deforming.items():
        if times not in first_words:
            first_words[times] = first + count + at
            steps = np.array([len(times) - 1], np.int32).view(np.float32)
            rows = np.column_stack([times[:-1], 1.0 / np.diff(times)]).astype(np.float32)
            parts.append(np.concatenate([steps, rows.ravel()]))
            at += len(parts[-1])
        places[number] = first_words[times]
    return np.concatenate([places.view(np.float32), *parts])
