"""What absorbs along a ray: the law, and which medium a ray is in, in lanes."""

from __future__ import annotations

import numpy as np
import pytest

from clpt import spectra
from clpt.render.materials.cases import medium_text
from clpt.render.materials.encoder import Encoder
from clpt.scene.roles import COEFFICIENT
from tests.kernels.scene_harness import SceneProbe

FAR = 1e30
DYE = spectra.Tabulated((360.0, 500.0, 560.0, 830.0), (0.4, 1.0, 60.0, 2.0))  # [1/m]
LAW = """
    Wavelengths lambdas = spectrum_of(x[2]);
    Spectrum s = medium_transmittance(scene, to_integer(x[0]), x[1], lambdas);
    r[0] = s.x;
"""


def transmittance(lanes: int, medium: np.ndarray, t: np.ndarray, lambdas: np.ndarray) -> np.ndarray:
    """medium_transmittance in spectral mode; the media: 1 the dye, 6 a constant 2.5, 11 none."""
    encoder = Encoder("spectral")
    words = [encoder.spectra.words(s, COEFFICIENT)[0] for s in (DYE, spectra.Constant(2.5))]
    words.append(encoder.spectra.words(spectra.Constant(0.0), COEFFICIENT)[0])
    encoder.store.append("materials", np.concatenate(words))
    probe = SceneProbe(
        LAW,
        3,
        1,
        files=("generated/medium.cl",),
        mode="spectral",
        lanes=lanes,
        virtual={
            "generated/medium.cl": medium_text({"absorption": frozenset({"constant", "table"})})
            + '#include "media/medium.cl"\n'
        },
        tables=encoder.store.arrays(),
        settings={"lambda_min": 360.0, "lambda_max": 830.0},
    )
    return probe(medium, t, lambdas)[0]


@pytest.mark.parametrize("lanes", [1, 8, 16])
def test_beer_and_lambert(lanes: int) -> None:
    """exp(-a t) to 1e-5 (1 + a t) in four media, from no way at all to the end of the world."""
    rng = np.random.default_rng(3)
    n = 400
    medium = rng.choice([0, 1, 6, 11], n)
    t = np.where(np.arange(n) % 7 == 0, 0.0, 10.0 ** rng.uniform(-3.0, 0.8, n))
    lambdas = rng.uniform(360.0, 830.0, n)
    a = np.select([medium == 1, medium == 6], [DYE.sample(lambdas), 2.5], 0.0)
    expected = np.exp(-a * t)
    got = transmittance(lanes, medium, t, lambdas)
    assert np.array_equal(got, transmittance(8, medium, t, lambdas)), "lanes differ"
    assert (np.abs(got - expected) <= 1e-5 * (1.0 + a * t) * expected + 1e-30).all()
    assert (got[(medium == 0) | (t == 0.0)] == 1.0).all()
    far = transmittance(lanes, medium, np.full(n, FAR), lambdas)
    np.testing.assert_allclose(far, (a == 0.0) * 1.0, atol=1e-30)


MEDIA = """
    integer m = to_integer(x[0]), own = to_integer(x[1]);
    mask front = x[2] > 0.0f, inward = x[3] > 0.0f;
    integer met = medium_met(m, own, front);
    r[0] = to_real(met);
    r[1] = to_real(medium_beyond(met, own, to_integer(x[4]), front, inward));
"""
# medium of the ray, inside the boundary, front met, goes inward, outside: medium met, beyond
CASES = [
    (0, 7, 1, 1, 0, 0, 7),  # refracted into a body
    (0, 7, 1, 0, 0, 0, 0),  # reflected by it
    (7, 7, 0, 1, 0, 7, 7),  # reflected inside
    (7, 7, 0, 0, 0, 7, 0),  # refracted out
    (0, 7, 0, 0, 0, 7, 0),  # the camera was inside
    (0, 7, 0, 1, 0, 7, 7),
    (3, 7, 1, 1, 0, 3, 7),  # into a body within another
    (3, 7, 1, 0, 0, 3, 3),  # reflected by it
    (3, 0, 1, 1, 0, 3, 3),  # what is no dielectric changes nothing
    (3, 0, 0, 0, 0, 3, 3),
    (0, 0, 0, 1, 0, 0, 0),
    (9, 7, 1, 1, 9, 9, 7),  # into a body that says what is around it
    (9, 7, 1, 0, 9, 9, 9),  # reflected by it
    (7, 7, 0, 0, 9, 7, 9),  # out again
    (9, 0, 1, 1, 9, 9, 0),  # into a bubble
    (0, 0, 0, 0, 9, 0, 9),  # out of it
]


@pytest.mark.parametrize("lanes", [1, 8, 16])
def test_which_medium(lanes: int) -> None:
    text = (
        "#define medium_absorption(s, at, uv, l) spectrum_of(0.0f)\n"
        + '#include "media/medium.cl"\n'
    )
    probe = SceneProbe(
        MEDIA,
        5,
        2,
        files=("generated/medium.cl",),
        lanes=lanes,
        virtual={"generated/medium.cl": text},
    )
    *given, met, beyond = np.transpose(CASES)
    assert np.array_equal(probe(*given), [met, beyond])
