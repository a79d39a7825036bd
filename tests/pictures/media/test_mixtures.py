"""Mixtures of media: exact transmittance, furnaces, what one medium of the same matter does, files.

Significance as in tests/pictures/support.py. All quick tests in RGB mode share their kernels.
"""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clpt
from clpt.errors import SceneError
from clpt.render.materials.encoder import Encoder
from clpt.render.media import grids
from clpt.scene import integrators, media, phases
from clpt.scene.cameras import Perspective
from clpt.scene.lights import Constant, Spot
from clpt.spectra import Tabulated
from clpt.spectra.spectrum import gridded
from tests.pictures.media.test_grids import (
    CHROMATIC,
    RANDOM,
    TURNED,
    WITHIN,
    optical_depth,
    scene_of,
)
from tests.pictures.support import (
    assert_agree,
    assert_mean,
    exposures,
    pictures_of_parts,
    with_film,
)

STEEP = np.broadcast_to(np.linspace(0.0, 3.0, 7)[None, :, None], (1, 7, 1))
FORWARD = phases.HenyeyGreenstein(g=0.7)
ENDS = np.array([0.07, 0.11, 5.0]), np.array([0.23, -0.07, -5.0])


def grid(density: Any, **given: Any) -> media.Grid:
    return media.Grid(density=density, to_world=TURNED, **given)


SMOKE = grid(2.0 * RANDOM, sigma_t=(0.2, 0.9, 1.7), albedo=0.5, phase=FORWARD)
DARK = grid(STEEP, sigma_a=(0.3, 0.02, 0.1))
MIST = media.Homogeneous(sigma_s=(0.1, 0.2, 0.05))


def test_transmittance() -> None:
    """What comes through unscattered is exp(-optical depth of all parts), for each colour."""
    box = grid(np.ones((1, 1, 1)))
    depths = [
        optical_depth(part if isinstance(part, media.Grid) else box, *ENDS)
        * sum(one.to_rgb("unbounded") for one in part.coefficients(False))
        for part in (SMOKE, DARK, MIST)
    ]
    mixture = media.Mixture(parts=(SMOKE, DARK, MIST))
    assert mixture.size == RANDOM.shape
    got = exposures(scene_of(mixture, max_depth=1), 16, 64)
    assert_mean(got, np.exp(-sum(depths)), 0.08)


@pytest.mark.parametrize("mode", ["rgb", pytest.param("spectral", marks=pytest.mark.slow)])
def test_furnace(mode: str) -> None:
    """Parts that scatter all light, each in its own way and of its own colour, cannot be seen."""
    white = (
        grid(2.0 * RANDOM, sigma_s=(0.2, 0.9, 1.7), phase=FORWARD),
        grid(STEEP, sigma_s=(0.5, 0.1, 0.02)),
        media.Homogeneous(sigma_s=(0.6, 0.2, 0.05)),
    )
    scene = with_film(scene_of(media.Mixture(parts=white)), mode=mode)
    scene.lights = [Constant(radiance=1.0), scene.lights[1]]
    assert_mean(exposures(scene, 8, 192), 1.0, WITHIN)


@pytest.mark.slow
def test_parts_of_one_matter() -> None:
    """A medium in parts is the medium, and its picture has the same bits however it is split."""
    given = {"albedo": 0.8, "phase": FORWARD}
    whole = grid(2.0 * RANDOM, sigma_t=CHROMATIC, **given)
    parts = [grid(share * 2.0 * RANDOM, sigma_t=CHROMATIC, **given) for share in (0.2, 0.5, 0.3)]
    mixture = scene_of(media.Mixture(parts=tuple(parts)))
    pictures = [
        exposures(one, 16, 64).mean(axis=(1, 2), keepdims=True)
        for one in (mixture, scene_of(whole))
    ]
    assert_agree(*pictures, "the parts and the whole", 2e-4)
    assert np.array_equal(*pictures_of_parts(mixture))


