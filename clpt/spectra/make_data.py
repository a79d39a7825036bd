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
from scipy.optimize import lsq_linear

from clpt.spectra import cie, files
from clpt.spectra.data import ROOT
from clpt.spectra.dispersion import POINTS
from clpt.spectra.spectrum import Tabulated, d65

LAMPS = (
    *(f"F{i}" for i in range(1, 13)),
    *(f"HP{i}" for i in range(1, 6)),
    *(f"LED-{name}" for name in ("B1", "B2", "B3", "B4", "B5", "BH1", "RGB1", "V1", "V2")),
)
METALS_WITHIN = (300.0, 1100.0)  # [nm]
PRIMARIES_STEP = 5.0  # [nm]
PRIMARIES_WEIGHT = 3e3  # of colours and sums against smoothness
FORMULA_AT = np.arange(300.0, 1101.0, 20.0)  # [nm], where pages of formulas are tabulated


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


if __name__ == "__main__":
    write_observers()
    write_illuminants()
    write_primaries()
    if len(sys.argv) > 1:
        rewrite_metals(Path(sys.argv[1]))
