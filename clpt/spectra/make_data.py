"""Write the tables in clpt/spectra/data from their sources; run by hand.

    python -m clpt.spectra.make_data [refractiveindex.info-database]

Observers and illuminants come from colour-science (BSD-3, the extra clpt[test]). The metals are
rewritten only when a checkout of refractiveindex.info's database (CC0) is given.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats
from clpt.spectra import cie, files
from clpt.spectra.data import ROOT
from clpt.spectra.dispersion import POINTS
from clpt.spectra.spectrum import Tabulated, d65
from clpt.spectra.upsampling import NODES, QUANTUM, node_colours, shrinkage, to_unit

LAMPS = (
    *(f"F{i}" for i in range(1, 13)),
    *(f"HP{i}" for i in range(1, 6)),
    *(f"LED-{name}" for name in ("B1", "B2", "B3", "B4", "B5", "BH1", "RGB1", "V1", "V2")),
)
METALS_WITHIN = (300.0, 1100.0)  # [nm]
PRIMARIES_STEP = 5.0  # [nm]
PRIMARIES_WEIGHT = 3e3  # of colours and sums against smoothness
FORMULA_AT = np.arange(300.0, 1101.0, 20.0)  # [nm], where pages of formulas are tabulated
STEP = 2  # [nm] of the quadrature; at 5 nm it alone costs 0.2 in Delta E for steep spectra
ITERATIONS = 10  # a layer, from its neighbour's solution


def write_csv(path: Path, notes: list[str], header: str, rows: np.ndarray) -> None:
    """Write rows (n, m) float64 as CSV under `#` comments."""
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = [f"# {note}" for note in [*notes, header]]
    lines += [",".join(f"{value:.9g}" for value in row) for row in rows]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_observers() -> None:
    """Colour matching functions at 1 nm from 360 to 830 nm."""
    import colour

    for year, name in (("1931", "2 Degree"), ("1964", "10 Degree")):
        cmfs = colour.MSDS_CMFS[f"CIE {year} {name} Standard Observer"]
        write_csv(
            ROOT / f"cie{year}.csv",
            [f"CIE {year} {name.lower()} standard observer, from colour-science (BSD-3-Clause)"],
            "lambda [nm], x, y, z",
            np.column_stack([cmfs.wavelengths, cmfs.values]),
        )


def write_illuminants() -> None:
    """Relative powers: A and the D series by their CIE 15 formulas, and the tables of lamps."""
    import colour

    def daylight(kelvin: float) -> colour.SpectralDistribution:
        # CIE 15 rescales the nominal temperature to today's value of c2 in Planck's law.
        xy = colour.temperature.CCT_to_xy_CIE_D(kelvin * 1.4388 / 1.4380)
        return colour.sd_CIE_illuminant_D_series(xy)

    tables = {
        "A": colour.sd_CIE_standard_illuminant_A(colour.SpectralShape(300, 830, 5)),
        "D50": daylight(5000.0),
        "D65": daylight(6500.0),
    }
    tables |= {name: colour.SDS_ILLUMINANTS[re.sub("^F", "FL", name)] for name in LAMPS}
    for name, table in tables.items():
        write_csv(
            ROOT / "illuminants" / f"{name}.csv",
            [f"CIE illuminant {name}, from colour-science (BSD-3-Clause)"],
            "lambda [nm], relative power",
            np.column_stack([table.wavelengths, table.values]),
        )


def rewrite_metals(database: Path) -> None:
    """Read each metal again from the page its file names."""
    for path in sorted((ROOT / "metals").glob("*.csv")):
        notes = [line[2:] for line in path.read_text("utf-8").splitlines()[:2]]
        page = notes[1].split(", ")[1]
        group, material, author = page.split("/")
        pages = sorted(database.glob(f"**/{group}/{material}/**/{author}"))
        if not pages:
            print(f"{page}: not in {database}, kept as it is")
            continue
        eta, k = files.read_refractive_index(pages[0])
        lambdas = FORMULA_AT
        if isinstance(eta, Tabulated):
            known = np.array(eta.lambdas)
            lambdas = known if len(known) != POINTS else lambdas
            lambdas = lambdas[(lambdas >= known[0]) & (lambdas <= known[-1])]
        rows = np.column_stack([lambdas, eta.sample(lambdas), k.sample(lambdas)])
        keep = (lambdas >= METALS_WITHIN[0]) & (lambdas <= METALS_WITHIN[1])
        write_csv(path, notes, "lambda [nm], eta, k", rows[keep])


def write_primaries() -> None:
    at, values = primaries()
    header = "wavelength [nm], reflectances of red, green and blue (make_data.py)"
    np.savetxt(ROOT / "primaries.csv", np.vstack([at, values]).T, "%.7f", ",", header=header)


def primaries() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return wavelengths (n,) [nm] and the primaries' reflectances (3, n).

    They lie in [0, 1], have the colours of Rec. 709's primaries under D65, add up to 1 at every
    wavelength, and are as smooth as that allows (Mallett and Yuksel 2019, eq. 6 to 9).
    """
    from scipy.optimize import lsq_linear

    nodes = np.arange(cie.LAMBDA_MIN, cie.LAMBDA_MAX + 0.1, PRIMARIES_STEP)
    n = len(nodes)
    hats = np.stack([np.interp(cie.GRID, nodes, hat) for hat in np.eye(n)])
    seen = cie.xyz_to_rgb(cie.spectrum_to_xyz(hats * d65().sample(cie.GRID))).T
    colours = np.kron(np.eye(3), seen)
    bends = np.kron(np.eye(3), np.diff(np.eye(n), 2, axis=0))
    sums = np.hstack([np.eye(n)] * 3)
    rows = np.vstack([PRIMARIES_WEIGHT * colours, bends, PRIMARIES_WEIGHT * sums])
    at_colours, at_sums = PRIMARIES_WEIGHT * np.eye(3).reshape(-1), np.full(n, PRIMARIES_WEIGHT)
    wanted = [at_colours, np.zeros(len(bends)), at_sums]
    options = {"tol": 1e-14, "max_iter": 2000, "lsq_solver": "exact"}
    solution = lsq_linear(rows, np.concatenate(wanted), (0.0, 1.0), **options)
    return nodes, solution.x.reshape(3, n)


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
    """Coefficients (3, NODES, NODES, NODES, 3) at `node_colours()`, from the middle layers out.

    For every colour of the grid: the polynomial under the sigmoid whose reflectance, lit by D65,
    has that colour, by damped Gauss-Newton steps on the difference in CIELAB (Jakob and Hanika
    2019).
    """
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


def write_uplift() -> None:
    """Fit the table behind `uplift`: differences of quantised coefficients; takes a minute."""
    steps = np.rint(fit() * shrinkage(node_colours())[..., None] / QUANTUM).astype(np.int32)
    for axis in (1, 2, 3):
        steps = np.diff(steps, axis=axis, prepend=0)
    np.savez_compressed(ROOT / "uplift.npz", steps=np.moveaxis(steps, -1, 0))


if __name__ == "__main__":
    write_observers()
    write_illuminants()
    write_primaries()
    write_uplift()
    if len(sys.argv) > 1:
        rewrite_metals(Path(sys.argv[1]))
