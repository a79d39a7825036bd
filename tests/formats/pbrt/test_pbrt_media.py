"""Media of PBRT that give out light, and those on grids."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clpt.errors import SceneError
from clpt.formats import pbrt
from clpt.scene import media

SCENE = """
Camera "perspective"
WorldBegin
MakeNamedMedium "m" {medium}
MediumInterface "m" ""
Material "interface"
Shape "sphere"
"""


def read(tmp_path: Path, medium: str) -> tuple[media.Medium, list[str]]:
    """The medium of a scene, and the warnings."""
    path = tmp_path / "scene.pbrt"
    path.write_text(SCENE.format(medium=medium))
    scene = pbrt.load(path)
    found = scene.shapes[0].interior
    assert found is not None
    return found, list(scene.warnings)


def test_homogeneous(tmp_path: Path) -> None:
    """The light is scaled as that of lamps; a spectrum has luminance 1."""
    found, warnings = read(
        tmp_path, '"string type" "homogeneous" "rgb Le" [1 2 3] "float Lescale" 2'
    )
    assert not warnings
    np.testing.assert_allclose(found.emission.to_rgb("emission"), (2.0, 4.0, 6.0))


def test_uniform_grid(tmp_path: Path) -> None:
    given = '"string type" "uniformgrid" "integer nx" 2 "float density" [1 2] '
    found, _ = read(tmp_path, given + '"rgb Le" [1 1 1] "float Lescale" [3 4]')
    assert found.emission_grid[1:3, 1, 1].tolist() == [3.0, 4.0]
    assert found.density.shape == (4, 3, 3)
    found, _ = read(
        tmp_path,
        given + '"float temperature" [10 20] "float temperatureoffset" 10'
        ' "float temperaturescale" 100',
    )
    assert found.normalised
    assert found.temperature[1:3, 1, 1].tolist() == [0.0, 1000.0]
    with pytest.raises(SceneError, match="both 'Le' and"):
        read(tmp_path, given + '"float temperature" [1 2] "rgb Le" [1 1 1]')
    with pytest.raises(SceneError, match="'Lescale' has 3 numbers"):
        read(tmp_path, given + '"rgb Le" [1 1 1] "float Lescale" [1 2 3]')


def test_rgb_grid(tmp_path: Path) -> None:
    """Grey extinction and an albedo of colours; colours that differ are told."""
    given = '"string type" "rgbgrid" "integer nx" 2 "rgb sigma_s" [1 2 3 4 5 6] "rgb sigma_a" '
    found, warnings = read(tmp_path, given + "[3 2 1 4 3 2]")
    assert not warnings
    np.testing.assert_allclose(found.density[1:3, 1, 1], (0.5, 1.0))
    np.testing.assert_allclose(found.albedo_grid[1, 1, 1], (0.25, 0.5, 0.75))
    np.testing.assert_allclose(found.sigma_t.to_rgb("unbounded"), 8.0)
    found, warnings = read(tmp_path, given + "[3 2 1 4 3 9]")
    assert not warnings
    extinction = found.density[..., None] * found.color_grid * found.sigma_t.to_rgb("unbounded")
    np.testing.assert_allclose(extinction[1:3, 1, 1], [[4, 4, 4], [8, 8, 15]], rtol=1e-6)
    scattered = (extinction * found.albedo_grid)[1:3, 1, 1]
    np.testing.assert_allclose(scattered, [[1, 2, 3], [4, 5, 6]], rtol=1e-6)


def test_cloud(tmp_path: Path) -> None:
    """Its numbers are those of PBRT; what it does not say has PBRT's defaults."""
    given = '"string type" "cloud" "float density" 2 "float wispiness" 0.5 "float frequency" 4 '
    given += '"point3 p0" [-1 0 0] "point3 p1" [1 2 3] "float g" 0.5'
    found, warnings = read(tmp_path, given)
    assert not warnings
    assert isinstance(found, media.Cloud)
    assert (found.density, found.wispiness, found.frequency) == (2.0, 0.5, 4.0)
    np.testing.assert_allclose(found.box @ (0.5, 0.5, 0.5, 1.0), (0.0, 1.0, 1.5, 1.0))
    np.testing.assert_allclose(found.coefficients(spectral=False)[0].to_rgb("unbounded"), 1.0)
    found, _ = read(tmp_path, '"string type" "cloud"')
    assert (found.density, found.wispiness, found.frequency) == (1.0, 1.0, 5.0)
