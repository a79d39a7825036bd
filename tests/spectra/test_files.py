"""clpt.spectra.files: what is read, and how bad files are told."""

import numpy as np
import pytest

from clpt import spectra
from clpt.errors import SceneError


def write(tmp_path, text, name="s.spd"):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "text",
    [
        "# from somewhere\n400 1\n\n500.5\t2 # end\n",
        "wavelength,value\n400,1\n500.5,2\n",
        "nm;power\r\n400;1\r\n500.5;2\r\n",
    ],
)
def test_tables(tmp_path, text):
    expected = spectra.Tabulated((400, 500.5), (1, 2), "hold")
    assert spectra.read_table(write(tmp_path, text), "hold") == expected


@pytest.mark.parametrize(
    "text, line, message",
    [
        ("400 1\n500 x\n", 2, "expected a wavelength"),
        ("400 1 2\n", 1, "expected a wavelength"),
        ("# a\n500 1\n400 2\n", 3, "ascend"),
        ("400 1\nnm power\n", 2, "expected a wavelength"),
        ("# only a comment\n", None, "no wavelengths"),
        ("400 nan\n", None, "finite"),
    ],
)
def test_bad_tables_tell_the_line(tmp_path, text, line, message):
    path = write(tmp_path, text)
    with pytest.raises(SceneError, match=message) as caught:
        spectra.read_table(path)
    assert caught.value.file == path and caught.value.line == line


def test_missing_file(tmp_path):
    with pytest.raises(SceneError, match="cannot be read"):
        spectra.read_table(tmp_path / "none.spd")


def page(kind, body):
    return f"REFERENCES: someone\nDATA:\n  - type: {kind}\n{body}\n"


def formula(number, coefficients):
    body = f"    wavelength_range: 0.3 2.5\n    coefficients: {coefficients}"
    return page(f"formula {number}", body)


N_BK7 = "0 1.03961212 0.00600069867 0.231792344 0.0200179144 1.01046945 103.560653"


D = 0.5875618  # [um], the helium line of nd


@pytest.mark.parametrize(
    "text, index",
    [
        (formula(2, N_BK7), 1.51680),
        (formula(1, "0 1.4313493 0.0726631 0.65054713 0.1193242 5.3414021 18.028251"), 1.76817),
        (formula(3, "2.25 0.01 -2"), np.sqrt(2.25 + 0.01 / 0.5875618**2)),
        (formula(4, "5.913 0.2441 0 0.0803 1"), 2.61427),
        (formula(5, "1.5 0.004 -2"), 1.5 + 0.004 / 0.5875618**2),
        (formula(5, "1.5 0.004 -2.5"), 1.5 + 0.004 / 0.5875618**2.5),
        (formula(6, "0 0.05792105 238.0185 0.00167917 57.362"), 1.00027717),
        (
            formula(7, "3.4 0.16 -0.12 1e-3 2e-4 3e-5"),
            3.4
            + 0.16 / (D**2 - 0.028)
            - 0.12 / (D**2 - 0.028) ** 2
            + 1e-3 * D**2
            + 2e-4 * D**4
            + 3e-5 * D**6,
        ),
        (formula(8, "0.452505 0.09939 0.070537 -0.000150"), 2.25795),  # silver bromide
        (
            formula(9, "2.51527 0.0240 0.0300 0.020 1.52 0.8771"),
            np.sqrt(
                2.51527 + 0.024 / (D**2 - 0.03) + 0.02 * (D - 1.52) / ((D - 1.52) ** 2 + 0.8771)
            ),
        ),
    ],
)
def test_dispersion_formulas(tmp_path, text, index):
    eta, k = spectra.read_refractive_index(write(tmp_path, text))
    assert eta.sample(587.5618) == pytest.approx(index, abs=2e-5)
    assert k == spectra.Constant(0.0)