@pytest.mark.slow
def test_colours_of_transmittance() -> None:
    """The same for wavelengths, which differ in where what takes them is."""
    lambdas = np.linspace(400.0, 700.0, 13)
    blue, red = (0.2 + np.linspace(0.0, 2.0, 13) ** 2 * way for way in (1.0, 0.3))
    parts = (
        grid(2.0 * RANDOM, sigma_t=Tabulated(lambdas, blue[::-1], "hold"), albedo=0.7),
        grid(STEEP, sigma_a=Tabulated(lambdas, red, "hold")),
    )
    at = np.linspace(400.0, 700.0, 48, endpoint=False) + 3.125
    depths = [optical_depth(one, *ENDS) * one.coefficients(True)[0].sample(at) for one in parts]
    depths[0] /= 0.3
    film = {"mode": "spectral", "bands": 3, "lambda_min": 400.0, "lambda_max": 700.0}
    scene = with_film(scene_of(media.Mixture(parts=parts), max_depth=1), **film)
    scene.lights[0] = Constant(radiance=clpt.spectra.Constant(1.0))
    assert_mean(exposures(scene, 16, 256), np.exp(-sum(depths)).reshape(3, 16).mean(axis=1), 0.08)


@pytest.mark.slow
def test_beside_other_grids() -> None:
    """The same where other media of the scene have colours and light on their grids."""
    colours = np.full((*RANDOM.shape, 3), 0.5)
    other = grid(
        RANDOM, sigma_t=2.0, albedo_grid=colours, color_grid=colours,
        temperature=np.full(RANDOM.shape, 1500.0), brightness=1e-6,
    )  # fmt: skip
    mixture = media.Mixture(parts=(SMOKE, DARK, MIST))
    scenes = [scene_of(mixture, max_depth=1) for _ in range(2)]
    far = dataclasses.replace(scenes[1].shapes[0], to_world=clpt.transforms.translate([0, 0, 60]))
    scenes[1].shapes.append(dataclasses.replace(far, interior=other))
    pictures = [exposures(one, 16, 64).mean(axis=(1, 2), keepdims=True) for one in scenes]
    assert_agree(*pictures, "alone, and beside other grids", 2e-4)
    scenes[1].shapes[0] = dataclasses.replace(scenes[1].shapes[0], interior=other)
    scenes[1].shapes[2] = dataclasses.replace(far, interior=mixture)
    plain = dataclasses.replace(scenes[1], shapes=scenes[1].shapes[:2])
    pictures = [
        exposures(one, 16, 64).mean(axis=(1, 2), keepdims=True) for one in (scenes[1], plain)
    ]
    assert_agree(*pictures, "the other grid, beside a mixture and alone", 2e-4)


@pytest.mark.slow
def test_light_paths() -> None:
    """Paths from both ends find the light of a lamp that the camera's paths find."""
    scene = scene_of(media.Mixture(parts=(SMOKE, MIST)), light=0.0)
    lamp = Spot(to_world=clpt.transforms.look_at([4, 4, 4], [0, 0, 0], [0, 1, 0]), intensity=60.0)
    scene.lights = [lamp]
    scene.camera = dataclasses.replace(
        scene.camera, to_world=clpt.transforms.look_at([0.07, 0.11, 5], [0.15, 0.02, 0], [0, 1, 0])
    )
    both = [
        dataclasses.replace(
            scene, integrator=dataclasses.replace(scene.integrator, light_paths=count)
        )
        for count in (0, 1)
    ]
    pictures = [exposures(one, 16, 128).mean(axis=(1, 2), keepdims=True) for one in both]
    assert pictures[0].mean() > 0.01
    assert_agree(*pictures, "light paths and none", 2e-4)


LAMP_AT = np.array([0.3, 0.9, 0.2])  # in all parts, not in the picture
EYE, HALF = np.array([0.0, 0.0, 5.0]), 0.1  # looks along -z; half width of the picture at 1
CONE = 50.0  # [degrees], about -y


