"""Writes the grids of a candle's flame and of smoke: soot.npy, kelvin.npy and smoke.npy.

The soot is where a flame is yellow, above the dark zone at the wick; there it is also hottest. The
smoke is noise, bent and thinned upward. All are bytes, x, y and z, with y up.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

HERE = Path(__file__).parent
FLAME = (20, 56, 20)
SMOKE = (64, 80, 24)


def main() -> None:
    """Write them."""
    x, y, z = _points(FLAME)
    r = np.hypot(2.0 * x - 1.0, 2.0 * z - 1.0)
    wide = 1.55 * np.sqrt(y) * (1.0 - y) ** 0.75 + 1e-3
    inside = np.exp(-((r / (0.85 * wide)) ** 4))
    rises = np.clip((y - 0.12) / 0.35, 0.0, 1.0)
    shell = 0.5 + 0.5 * np.clip(r / wide, 0.0, 1.0) ** 2
    soot = inside * rises**2 * (3.0 - 2.0 * rises) * shell
    _write("soot", soot / soot.max())
    kelvin = 1400.0 + 350.0 * np.clip(r / wide, 0.0, 1.0) ** 2 + 250.0 * np.sin(np.pi * y**0.8)
    np.save(HERE / "kelvin.npy", kelvin.astype(np.float16))
    x, y, z = _points(SMOKE)
    bend = 0.11 * np.sin(5.0 * y + 1.0) + 0.05 * np.sin(11.0 * y)
    across = (x - 0.5 - bend * (0.3 + y)) / (0.07 + 0.26 * y)
    deep = (z - 0.5) / (0.12 + 0.22 * y)
    curls = sum(_noise(SMOKE, 4 * 2**i, i) / 2**i for i in range(4))
    smoke = np.exp(-(across**2 + deep**2)) * np.clip(curls - 0.95, 0.0, None) ** 1.3
    ends = np.clip(8.0 * y, 0.0, 1.0) * np.clip(3.0 * (1.0 - y), 0.0, 1.0)
    _write("smoke", smoke * ends / (smoke * ends).max())


def _points(shape: tuple[int, int, int]) -> tuple[NDArray[np.float64], ...]:
    """The centres of cells in the unit cube."""
    axes = [(np.arange(n) + 0.5) / n for n in shape]
    return tuple(np.meshgrid(*axes, indexing="ij"))


def _noise(shape: tuple[int, int, int], cells: int, seed: int) -> NDArray[np.float64]:
    """Random numbers in [0, 1] on a lattice, smooth between its points."""
    lattice = np.random.default_rng(seed).random((cells + 2,) * 3)
    at = [p * cells for p in _points(shape)]
    low = [p.astype(int) for p in at]
    share = [(p - q) ** 2 * (3.0 - 2.0 * (p - q)) for p, q in zip(at, low, strict=True)]
    sums = np.zeros(shape)
    for corner in np.ndindex(2, 2, 2):
        weight = np.ones(shape)
        for s, c in zip(share, corner, strict=True):
            weight *= s if c else 1.0 - s
        sums += weight * lattice[tuple(p + c for p, c in zip(low, corner, strict=True))]
    return sums


def _write(name: str, values: NDArray[np.float64]) -> None:
    np.save(HERE / f"{name}.npy", np.rint(255.0 * values).astype(np.uint8))


if __name__ == "__main__":
    main()
