"""Arguments that stand for others: metals by name, roughness, sizes, where a camera looks."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clpt
from clpt import spectra, transforms
from clpt.errors import SceneError, UnknownKindError, UnusedParameterError
from clpt.scene import KINDS, Film, cameras, materials
from clpt.scene.params import params, shorthands


def test_a_metal_by_its_name() -> None:
    eta, k = spectra.metal("Au")
    for name in ("gold", "Gold", "Au"):
        made = materials.RoughConductor(metal=name)
        assert (made.eta, made.k) == (eta, k)
    assert spectra.metal("aluminum") == spectra.metal("aluminium") == spectra.metal("Al")
    assert materials.Conductor(metal=(eta, 1.0)).k == spectra.Constant(1.0)  # type: ignore[arg-type]
    with pytest.raises(UnknownKindError, match=r"^conductor\.metal: .*did you mean 'gold'\?"):
        materials.Conductor(metal="golld")


def test_roughness_and_anisotropy_have_the_words_of_both_dialects() -> None:
    made = materials.RoughConductor(alpha=0.2)
    assert (made.alpha_u, made.alpha_v) == (0.2, 0.2)
    made = materials.RoughDielectric(roughness=0.5)
    assert (made.alpha_u, made.alpha_v) == (0.25, 0.25)
    assert materials.RoughPlastic(roughness=0.0).alpha == materials.LEAST_ALPHA
    assert materials.Principled(anisotropy=0.3, transmission=0.4).anisotropic == 0.3
    assert materials.PrincipledThin(transmission=0.4).spec_trans == 0.4


def test_the_size_of_a_film() -> None:
    made = Film(size=(8, 4))
    assert (made.width, made.height, made.size) == (8, 4, (8, 4))


def test_where_a_camera_looks() -> None:
    at = (1.0, 2.0, 5.0)
    made = cameras.ThinLens(origin=at, target=(0.0, 0.0, 0.0))
    expected = transforms.look_at(at, (0.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    np.testing.assert_array_equal(made.to_world, expected)
    up = cameras.Perspective(origin=at, target=(0.0, 0.0, 0.0), up=(0.0, 0.0, 1.0))
    assert up.to_world[2, 1] > 0.4


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: materials.Conductor(metal="gold", k=1.0),
            r"^conductor\.metal: 'metal' stands for 'k' too; give either$",
        ),
        (lambda: materials.RoughPlastic(roughness=2.0), r"^rough_plastic\.roughness: 2\.0 is out"),
        (lambda: Film(size=3), r"^film\.size: must be \(width, height\), not 3$"),
        (
            lambda: Film(size=(0, 4)),
            r"^film\.width: must be a whole number from 1 to 65536, not 0$",
        ),
        (lambda: cameras.Perspective(origin=(0, 0, 1)), r"^perspective\.target: give origin and"),
        (
            lambda: cameras.Perspective(origin=(0, 0, 1), target=(0, 0, 1)),
            r"^perspective\.\w+: .*",
        ),
    ],
)
def test_what_a_shorthand_refuses(make: Callable[[], Any], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        make()


def test_a_matrix_camera_has_no_target() -> None:
    with pytest.raises(UnusedParameterError, match="matrix has no parameter 'target'"):
        cameras.Matrix(target=(0, 0, 0))


@pytest.mark.parametrize("cls", [cls for table in KINDS.values() for cls in table])
def test_shorthands_stand_for_parameters(cls: Any) -> None:
    assert not shorthands(cls).keys() & params(cls).keys()
    for shorthand in cls.shorthands:
        assert set(shorthand.stands_for) <= params(cls).keys()
        assert all(param.doc for param in shorthand.arguments.values())


def test_scene_files_have_them_too(tmp_path: Path) -> None:
    text = """{
      "camera": {"type": "perspective", "origin": [0, 1, 5], "target": [0, 0, 0]},
      "film": {"size": [8, 4]},
      "shapes": [{"type": "sphere", "material":
        {"type": "rough_conductor", "metal": "silver", "roughness": 0.4}}]
    }"""
    (tmp_path / "scene.json").write_text(text)
    made = clpt.load(tmp_path)
    material = made.shapes[0].material
    assert isinstance(material, materials.RoughConductor)
    assert material.eta == spectra.metal("Ag")[0] and material.alpha_v == pytest.approx(0.16)
    assert made.film.size == (8, 4)
    clpt.save(made, tmp_path / "again.json")  # writes what they stand for
    again = clpt.load(tmp_path / "again.json")
    np.testing.assert_allclose(again.camera.to_world, made.camera.to_world)
    (tmp_path / "scene.json").write_text(text.replace("0.4", '0.4, "alpha_u": 0.1'))
    with pytest.raises(SceneError, match=r"scene\.json:5: .*roughness: 'roughness' stands for"):
        clpt.load(tmp_path)