@pytest.mark.parametrize(
    "text, k_given",
    [
        ("400 1.5 2.0\n600 2.5 4.0\n", True),
        ("nm;n;k\n400;1.5;2\n600;2.5;4\n", True),
        # as refractiveindex.info exports it
        ("wl,n\n0.4,1.5\n0.6,2.5\nwl,k\n0.4,2\n0.6,4\n", True),
        ("wl,n\n0.4,1.5\n0.6,2.5\n", False),
        ("400,1.5\n600,2.5\n", False),
    ],
)
def test_columns_of_eta_and_k(tmp_path, text, k_given):
    path = write(tmp_path, text, "metal.csv")
    eta, k = spectra.read_refractive_index(path)
    np.testing.assert_allclose(eta.sample([300, 500, 900]), [1.5, 2.0, 2.5])
    np.testing.assert_allclose(k.sample([300, 500]), [2.0, 3.0] if k_given else 0.0)
    assert spectra.read_index(path) == eta
    # Two plain columns are the quantity that is asked for.
    assert spectra.read_index(path, "k") == (eta if text[0] == "4" and not k_given else k)


def test_pages_of_k_alone(tmp_path):
    body = "    data: |\n        0.40 1e-6\n        0.60 3e-6"
    path = write(tmp_path, page("tabulated k", body), "ink.yml")
    assert spectra.read_index(path, "k").sample(500.0) == pytest.approx(2e-6)
    with pytest.raises(SceneError, match="no refractive index"):
        spectra.read_index(path)


@pytest.mark.parametrize(
    "text, line", [("400 1 2\n500 1\n", 2), ("400\n", 1), ("wl,n\n0.4,1.5,2\n0.5,1\n", 3)]
)
def test_bad_columns_tell_the_line(tmp_path, text, line):
    with pytest.raises(SceneError, match="eta and perhaps k") as caught:
        spectra.read_refractive_index(write(tmp_path, text, "metal.csv"))
    assert caught.value.line == line


def test_tabulated_pages(tmp_path):
    body = "    data: |\n        0.40 1.5 2.0\n        0.40 1.6 2.0\n        0.60 2.5 4.0"
    eta, k = spectra.read_refractive_index(write(tmp_path, page("tabulated nk", body)))
    np.testing.assert_allclose(eta.sample([300, 400, 500, 900]), [1.5, 1.5, 2.0, 2.5])
    np.testing.assert_allclose(k.sample([300, 500, 900]), [2.0, 3.0, 4.0])
    both = (
        formula(2, N_BK7)
        + "  - type: tabulated k\n    data: |\n        0.4 1e-6\n        0.6 2e-6\n"
    )
    eta, k = spectra.read_refractive_index(write(tmp_path, both))
    assert isinstance(eta, spectra.Sellmeier)
    assert k.sample(500.0) == pytest.approx(1.5e-6)


@pytest.mark.parametrize(
    "text, line, message",
    [
        ("DATA: [", 1, "not YAML"),
        ("a: 1", None, "no list DATA"),
        (formula(10, "1 2 3"), 3, "formula '10'"),
        (formula(8, "1 2 3 4 5"), 3, "takes 4 coefficients, not 5"),
        (formula(2, "1 2"), 3, "odd number"),
        (formula(2, "1 x 2"), 3, "expected numbers"),
        (page("tabulated nk", "    data: |\n        0.4 1.5"), 5, "expected 3 numbers"),
        (page("tabulated k", "    data: |\n        0.4 1.5"), None, "no refractive index"),
        (page("drawing", "    data: 1"), 3, "unknown type"),
    ],
)
def test_bad_pages_tell_the_line(tmp_path, text, line, message):
    path = write(tmp_path, text, "page.yml")
    with pytest.raises(SceneError, match=message) as caught:
        spectra.read_refractive_index(path)
    assert caught.value.file == path and caught.value.line == line