def density_at(medium: Any, points: np.ndarray) -> np.ndarray:
    """The density at points (..., 3), in float64; what has no grid has one in the grids' box."""
    values = np.asarray(getattr(medium, "density", np.ones((1, 1, 1))), float)
    inverse = np.linalg.inv(TURNED)
    unit = points @ inverse[:3, :3].T + inverse[:3, 3]
    inside = ((unit >= 0.0) & (unit <= 1.0)).all(axis=-1)
    size = np.array(values.shape)
    at = np.clip(unit * size - 0.5, 0.0, size - 1.0)
    low = np.minimum(at.astype(int), np.maximum(size - 2, 0))
    found = np.zeros(points.shape[:-1])
    for corner in np.ndindex(2, 2, 2):
        weight = np.where(corner, at - low, 1.0 - (at - low)).prod(axis=-1)
        found += weight * values[tuple(np.moveaxis(np.minimum(low + corner, size - 1), -1, 0))]
    return found * inside


def scattered_once(parts: tuple[Any, ...], intensity: float) -> np.ndarray:
    """The mean of a picture of light that a lamp at LAMP_AT sends, and a mixture scatters once.

    The integral along rays of transmittance, scattering and transmittance, by the midpoint rule.
    """
    rays, steps, on = 12, 160, 60
    place = HALF * ((np.arange(rays) + 0.5) / rays * 2.0 - 1.0)
    x, y = np.meshgrid(place, place)
    d = np.stack([x, y, -np.ones_like(x)], axis=-1)[:, :, None]
    d /= np.linalg.norm(d, axis=-1, keepdims=True)
    near, far = (-(EYE[2] - z) / d[..., 2] for z in (2.0, -2.0))  # of the box
    step = (far - near) / steps
    p = EYE + (near + (np.arange(steps) + 0.5) * step)[..., None] * d
    to = LAMP_AT - p
    distance = np.linalg.norm(to, axis=-1)
    along = p[..., None, :] + (np.arange(on) + 0.5)[:, None] / on * to[..., None, :]
    depth: Any = np.zeros((*p.shape[:-1], 3))
    shines: Any = np.zeros((*p.shape[:-1], 3))
    for part in parts:
        density = density_at(part, p)
        absorbs, scatters = (one.to_rgb("unbounded") for one in part.coefficients(False))
        before = (np.cumsum(density, axis=-1) - density / 2.0) * step
        after = density_at(part, along).mean(axis=-1) * distance
        depth += (before + after)[..., None] * (absorbs + scatters)
        g = 0.7 if part.phase is FORWARD else 0.0
        cosine = np.einsum("...i,...i->...", np.broadcast_to(d, to.shape), to) / distance
        phase = (1.0 - g * g) / (1.0 + g * g - 2.0 * g * cosine) ** 1.5 / (4.0 * np.pi)
        shines += (density * phase)[..., None] * scatters
    lit = to[..., 1] / distance > np.cos(np.radians(CONE))
    value = intensity * shines * np.exp(-depth) * (lit / distance**2)[..., None]
    return (value.sum(axis=2) * step).mean(axis=(0, 1))


@pytest.mark.slow
@pytest.mark.parametrize("way", ["path", "light paths", "vcm"])
def test_around_a_spot(way: str) -> None:
    """Light of a lamp in the mixture that is scattered once, from either end, is the integral."""
    parts = (grid(2.0 * RANDOM, sigma_t=(0.2, 0.9, 1.7), albedo=0.7, phase=FORWARD), MIST)
    scene = scene_of(media.Mixture(parts=parts), light=0.0)
    given: dict[str, integrators.Integrator] = {
        "path": integrators.Path(max_depth=2, light_paths=0),
        "light paths": integrators.Path(max_depth=2, light_paths=1),
        "vcm": integrators.Vcm(max_depth=2),
    }
    scene.integrator = given[way]
    down = clpt.transforms.look_at(LAMP_AT, LAMP_AT - [0, 1, 0], [1, 0, 0])
    scene.lights = [Spot(to_world=down, intensity=(20.0,) * 3, cutoff=CONE, beam_width=CONE - 1e-3)]
    fov = 2.0 * float(np.degrees(np.arctan(HALF)))
    eye = clpt.transforms.look_at(EYE, [0, 0, 0], [0, 1, 0])
    scene.camera = Perspective(to_world=eye, fov=fov)
    assert_mean(exposures(scene, 16, 256), scattered_once(parts, 20.0), 0.02, 0.01)


