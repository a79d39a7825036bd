"""Fit the table behind `uplift` and write data/uplift.npz; run by hand, about a minute.

    python -m clpt.spectra.make_uplift

For every colour of the grid: the polynomial under the sigmoid whose reflectance, lit by D65, has
that colour, by damped Gauss-Newton steps on the difference in CIELAB (Jakob and Hanika 2019).
"""

from __future__ import annotations

import numpy as np

from clpt.arrays import Floats
from clpt.spectra import cie
from clpt.spectra.data import ROOT
from clpt.spectra.spectrum import d65
from clpt.spectra.upsampling import NODES, QUANTUM, node_colours, shrinkage, to_unit

STEP = 2  # [nm] of the quadrature; at 5 nm it alone costs 0.2 in Delta E for steep spectra
ITERATIONS = 10  # a layer, from its neighbour's solution


def hat_weights() -> tuple[Floats, Floats]:
    """Unit coordinates (m,) and XYZ weights (m, 3) of reflectances given every STEP nm."""
    coarse = cie.GRID[::STEP]
    hats = np.array([np.interp(cie.GRID, coarse, row) for row in np.eye(coarse.size)])
    return to_unit(coarse), hats @ (
        cie.cie_xyz(cie.GRID) * d65().sample(cie.GRID)[:, None] / cie.CIE_Y_INTEGRAL
    )


def lab(xyz: Floats) -> tuple[Floats, Floats]:
    """CIELAB under D65 of XYZ (n, 3), and its Jacobian (n, 3, 3)."""
    relative = np.maximum(xyz / cie.D65_WHITE, 0.0)
    dark = relative < (6.0 / 29.0) ** 3
    root = np.cbrt(np.where(dark, 1.0, relative))
    slope = (29.0 / 6.0) ** 2 / 3.0
    f = np.where(dark, slope * relative + 4.0 / 29.0, root)
    df = np.where(dark, slope, 1.0 / (3.0 * root * root)) / cie.D65_WHITE
    mix = np.array([[0.0, 116.0, 0.0], [500.0, -500.0, 0.0], [0.0, 200.0, -200.0]])
    return f @ mix.T - [16.0, 0.0, 0.0], mix * df[:, None, :]


def gauss_newton(rgb: Floats, start: Floats, iterations: int) -> Floats:
    """Coefficients (n, 3) over the unit coordinate, improved from `start`, for colours (n, 3)."""
    unit, weights = hat_weights()
    powers = unit[:, None] ** [2, 1, 0]
    slopes = np.concatenate([weights * powers[:, j : j + 1] for j in range(3)], axis=1)
    target = lab(cie.rgb_to_xyz(rgb))[0]

    def cost_at(c: Floats) -> tuple[Floats, Floats, Floats]:
        x = c @ powers.T
        inverse = 1.0 / np.sqrt(1.0 + x * x)
        error, jacobian = lab((0.5 + 0.5 * x * inverse) @ weights)
        error -= target
        dxyz = (0.5 * inverse**3 @ slopes).reshape(-1, 3, 3)  # [n, coefficient, xyz]
        return (error**2).sum(1), error, jacobian @ dxyz.transpose(0, 2, 1)

    c, damping = start.copy(), np.full(len(start), 1e-3)
    cost, error, jacobian = cost_at(c)
    for _ in range(iterations):
        normal = jacobian.transpose(0, 2, 1) @ jacobian
        diagonal = np.einsum("nii->ni", normal)
        damped = normal + (damping[:, None] * (diagonal + 1e-12))[:, :, None] * np.eye(3)
        gradient = np.einsum("nij,ni->nj", jacobian, error)
        trial = c - np.linalg.solve(damped, gradient[:, :, None])[:, :, 0]
        trial_cost, trial_error, trial_jacobian = cost_at(trial)
        better = trial_cost < cost
        c[better], cost[better] = trial[better], trial_cost[better]
        error[better], jacobian[better] = trial_error[better], trial_jacobian[better]
        damping = np.clip(np.where(better, damping / 5.0, damping * 4.0), 1e-9, 1e6)
    return c


def fit() -> Floats:
    """Coefficients (3, NODES, NODES, NODES, 3) at `node_colours()`, from the middle layers out."""
    colours = node_colours()
    table = np.zeros(colours.shape)
    middle = NODES // 2
    middle_rgb = colours[:, middle].reshape(-1, 3)
    middle_fit = gauss_newton(middle_rgb, np.zeros(middle_rgb.shape), 5 * ITERATIONS)
    for order in (range(middle, NODES), range(middle - 1, -1, -1)):
        current, previous = middle_fit, middle_rgb
        for z in order:
            rgb = colours[:, z].reshape(-1, 3)
            # A flat spectrum's coefficients grow like 1 / shrinkage towards black and white.
            start = current * (shrinkage(previous) / shrinkage(rgb))[:, None]
            current, previous = gauss_newton(rgb, start, ITERATIONS), rgb
            table[:, z] = current.reshape(table[:, z].shape)
    return table


if __name__ == "__main__":
    steps = np.rint(fit() * shrinkage(node_colours())[..., None] / QUANTUM).astype(np.int32)
    for axis in (1, 2, 3):
        steps = np.diff(steps, axis=axis, prepend=0)
    np.savez_compressed(ROOT / "uplift.npz", steps=np.moveaxis(steps, -1, 0))
    print(f"{ROOT / 'uplift.npz'}: {(ROOT / 'uplift.npz').stat().st_size / 1024:.0f} KiB")
