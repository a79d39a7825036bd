"""Limits of parameters hold for tables and formulas as they do for numbers."""

from __future__ import annotations

import numpy as np
import pytest

from clpt import spectra
from clpt.errors import SceneError
from clpt.scene import KINDS, materials, roles
from clpt.scene.params import Kind, params
from clpt.scene.roles import Param
from clpt.spectra import Tabulated

LIMITED = [
    pytest.param(cls, name, param, id=f"{cls.kind}.{name}")
    for cls in (*(kind for group in KINDS.values() for kind in group), materials.Layer)
    for name, param in params(cls).items()
    if param.role in roles.SPECTRA and param.low == 0.0
]


def flat(value: float, low: float = 400.0, high: float = 700.0) -> Tabulated:
    return Tabulated((low, high), (value, value))


@pytest.mark.parametrize(("cls", "name", "param"), LIMITED)
def test_a_table_has_the_limits_of_a_number(cls: type[Kind], name: str, param: Param) -> None:
    beyond = [-0.5, *([1.5] if param.role is roles.REFLECTANCE else [])]
    for value in beyond:
        for given in (value, flat(value), spectra.Constant(value)):
            with pytest.raises(SceneError, match=rf"{cls.kind}\.{name}.* is outside"):
                cls(**{name: given})
    cls(**{name: flat(0.5)})
    dip = Tabulated((1200.0, 1250.0, 1300.0, 2000.0), (1.0, 1.0, -5.0, 1.0))
    with pytest.raises(SceneError, match="-5 at 1300 nm"):
        cls(**{name: dip})


@pytest.mark.parametrize(("cls", "name", "param"), LIMITED)
def test_wavelengths_in_another_unit_are_told(cls: type[Kind], name: str, param: Param) -> None:
    for unit in (1e-3, 1e-9, 10.0):
        with pytest.raises(SceneError, match=rf"{cls.kind}\.{name}.*give wavelengths in nm"):
            cls(**{name: flat(0.5, 400.0 * unit, 700.0 * unit)})


POSITIVE = [p for p in LIMITED if p.values[2].positive]  # type: ignore[attr-defined]


@pytest.mark.parametrize(("cls", "name", "param"), POSITIVE)
def test_an_index_is_above_0(cls: type[Kind], name: str, param: Param) -> None:
    with pytest.raises(SceneError, match=rf"{cls.kind}\.{name}: must be above 0"):
        cls(**{name: 0.0})


def test_what_an_index_means_holds_beyond_its_table() -> None:
    table = Tabulated((400.0, 700.0), (1.6, 1.5))
    np.testing.assert_array_equal(spectra.index(table).sample([300.0, 800.0]), [1.6, 1.5])


def test_absorption_reaches_as_far_as_films_do() -> None:
    """4 pi k / lambda at 1450 and 1950 nm, where water absorbs most of what films can see."""
    k = Tabulated((200.0, 2000.0), (0.0, 1e-3), "hold")
    lambdas = np.array([1250.0, 1450.0, 1950.0])
    found = spectra.absorption(k).sample(lambdas)
    np.testing.assert_allclose(found, 4e9 * np.pi * k.sample(lambdas) / lambdas, rtol=1e-6)