@pytest.mark.parametrize("mode", ["rgb", "spectral"])
def test_density_bounds_all_parts(mode: str) -> None:
    """At every point and wavelength, and nowhere by more than it must at one of these."""
    encoder = Encoder(mode)
    mixture = media.Mixture(parts=(SMOKE, DARK, MIST))
    density, parts = grids.mixed(mixture, encoder)

    def extinction(coefficients: Any) -> np.ndarray:
        both = [
            gridded(one, encoder.spectra.grid) if mode == "spectral" else one.to_rgb("unbounded")
            for one in coefficients
        ]
        return np.sum(both, axis=0)

    bound = density[..., None] * extinction(mixture.coefficients(mode == "spectral"))
    each = [extinction(one.coefficients(mode == "spectral")) for one in mixture.parts]
    there = parts.astype(float) @ np.array(each)
    assert (there <= bound).all()
    assert (there / bound).max(axis=-1).min() > 0.999


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"parts": ()}, "must be a list of 1 to 8 media"),
        ({"parts": (MIST,) * 9}, "must be a list of 1 to 8 media"),
        ({"parts": (MIST, None)}, r"parts\[1\]: must be homogeneous or a grid, not None"),
        ({"parts": (media.Cloud(),)}, r"parts\[0\]: must be homogeneous or a grid, not cloud"),
        ({"parts": (media.Homogeneous(sigma_a=1.0, emission=2.0),)}, "gives out light"),
        ({"parts": (SMOKE, media.Grid())}, r"parts\[1\]: its box is not that of the first grid"),
        ({"parts": (grid(RANDOM, albedo_grid=np.ones((2, 2, 2, 3))),)}, "has colours on its grid"),
        ({"parts": (MIST,), "phase": FORWARD}, "phase functions of its parts"),
        ({"parts": (MIST,), "to_world": np.diag([1.0, 0.0, 1.0, 1.0])}, "has no inverse"),
    ],
)
def test_what_is_no_mixture(given: dict[str, Any], said: str) -> None:
    with pytest.raises(SceneError, match=said):
        media.Mixture(**given)


SCENE = {
    "camera": {"type": "perspective"},
    "media": {
        "haze": {"type": "homogeneous", "sigma_s": 2},
        "air": {
            "type": "mixture",
            "parts": ["haze", {"type": "grid", "density": "a.npy", "sigma_a": 3}],
        },
    },
    "shapes": [{"type": "cube", "material": {"type": "null"}, "interior": "air"}],
}
XML = """<scene version="3.0.0"><medium id="haze" type="homogeneous"/><shape type="cube">
<bsdf type="null"/><medium name="interior" type="mixture">%s</medium></shape></scene>"""


def test_files(tmp_path: Path) -> None:
    """scene.json, written and read again, and Mitsuba's XML; parts by name; no loops."""
    np.save(tmp_path / "a.npy", RANDOM.astype(np.float32))
    path = tmp_path / "a.json"
    path.write_text(json.dumps(SCENE))
    clpt.save(clpt.load(path), tmp_path / "b.json")
    for file in (path, tmp_path / "b.json"):
        found: Any = clpt.load(file).shapes[0].interior
        assert (found.kind, found.name, found.size) == ("mixture", "air", RANDOM.shape)
        assert [part.kind for part in found.parts] == ["homogeneous", "grid"]
        assert found.parts[1].sigma_a.value == 3.0
    loop = json.loads(json.dumps(SCENE).replace('"haze", {', '"air", {'))
    path.write_text(json.dumps(loop))
    with pytest.raises(SceneError, match="the medium 'air' refers to itself"):
        clpt.load(path)
    xml = tmp_path / "a.xml"
    xml.write_text(XML % '<ref id="haze"/><medium type="dyed"/>')
    with pytest.raises(SceneError, match=r"a\.xml:2: <medium type=.dyed.>: needs the spectrum"):
        clpt.load(xml)
    xml.write_text(XML % "")
    with pytest.raises(SceneError, match=r"a\.xml:2: <medium type=.mixture.>: .*1 to 8 media"):
        clpt.load(xml)
    xml.write_text(XML % '<ref id="haze"/><medium type="homogeneous"/>')
    assert len(clpt.load(xml).shapes[0].interior.parts) == 2
