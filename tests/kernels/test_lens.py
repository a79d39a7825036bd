"""A camera's lens on the device, beside rays in float64 that go the other way."""

from __future__ import annotations

import numpy as np
import pytest

from clpt import lenses, spectra
from clpt.errors import SceneError
from clpt.lenses import Prescription, Surface
from clpt.lenses.prescription import quarter_wave
from clpt.lenses.tracing import Rays, trace
from clpt.render.camera import encode_camera, ghost_pairs
from clpt.render.flow import stages
from clpt.render.records import CameraFeatures
from clpt.scene.cameras import Lens
from clpt.spectra import Constant
from tests.kernels.scene_harness import SceneProbe

BODY = """
    vec2 film = {x[0], x[1]}, lens = {x[2], x[3]};
    Spectrum weight, lambdas = spectrum_of(x[4]);
    global const LensCamera *at_camera = (global const LensCamera *)scene.camera;
    CameraRay ray = lens_ray(scene, at_camera, film, lens, lambdas, &weight);
    r[0] = ray.o.x; r[1] = ray.o.y; r[2] = ray.o.z;
    r[3] = ray.d.x; r[4] = ray.d.y; r[5] = ray.d.z; r[6] = weight.x;
"""
WIDTH, HEIGHT = 90, 60
GRID = np.linspace(360.0, 830.0, 471)


def probe(camera: Lens, lanes: int = 8, ghosts: bool = False) -> SceneProbe:
    """The lens as a function of film x and y, two random numbers and a wavelength [nm]."""
    rows = camera.dispersive_glasses
    words = encode_camera(camera, WIDTH, HEIGHT, range(len(rows)))
    table = np.concatenate([np.zeros(1), *(glass.sample(GRID) for glass in rows)])[bool(rows) :]
    features = CameraFeatures("lens", disperses=bool(rows), losses=camera.reflects)
    return SceneProbe(
        BODY,
        5,
        7,
        mode="spectral",
        lanes=lanes,
        files=("cameras/camera.cl", "generated/camera.cl"),
        virtual={"generated/camera.cl": stages.camera_text(features)},
        defines={
            "CAMERA_DISPERSES": int(bool(rows)),
            "LENS_LOSSES": int(camera.reflects),
            "LENS_GHOSTS": int(camera.ghosts > 0.0),
        },
        tables={"camera": words, "spectra": table},
        settings={"lambda_min": 360.0},
    )


def samples(n: int, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).random((4, n), np.float32)


ASPHERE = Prescription(
    (
        Surface(40.0, 5.0, spectra.glass("n-bk7"), 9.0, conic=-0.6, aspheric=(-2e-6, 3e-9, 1e-12)),
        Surface(-90.0, 2.0, semi_diameter=9.0, conic=1.5),
        Surface(0.0, 4.0, semi_diameter=6.0, stop=True),
        Surface(-70.0, 2.0, spectra.glass("sf11"), 7.0),
        Surface(0.0, 0.0, semi_diameter=7.0, aspheric=(4e-6,)),
    )
)


@pytest.mark.parametrize("lens", ["double_gauss", ASPHERE], ids=["spheres", "aspheres"])
def test_rays_lead_back_to_the_film(lens):
    """A ray of the device, traced to the film in float64, ends where it began."""
    camera = Lens(lens=lens, focus_distance=1.3, film_shift=2e-4)
    made = camera.prescription
    given = film_x, film_y, *_ = samples(4096)
    waves = np.random.default_rng(5).choice([400.0, 550.0, 700.0], 4096)
    out = probe(camera)(*given, waves)
    o, d, alive = out[:3].T * 1e3, out[3:6].T, out[6] > 0.0
    assert 0.5 < alive.mean() < 0.99
    # Camera space looks along +z from the film, which stands behind the last surface.
    back = lenses.tracing.film_distance(made, 1300.0) + 0.2
    o = np.stack([o[:, 0], o[:, 1], made.length + back - o[:, 2]], axis=1)
    d = np.stack([-d[:, 0], -d[:, 1], d[:, 2]], axis=1)
    for wavelength in np.unique(waves):
        lit = alive & (waves == wavelength)
        rays = trace(made, Rays.of(o[lit] - 5.0 * d[lit], d[lit]), wavelength, open_=True)
        assert rays.alive.all()
        at = (made.length + back - rays.o[:, 2]) / rays.d[:, 2]
        place = rays.o + at[:, None] * rays.d
        expected = np.stack([(film_x[lit] - 0.5) * 36.0, (film_y[lit] - 0.5) * 24.0], axis=1)
        np.testing.assert_allclose(place[:, :2], expected, atol=2e-4)  # [mm], of 36


