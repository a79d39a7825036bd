"""What thin films bring into tables and kernels, and what they leave alone."""

from __future__ import annotations

import numpy as np
import pytest

from clpt.errors import SceneError
from clpt.render.flow import programs
from clpt.render.flow.scene_to_tables import lower
from clpt.render.materials.thin_films import film_colours
from clpt.render.records.materials import FILM_COSINES
from clpt.scene import Film, Scene, cameras, shapes, textures
from clpt.scene import materials as m
from clpt.spectra import cie
from clpt.spectra.spectrum import d65

RAMP = textures.Bitmap(image=np.linspace(0.0, 1.0, 16, dtype=np.float32).reshape(1, 16))


def lowered(mode, *materials):
    balls = [shapes.Sphere(material=material) for material in materials]
    return lower(Scene(camera=cameras.Perspective(), shapes=balls, film=Film(mode=mode)))


def built(made):
    return programs.sources(made.features, "brute", 8, queued=False)


@pytest.mark.parametrize("mode", ["spectral", "rgb"])
def test_only_kinds_with_layers_are_built_with_them(mode):
    coated = m.Conductor(layers=(m.Layer(),))
    made = built(lowered(mode, coated, m.Dielectric(), m.Diffuse()))
    bare = built(lowered(mode, m.Conductor(), m.Dielectric(), m.Diffuse()))
    own = "thin_film(" if mode == "spectral" else "film_look_up("
    assert [name for name, source in made.items() if own in source.text] == ["shade_conductor"]
    assert "dielectric_boundary(" in made["shade_dielectric"].text
    for name in made.keys() - {"shade_conductor"}:
        assert made[name].text == bare[name].text


def test_layers_lie_in_a_row():
    layers = (m.Layer(eta=1.5, thickness=100.0), m.Layer(eta=1.7, k=0.5, thickness=200.0))
    made = lowered("spectral", m.Conductor(layers=layers), m.Conductor(layers=layers[::-1]))
    words = made.tables["materials"]
    thick = [np.flatnonzero(words.view(np.float32) == np.float32(t)) for t in (100.0, 200.0)]
    assert [len(t) for t in thick] == [2, 2]
    assert thick[1][0] - thick[0][0] == 14 == thick[0][1] - thick[1][1]


def test_textures_of_layers_need_uvs():
    assert lowered("spectral", m.Dielectric(layers=(m.Layer(profile=RAMP),))).features.geometry.uvs
    assert not lowered("spectral", m.Dielectric(layers=(m.Layer(),))).features.geometry.uvs


def test_rgb_mode_varies_by_one_texture():
    other = textures.Checkerboard()
    varied = [m.Layer(profile=RAMP), m.Layer(eta=1.6, profile=RAMP), m.Layer(profile=0.5)]
    lowered("rgb", m.Conductor(layers=varied))
    with pytest.raises(SceneError, match=r"one texture .* layers of conductor in RGB mode"):
        lowered("rgb", m.Conductor(layers=[*varied, m.Layer(profile=other)]))
    lowered("spectral", m.Conductor(layers=[*varied, m.Layer(profile=other)]))


def test_colours_of_a_film_at_normal_incidence():
    """A quarter-wave film by its closed form (Born and Wolf 1999, 1.6.4), summed in float64."""
    n, d = 1.38, 99.6
    r1, r2 = (1.0 - n) / (1.0 + n), (n - 1.5) / (n + 1.5)
    phase = 4.0 * np.pi * n * d / cie.GRID
    r = np.abs((r1 + r2 * np.exp(1j * phase)) / (1.0 + r1 * r2 * np.exp(1j * phase))) ** 2
    white = cie.spectrum_to_xyz(d65().sample(cie.GRID))
    expected = cie.xyz_to_rgb(cie.spectrum_to_xyz(r * d65().sample(cie.GRID)) / white[1])
    layers = (m.Layer(eta=n, thickness=d),)
    table = film_colours(m.Dielectric(int_ior=1.5, ext_ior=1.0, layers=layers))
    assert table.shape == (3, 1, FILM_COSINES, 6)
    np.testing.assert_allclose(table[0, 0, -1, :3], expected, atol=1e-4)
    np.testing.assert_allclose(table[0, 0, -1, 3:], 1.0 - expected, atol=1e-4)
    np.testing.assert_allclose(table[1, 0, :, 3:], table[0, 0, :, 3:], atol=1e-5)  # reciprocity
    np.testing.assert_allclose(table[2, 0, :, :3], 1.0, atol=1e-5)  # total reflection
