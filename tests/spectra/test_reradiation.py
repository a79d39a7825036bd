"""Re-radiation matrices: between nodes, energy, photons; measured files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clpt.errors import SceneError
from clpt.scene.materials import Fluorescent
from clpt.spectra import (
    LED,
    Constant,
    Donaldson,
    Fluorophore,
    Tabulated,
    read_bispectral,
    read_reradiation,
)

MATRIX = Donaldson((500.0, 510.0, 530.0), (400.0, 420.0), ((0, 0.01), (0.02, 0.01), (0, 0.02)))
GREEN = Tabulated((480.0, 520.0, 620.0), (0.0, 1.0, 0.0))
FINE = np.arange(250.0, 900.0, 0.5)  # [nm]


def test_a_matrix_is_bilinear_between_its_nodes_and_zero_outside() -> None:
    assert MATRIX.sample(510.0, 400.0) == pytest.approx(0.02)
    middle = (0.02 + 0.01 + 0.0 + 0.02) / 4.0
    assert MATRIX.sample(520.0, 410.0) == pytest.approx(middle)
    assert np.all(MATRIX.sample([499.0, 531.0, 510.0, 510.0], [410.0, 410.0, 399.0, 421.0]) == 0.0)
    assert MATRIX.sample(np.zeros((3, 1)), np.zeros(4)).shape == (3, 4)


def test_emitted_is_the_integral_over_what_leaves() -> None:
    sums = MATRIX.sample(np.arange(500.0, 530.01, 0.1)[:, None], [400.0, 410.0, 420.0]).sum(0) * 0.1
    np.testing.assert_allclose(MATRIX.emitted([400.0, 410.0, 420.0]), sums, rtol=5e-3)


@pytest.mark.parametrize("into", [350.0, 430.0, 470.0])
def test_a_dye_gives_as_many_photons_as_its_yield(into: float) -> None:
    """Photons out over photons in: the energy of one is proportional to 1 / wavelength."""
    dye = Fluorophore(Constant(0.8), GREEN, 0.75)
    energy = dye.sample(FINE, into)
    assert (energy * FINE / into).sum() * 0.5 == pytest.approx(0.8 * 0.75, rel=1e-3)
    assert energy.sum() * 0.5 < 0.8 * 0.75 * into / 500.0
    assert dye.emitted(into) == pytest.approx(energy.sum() * 0.5, rel=1e-3)


def test_a_dye_emits_its_spectrum_whatever_excites_it() -> None:
    dye = Fluorophore(Tabulated((300.0, 480.0), (0.2, 0.9)), GREEN)
    a, b = (dye.sample(FINE, into) for into in (330.0, 450.0))
    np.testing.assert_allclose(a / a.max(), GREEN.sample(FINE), atol=2e-3)
    np.testing.assert_allclose(a / a.max(), b / b.max(), atol=1e-12)


def test_nothing_leaves_at_a_shorter_wavelength() -> None:
    dye = Fluorophore(Constant(0.5), GREEN, 1.0)
    out, into = np.meshgrid(FINE[::10], FINE[::10], indexing="ij")
    assert np.all(dye.sample(out, into)[out <= into - 5.0] == 0.0)
    kept = (dye.sample(FINE, 560.0) * FINE / 560.0).sum() * 0.5  # half of the emission is left out
    assert kept == pytest.approx(0.5, rel=2e-3)
    assert dye.emitted(700.0) == 0.0


def triangle(at: float, half: float) -> Tabulated:
    return Tabulated((at - half, at, at + half), (0.0, 1.0, 0.0))


@pytest.mark.parametrize("first", [250.0, 360.0, 362.5, 401.3])
@pytest.mark.parametrize("absorbed", [463.0, 464.0, 465.0])
@pytest.mark.parametrize("emitted", [(612.0, 2.2), (612.5, 1.5)])
def test_narrow_lines_keep_their_photons(
    first: float, absorbed: float, emitted: tuple[float, float]
) -> None:
    """Rare earths: out come as many photons as are absorbed of a lamp, wherever the nodes are."""
    dye = Fluorophore(triangle(absorbed, 2.0), triangle(*emitted))
    lamp = LED(465.0, 60.0)  # narrower ones are blurred by the hats, at 20 nm by 7 %
    nodes = np.arange(first, 905.0, 5.0)
    taken = np.trapezoid(lamp.sample(FINE) * dye.absorption.sample(FINE) * FINE, FINE)
    arriving = lamp.sample(FINE)[:, None] * np.maximum(1 - np.abs(FINE[:, None] - nodes) / 5, 0)
    for matrix in (dye.on_nodes(nodes), dye.sample(nodes[:, None], nodes)):
        given = (matrix * nodes[:, None]) @ (arriving.sum(axis=0) * 0.5) * 5.0
        assert given.sum() == pytest.approx(taken, rel=0.02)


@pytest.mark.parametrize("first", [250.0, 362.5])
def test_the_yield_holds_in_a_dye_s_tail(first: float) -> None:
    """Where a dye is excited within its own emission, no more comes out than went in."""
    dye = Fluorophore(Constant(1.0), GREEN)
    nodes = np.arange(first, 905.0, 5.0)
    photons = (dye.on_nodes(nodes) * nodes[:, None] / nodes).sum(axis=0) * 5.0
    assert photons.max() == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("first", [390.0, 392.5])
def test_a_matrix_keeps_what_lies_between_the_nodes(first: float) -> None:
    nodes = np.arange(first, 545.0, 5.0)
    rows = ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))
    between = Donaldson((500.0, 502.0, 504.0), (401.0, 402.0, 404.0), rows)
    whole = 1.0 * 1.0 + 2.0 * 1.5 + 1.0 * 0.5  # by the trapezoid rule on its own wavelengths
    assert between.on_nodes(nodes).sum() * 25.0 == pytest.approx(whole, rel=1e-9)


@pytest.mark.parametrize(
    "make",
    [
        lambda: Donaldson((500.0,), (400.0, 420.0), ((0.0, 0.0),)),
        lambda: Donaldson((500.0, 490.0), (400.0, 420.0), ((0.0, 0.0),) * 2),
        lambda: Donaldson((500.0, 510.0), (400.0, 420.0), ((0.0, 0.0), (0.0,))),
        lambda: Donaldson((500.0, 510.0), (400.0, 420.0), ((0.0, 0.0), (0.0, -1.0))),
        lambda: Donaldson((500.0, 510.0), (400.0, 420.0), ((0.0, 0.0), (0.0, np.nan))),
        lambda: Fluorophore(Constant(1.5), GREEN),
        lambda: Fluorophore(Constant(0.5), Constant(0.0)),
        lambda: Fluorophore(Constant(0.5), GREEN, 1.2),
        lambda: Fluorescent(reradiation=0.5),
        lambda: Fluorescent(reflectance=0.8, reradiation=Fluorophore(Constant(0.5), GREEN)),
    ],
)
def test_what_makes_no_sense_is_refused(make) -> None:
    with pytest.raises(SceneError):
        make()


def test_the_amount_counts_for_energy() -> None:
    dye = Fluorophore(Constant(0.5), GREEN)
    Fluorescent(reflectance=0.8, reradiation=dye, amount=0.4)


FILES = ("CIBA12.BFC", "HERPICER.BFC", "PHP8HP1C.BFC", "POLGREE.BFC")


@pytest.mark.parametrize("name", FILES)
def test_measured_matrices(assets: Path, name: str) -> None:
    """Read as they are, but for noise: the file's own sums, told apart by hand here."""
    path = assets / "spectral" / "fluorescence-bfc" / name
    reflectance, matrix = read_bispectral(path)
    lines = path.read_text().splitlines()
    raw = np.array([[float(v) for v in line.split()] for line in lines[12:] if line != "EOD"])
    out, into, raw = raw[:, 0], np.arange(300.0, 781.0, 10.0), raw[:, 1:]
    assert read_reradiation(path) == matrix
    assert len(out) == 41 and raw.shape == (41, 49)
    # The share that leaves 20 nm away or more: what was left out is noise, mostly below zero.
    away = np.where(out[:, None] - into >= 20.0, raw, 0.0).sum(axis=0).mean()
    ours = 10.0 * np.where(out[:, None] - into >= 20.0, matrix.sample(out[:, None], into), 0.0)
    assert ours.sum(axis=0).mean() == pytest.approx(away, abs=0.0065)
    assert ours.max() == pytest.approx(np.max(raw * (out[:, None] - into >= 20.0)))
    diagonal = np.array([raw[i, i + 8] for i in range(41)])
    near = 5.0 * matrix.sample(out, out - 10.0)
    np.testing.assert_allclose(reflectance.sample(out), np.maximum(diagonal - near, 0), atol=1e-9)
    assert np.all(reflectance.sample(into) + matrix.emitted(into) < 1.0)
    Fluorescent(reflectance=reflectance, reradiation=matrix)


def test_a_table_of_our_own(tmp_path: Path) -> None:
    path = tmp_path / "matrix.csv"
    path.write_text("# a dye\nout/in, 400, 420\n500, 0, 0.01\n510; 0.02 0.01\n530, 0, 0.02 # end\n")
    assert read_reradiation(path) == MATRIX


@pytest.mark.parametrize(
    "text",
    ["", "x 400 420\n500 1 2\n", "x 400 420\n500 1 2\n510 1\n", "x 400 420\n500 1 2\n510 1 b\n"],
)
@pytest.mark.parametrize("suffix", [".csv", ".BFC"])
def test_broken_tables_are_refused(tmp_path: Path, text: str, suffix: str) -> None:
    path = tmp_path / f"matrix{suffix}"
    path.write_text(text)
    with pytest.raises(SceneError) as caught:
        read_reradiation(path)
    assert str(path) in str(caught.value)