def test_irradiance_beside_float64():
    """The mean weight at a place is its irradiance under a sky of radiance 1, vignetting and all.

    5 standard errors of 32,768 samples (two-sided significance 6e-7).
    """
    camera = Lens(exposure="irradiance", f_number=2.8)
    made = camera.prescription.with_stop(lenses.tracing.stop_radius(camera.prescription, 2.8))
    trace_ = probe(camera)
    back = lenses.tracing.film_distance(made, 1e7)
    size, cells = made.surfaces[-1].semi_diameter, 200
    x, y = (each.ravel() for each in np.meshgrid(*[(np.arange(cells) + 0.5) / cells * 2 - 1] * 2))
    for place in (0.0, 10.0, 17.5):
        n = 32768
        _, _, u, v = samples(n, 3)
        film = np.full(n, 0.5 + place / 36.0)
        weight = trace_(film, np.full(n, 0.5), u, v, np.full(n, 550.0))[6]
        d = np.stack([x * size - place, y * size, np.full(len(x), -back)], axis=1)
        rays = Rays.of(np.array([[place, 0.0, made.length + back]]), d)
        cos4 = rays.d[:, 2] ** 4
        alive = trace(made, rays, 550.0, backwards=True).alive
        expected = float((cos4 * alive).sum()) / back**2 * (2.0 * size / cells) ** 2
        error = 5.0 * float(weight.std()) / np.sqrt(n) + 2e-3 * expected
        assert abs(float(weight.mean()) - expected) < error


def test_all_lane_widths_agree():
    camera = Lens(blades=6, ghosts=0.3, coating="multi")
    given = (*samples(256), np.full(256, 540.0))
    single = probe(camera, 1)(*given)
    for lanes in (8, 16):
        np.testing.assert_allclose(probe(camera, lanes)(*given), single, rtol=2e-3, atol=2e-6)


def plate(n: float, **more) -> Prescription:
    """A hole in front of a plate."""
    return Prescription(
        (
            Surface(0.0, 1.0, semi_diameter=0.05, stop=True),
            Surface(0.0, 2.0, Constant(n), 40.0, **more),
            Surface(0.0, 40.0, semi_diameter=40.0, **more),
        )
    )


def straight_on(camera: Lens, wavelength: float = 550.0) -> float:
    """The mean weight in the film's middle, over a grid of the unit square or, where pairs of
    surfaces are drawn, over 2^18 random points of it."""
    u, v = (each.ravel() for each in np.meshgrid(*[(np.arange(256) + 0.5) / 256.0] * 2))
    if camera.ghosts:
        u, v = samples(1 << 18, 7)[2:]
    n = len(u)
    middle = np.full(n, 0.5)
    return float(probe(camera)(middle, middle, u, v, np.full(n, wavelength))[6].mean())


def test_energy_through_surfaces():
    """A plate lets (1 - R)^2 pass; ghosts of one pair of surfaces add (1 - R)^2 R^2."""
    n = 4.0
    r = ((n - 1.0) / (n + 1.0)) ** 2
    assert straight_on(Lens(lens=plate(n))) == pytest.approx(1.0, rel=2e-3)
    assert straight_on(Lens(lens=plate(n), losses=True)) == pytest.approx((1 - r) ** 2, rel=2e-3)
    film = (quarter_wave(1.9),)
    coated = plate(n).with_coating(film)
    left = ((n - 1.9**2) / (n + 1.9**2)) ** 2
    at = straight_on(Lens(lens=coated, losses=True))
    assert at == pytest.approx((1.0 - left) ** 2, rel=2e-3)


def test_energy_of_ghosts():
    """The hole stands on the film's side, so that all light reaches it whichever way it went."""
    n = 4.0
    r = ((n - 1.0) / (n + 1.0)) ** 2
    made = Prescription(
        (
            Surface(0.0, 2.0, Constant(n), 40.0),
            Surface(0.0, 1.0, semi_diameter=40.0),
            Surface(0.0, 40.0, semi_diameter=1.0, stop=True),
        )
    )
    found = straight_on(Lens(lens=made, ghosts=0.5))
    assert found == pytest.approx((1 - r) ** 2 * (1 + r * r), rel=3e-3)
    pairs, shares = ghost_pairs(made)
    assert pairs.tolist() == [[1, 2]] and shares.sum() == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"focus_distance": 0.1}, r"lens\.focus_distance: this lens cannot focus nearer"),
        ({"f_number": 1.0}, r"lens\.f_number: this lens opens to f/2\.03 at most"),
        ({"film_shift": -0.05}, r"lens\.film_shift: the film would stand"),
        ({"lens": "double_gaus"}, "did you mean 'double_gauss'"),
        ({"lens": 3}, "must be a name or a prescription"),
        ({"blades": 2}, r"lens\.blades: must be 0 or 3 to 24"),
    ],
)
def test_unusable_lenses(given, message):
    with pytest.raises(SceneError, match=message):
        encode_camera(Lens(**given), 4, 4)
