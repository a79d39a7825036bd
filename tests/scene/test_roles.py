"""Every role has its entry in every table, and takes what it is meant to take."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import clpt
from clpt import SceneError
from clpt.formats.native import forms
from clpt.render.materials import cases as parameters
from clpt.render.materials import encoder
from clpt.render.records.materials import MEMBERS
from clpt.scene import materials, roles, textures
from clpt.testing import settings

TABLES = {
    "members": MEMBERS,
    "encodings": encoder.ENCODINGS,
    "forms": {role: forms.FORMS.get(role.name) for role in roles.DEVICE},
    # layers are drawn with their material; a table over angles has a kind of its own to check it
    "draws": {**settings.DRAWS, roles.LAYERS: None, roles.ANGULAR: None},
}


@pytest.mark.parametrize("name", TABLES)
def test_a_table_has_every_role(name: str) -> None:
    assert set(TABLES[name]) == set(roles.DEVICE)
    assert set(parameters.LOADS) < set(roles.DEVICE)


def test_names_are_told_apart() -> None:
    """A form of a host parameter is a role too, by the same name in files."""
    assert len(roles.NAMED) == len(roles.DEVICE)
    assert roles.host("vector") == roles.host("vector") != roles.host("direction")
    assert all(role.place != "host" for role in roles.DEVICE)


@pytest.mark.parametrize("role", [r for r in roles.DEVICE if r is not roles.ANGULAR])
def test_no_role_takes_a_thing_of_no_kind(role: roles.Role) -> None:
    with pytest.raises(SceneError, match=r"must be|is none of"):
        role.check(object(), roles.Param(role, choices=("a",)), "thing.value")


def test_a_texture_is_refused_where_it_cannot_be() -> None:
    """A flag, a choice and a table are no textures, as a number is none where it must be one."""
    image = textures.Bitmap(image=np.ones((1, 1, 3)))
    for given in (
        lambda: materials.Dielectric(int_ior=image),
        lambda: materials.RoughConductor(distribution=image),
        lambda: materials.Measured(data=image),
    ):
        with pytest.raises(SceneError, match="cannot be a texture"):
            given()


def test_a_colour_is_no_curve_of_a_sensor(tmp_path: Path) -> None:
    file = tmp_path / "scene.json"
    curves = '[[0.1, 0.2, 0.3], 1.0, {"type": "constant", "value": 2.0}]'
    text = '{"camera": {"type": "perspective"}, "film": {"sensor": {"curves": CURVES}}}'
    file.write_text(text.replace("CURVES", curves))
    with pytest.raises(SceneError, match=r"curves\[0\].*must be a number") as caught:
        clpt.load(file)
    assert caught.value.file == file