def test_database_pages_agree_with_the_tables(assets):
    """Pages of the database are read, and hold what our transcriptions of them hold."""
    folder = assets / "spectral" / "refractiveindex.info"
    pages = {f"{p.parent.parent.name}/{p.stem}": p for p in folder.glob("main/*/nk/*.yml")}
    if not pages:
        pytest.skip("no refractiveindex.info pages among the assets")
    visible = np.arange(400.0, 700.0, 3.0)
    for page in pages.values():
        eta, k = spectra.read_refractive_index(page)
        assert (eta.sample(visible) > 0).all() and (k.sample(visible) >= 0).all(), page
    for name, author in (("Au", "Johnson"), ("Ag", "Johnson"), ("Cr", "Johnson"), ("Al", "Rakic")):
        for ours, theirs in zip(
            spectra.metal(name),
            spectra.read_refractive_index(pages[f"{name}/{author}"]),
            strict=True,
        ):
            np.testing.assert_allclose(ours.sample(visible), theirs.sample(visible), rtol=1e-9)
    assert spectra.read_refractive_index(pages["H2O/Hale"])[1].sample(500.0) > 0


GLASSES = {
    "bk7": "specs/schott/optical/N-BK7.yml",
    "f2": "specs/schott/optical/F2.yml",
    "n-sf11": "specs/schott/optical/N-SF11.yml",
    "fused silica": "main/SiO2/nk/Malitson.yml",
    "diamond": "main/C/nk/Peter.yml",
    "calcite": "main/CaCO3/nk/Ghosh-o.yml",
    "rutile": "main/TiO2/nk/Devore-o.yml",
    "pmma": "organic/_C5H8O2_n_-_poly_methyl_methacrylate_/nk/Sultanova.yml",
}


@pytest.mark.parametrize("name", GLASSES)
def test_named_glasses_are_those_of_the_database(assets, name):
    page = assets / "spectral" / "refractiveindex.info" / GLASSES[name]
    if not page.exists():
        pytest.skip("no refractiveindex.info pages among the assets")
    visible = np.arange(440.0, 700.0, 3.0)
    eta, _ = spectra.read_refractive_index(page)
    np.testing.assert_allclose(spectra.glass(name).sample(visible), eta.sample(visible), rtol=1e-6)


def test_every_page_of_the_samples_is_read(assets):
    folder = assets / "spectral" / "refractiveindex.info"
    pages = sorted(folder.rglob("*.yml"))
    if not pages:
        pytest.skip("no refractiveindex.info pages among the assets")
    visible = np.arange(440.0, 700.0, 20.0)
    for page in pages:
        eta, k = spectra.read_refractive_index(page)
        assert (eta.sample(visible) > 0.0).all() and (k.sample(visible) >= 0.0).all(), page


@pytest.mark.parametrize("line", ["400;0,1", "400 0,1", "400,0\t0,1", "400,5; 1", "400 ; 0,1;2"])
@pytest.mark.parametrize(
    "read", [spectra.read_table, spectra.read_refractive_index, spectra.read_absorption]
)
def test_decimal_commas_are_refused(tmp_path, line, read):
    path = write(tmp_path, f"# in nm\n{line}\n")
    with pytest.raises(SceneError, match="decimal point") as caught:
        read(path)
    assert caught.value.file == path and caught.value.line == 2


@pytest.mark.parametrize("line", ["400, 0.5, 1", "400,0.5,1", "400 ,0.5 ,1", "400; 0.5; 1"])
def test_commas_between_numbers_are_separators(tmp_path, line):
    eta, k = spectra.read_refractive_index(write(tmp_path, line))
    assert (eta.sample(400.0), k.sample(400.0)) == (0.5, 1.0)


def test_pages_of_the_infrared_are_refused(tmp_path):
    """3 to 5 um, which no film sees."""
    rows = "    data: |\n      3.0 1.5\n      5.0 1.4"
    sellmeier = "    wavelength_range: 3 5\n    coefficients: 0 1 0.01"
    for read, text in (
        (spectra.read_absorption, page("tabulated k", rows)),
        (spectra.read_refractive_index, page("formula 1", sellmeier)),
    ):
        with pytest.raises(SceneError, match=r"3000 to 5000 nm.*give wavelengths in nm"):
            read(write(tmp_path, text, "page.yml"))
