"""Phase functions as data: tables are scaled, made even, and refused where they are none."""

from __future__ import annotations

import numpy as np
import pytest

import clpt
from clpt import spectra
from clpt.errors import SceneError
from clpt.formats.native.write import write_medium
from clpt.scene import media, phases

BAD = {
    "needs two": ({"values": (1.0,)}, "two numbers or more"),
    "ragged": ({"values": ((1, 2), (1, 2, 3)), "wavelengths": (400, 500)}, "rows of one length"),
    "negative": ({"values": (1.0, -1.0)}, "-1 is negative"),
    "not finite": ({"values": (1.0, np.nan)}, "must be finite"),
    "empty": ({"values": ((1, 1), (0, 0)), "wavelengths": (400, 500)}, "row 1 holds nothing"),
    "count": ({"values": (1, 2, 3), "cosines": (-1, 1)}, "cosines: 2 for 3 values"),
    "ends": ({"values": (1, 2, 3), "cosines": (-1, 0, 0.5)}, "ascend from -1 to 1"),
    "order": ({"values": (1, 2, 3), "cosines": (-1, 1, 1)}, "ascend from -1 to 1"),
    "rows": ({"values": ((1, 2), (1, 2)), "wavelengths": (400,)}, "1 for 2 rows"),
    "falling": ({"values": ((1, 2), (1, 2)), "wavelengths": (500, 400)}, "must ascend"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_table_that_is_none(case: str) -> None:
    given, said = BAD[case]
    with pytest.raises(SceneError, match=said):
        phases.Tabulated(**given)


@pytest.mark.parametrize(
    "make, said",
    [
        (lambda: phases.HenyeyGreenstein(g=1.0), "outside"),
        (lambda: phases.HenyeyGreenstein(g=(0.3, -0.2, 0.1)), "cannot be negative"),
        (lambda: phases.HenyeyGreenstein(g=spectra.Tabulated((400, 500), (0, 1.5))), "at 500 nm"),
        (lambda: phases.Draine(alpha=-1.0), "outside"),
        (lambda: phases.Blend(weight=1.5), "outside"),
        (lambda: phases.Blend(first=1.0), "must be a phase function"),
    ],
)
def test_says_what_is_wrong(make, said) -> None:
    with pytest.raises(SceneError, match=said):
        make()


def test_rows_lie_even_in_wavelength_and_have_the_integral_one() -> None:
    rows = np.random.default_rng(1).random((4, 9))
    table = phases.Tabulated(values=rows, wavelengths=(400.0, 410.0, 450.0, 500.0))
    cosines, made, start, step = table.device_rows(True)
    assert (start, step, made.shape) == (400.0, 10.0, (11, 9))
    np.testing.assert_allclose(2 * np.pi * np.trapezoid(made, cosines, axis=1), 1.0)
    np.testing.assert_allclose(made[[0, 1, 5, 10]], table.values, rtol=1e-12)
    assert table.device_rows(False)[1].shape == (3, 9)
    assert phases.Tabulated(values=rows[0]).device_rows(False)[1].shape == (1, 9)


def test_files_hold_them(tmp_path) -> None:
    table = phases.Tabulated(values=[(1.0, 2.0, 4.0), (2.0, 1.0, 1.0)], wavelengths=(400.0, 700.0))
    blend = phases.Blend(weight=0.25, first=table, second=phases.Draine(g=0.5, alpha=2.0))
    text = write_medium(media.Homogeneous(sigma_s=1.0, phase=blend, name="x"), 7)
    (tmp_path / "scene.json").write_text(
        '{"camera": {"type": "perspective"}, "shapes": [{"type": "sphere", "interior": "x",'
        f' "material": {{"type": "null"}}}}], "media": {{"x": {text}}}}}'
    )
    clpt.save(clpt.load(tmp_path / "scene.json"), tmp_path / "again.json")
    found = clpt.load(tmp_path / "again.json").shapes[0].interior.phase
    assert found.weight == 0.25 and found.second.alpha.value == 2.0
    np.testing.assert_allclose(found.first.values, table.values, rtol=1e-6)
    np.testing.assert_array_equal(found.first.wavelengths, table.wavelengths)
