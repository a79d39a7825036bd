"""Light by time: single bounces against formulas, refraction, and sums that are the picture."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import clpt
from clpt import spectra
from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.render.film import film_file
from clpt.scene import Film, Scene, cameras, media
from clpt.scene import materials as mt
from clpt.scene.integrators import LIGHT_SPEED, Auto, Direct, Gaussian, ParticleTracer, Path, Vcm
from clpt.scene.lights import Area, Constant, Directional, Point
from clpt.scene.params import real
from clpt.scene.shapes import Cube, Rectangle, Sphere

CAMERA = Path(light_paths=0)
AHEAD = (0.0, 0.0, 1.0)


def timed(metres: tuple[float, float], bins: int, **film) -> Film:
    """A film whose bins are equal parts of a range of optical lengths [m]."""
    low, high = (length / LIGHT_SPEED for length in metres)
    given = {"width": 1, "height": 1, "mode": "rgb", **film}
    return Film(**given, time_bins=bins, time_min=low, time_max=high)


def ray(direction=AHEAD, origin=(0.0, 0.0, 0.0)) -> cameras.Rays:
    return cameras.Rays(origins=[origin], directions=[direction])


def rendered(scene: Scene, samples: int = 16, **options):
    with clpt.Renderer(scene, **options) as renderer:
        renderer.run(samples)
        return renderer.times(), renderer.colours()


def slab(material, near: float = 1.0, thick: float = 1.0) -> Cube:
    """A wide body before the camera, between two planes across z."""
    place = tf.translate([0, 0, near + thick / 2.0]) @ tf.scale([50.0, 50.0, thick / 2.0])
    return Cube(to_world=place, material=material)


def wall(z: float, **kind) -> Rectangle:
    """A wide wall at z that faces the camera."""
    return Rectangle(
        to_world=tf.translate([0, 0, z]) @ tf.rotate([0, 1, 0], 180) @ tf.scale(60.0), **kind
    )


def test_returns_of_a_wall_by_formulas():
    """A lamp at the sensor: at the distance r along a ray the light comes after 2 r / c, with the
    radiance rho / pi I cos / r^2."""
    angles = np.radians([0.0, 20.0, 50.0])
    directions = np.stack([np.sin(angles), 0.0 * angles, np.cos(angles)], axis=1)
    scene = Scene(
        camera=cameras.Rays(origins=np.zeros((3, 3)), directions=directions),
        shapes=[wall(4.0, material=mt.Diffuse(reflectance=0.6))],
        lights=[Point(position=(0, 0, 0), intensity=2.0)],
        integrator=Direct(),
        film=timed((0.0, 20.0), 400, width=3),
    )
    times, colours = rendered(scene)
    distance = 4.0 / np.cos(angles)
    light = times[0, :, :, 0].astype(np.float64)
    bins = np.floor(2.0 * distance / 0.05).astype(int)
    expected = 0.6 / np.pi * 2.0 * np.cos(angles) / distance**2
    np.testing.assert_allclose(light[np.arange(3), bins], expected, rtol=1e-4)
    np.testing.assert_allclose(light.sum(axis=1), colours[0, :, 0], rtol=1e-5)


def test_glass_delays_by_its_optical_thickness():
    """A wall that shines, 3 m away, behind 1 m of glass: 3.5 m, and by two reflections inside of
    the glass 6.5 m; by Fresnel's (1 - R)^2 and that times R^2."""
    glass = mt.Dielectric(int_ior=1.5, ext_ior=1.0)
    scene = Scene(
        camera=ray(),
        shapes=[
            slab(glass),
            wall(3.0, emission=Area(radiance=1.0), material=mt.Diffuse(reflectance=0.0)),
        ],
        integrator=CAMERA,
        film=timed((0.05, 10.05), 100),
    )
    times, _ = rendered(scene, 4096)
    light = times[0, 0, :, 1].astype(np.float64)
    reflected = 0.2**2
    assert np.nonzero(light)[0].tolist() == [34, 64]
    assert light[34] == pytest.approx((1.0 - reflected) ** 2, rel=0.02)
    assert light[64] == pytest.approx((1.0 - reflected) ** 2 * reflected**2, rel=0.7)


def test_a_camera_in_glass_counts_its_index():
    """2 m of glass around the camera, then 1 m: 1.5 x 2 + 1."""
    glass = mt.Dielectric(int_ior=1.5, ext_ior=1.0)
    scene = Scene(
        camera=ray(),
        shapes=[slab(glass, -3.0, 5.0), wall(3.0, emission=Area(radiance=1.0))],
        integrator=Path(light_paths=0, max_depth=3),
        film=timed((0.05, 10.05), 100),
    )
    times, _ = rendered(scene, 64)
    assert np.nonzero(times[0, 0, :, 0])[0].tolist() == [39]


ROUGH = {
    "rough_dielectric": mt.RoughDielectric(int_ior=1.5, ext_ior=1.0, alpha=0.4),
    "principled": mt.Principled(eta=1.5, spec_trans=1.0, roughness=0.6),
    "openpbr": mt.Openpbr(specular_ior=1.5, transmission_weight=1.0, specular_roughness=0.6),
    "gltf_surface": mt.GltfSurface(ior=1.5, transmission=1.0, roughness=0.6),
}


@pytest.mark.parametrize(
    "kind",
    [
        "rough_dielectric",
        *(pytest.param(kind, marks=pytest.mark.slow) for kind in [*ROUGH][1:]),
    ],
)
def test_rough_glass_counts_the_index_of_each_side(kind):
    """A point lamp 8 m behind 1 m of rough glass: the first light comes after 1 + 1.5 + 8 m."""
    scene = Scene(
        camera=ray(),
        shapes=[slab(ROUGH[kind])],
        lights=[Point(position=(0, 0, 10), intensity=1.0)],
        integrator=Path(light_paths=0, max_depth=3),
        film=timed((0.05, 30.05), 300),
    )
    times, _ = rendered(scene, 1024)
    assert np.nonzero(times[0, 0, :, 0])[0][0] in (104, 105)


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Milky(mt.Material):
    """A boundary that scatters all light evenly to its other side."""

    ior: Any = real(1.5, "index behind the front")
    has_across = True
    source = """
real milky_pdf(Milky m, vec3 wo, vec3 wi)
{
    return sel(wo.z * wi.z < 0.0f, fabs(wi.z) * INV_PI, (real)(0.0f));
}
Spectrum milky_eval(Milky m, vec3 wo, vec3 wi) { return spectrum_of(milky_pdf(m, wo, wi)); }
BsdfSample milky_sample(Milky m, vec3 wo, vec3 u)
{
    BsdfSample s = bsdf_nothing();
    vec2 uv = {u.x, u.y};
    s.wi = cosine_hemisphere(uv);
    s.wi.z = sel(wo.z > 0.0f, -s.wi.z, s.wi.z);
    s.weight = spectrum_of((real)(1.0f));
    s.pdf = milky_pdf(m, wo, s.wi);
    s.eta = sel(wo.z > 0.0f, m.ior, 1.0f / m.ior);
    s.lobe = (integer)(LOBE_TRANSMIT);
    return s;
}
Spectrum milky_albedo(Milky m) { return spectrum_of((real)(1.0f)); }
real milky_across(Milky m) { return m.ior; }
"""

    @property
    def transmits(self) -> bool:
        return True


@pytest.mark.slow
def test_a_material_of_the_caller_tells_its_index():
    """The first light comes through 1 m of it straight on, at once to the lamp behind or before."""
    for lamp, first in ((10.0, 1.0 + 1.5 + 8.0), (1.6, 1.0 + 1.5 * 0.6)):
        scene = Scene(
            camera=ray(),
            shapes=[slab(Milky())],
            lights=[Point(position=(0, 0, lamp), intensity=1.0)],
            integrator=Path(light_paths=0, max_depth=3),
            film=timed((0.05, 30.05), 300),
        )
        times, _ = rendered(scene, 1024)
        begin = int(first * 10.0 - 0.5)
        assert np.nonzero(times[0, 0, :, 0])[0][0] in (begin - 1, begin, begin + 1)


def room(**film) -> Scene:
    """Surfaces of several kinds, a glass ball, a pane, a lamp, a point and a sky."""
    grey = mt.Diffuse(reflectance=(0.7, 0.5, 0.3))
    pane = Rectangle(to_world=tf.translate([0, 1, 2]) @ tf.scale(0.6), material=mt.ThinDielectric())
    return Scene(
        camera=cameras.Perspective(to_world=tf.look_at([0, 1.5, 5], [0, 1, 0], [0, 1, 0]), fov=45),
        shapes=[
            Rectangle(to_world=tf.rotate([1, 0, 0], -90) @ tf.scale(4), material=grey),
            Sphere(center=(0.7, 0.5, 0), radius=0.5, material=mt.Dielectric()),
            Sphere(center=(-0.9, 0.5, 0), radius=0.5, material=mt.RoughDielectric(alpha=0.3)),
            Sphere(center=(-1, 2.2, 0), radius=0.2, emission=Area(radiance=9.0)),
            pane,
        ],
        lights=[Point(position=(-2, 1, 1), intensity=(0, 0, 4)), Constant(radiance=0.3)],
        film=timed((0.0, 20.0), 16, **{"width": 16, "height": 12, **film}),
        integrator=Auto(),
    )


@pytest.mark.parametrize(
    "film",
    [
        {},
        pytest.param({"layers": ("direct", "light_groups")}, marks=pytest.mark.slow),
        pytest.param(
            {"mode": "spectral", "bands": 4, "alpha": True, "filter": Gaussian()},
            marks=pytest.mark.slow,
        ),
    ],
)
def test_all_times_are_the_picture(film, caplog):
    times, colours = rendered(room(**film), 32)
    np.testing.assert_allclose(times.sum(axis=2), colours, rtol=1e-4, atol=1e-5)
    assert (times[..., :-1, :] > 0.0).any(axis=(0, 1, 3)).sum() > 6
    share = np.abs(times[:, :, -1]).sum() / np.abs(times).sum()
    assert 0.02 < share < 0.98
    assert f"{share:.1%} of the light is not in 0 to 66.7" in caplog.text


def test_parts_add_up_to_the_bit(tmp_path):
    """Samples 6 to 15, and 0 to 5 that come from a file, are samples 0 to 15."""
    scene = room()
    with clpt.Renderer(scene) as whole:
        whole.run(16)
        expected, times = whole.film_state().light_layers, whole.times()
    with clpt.Renderer(scene) as first:
        first.run(6)
        film_file.write(tmp_path / "first.film", first.saved_film())
    with clpt.Renderer(scene, first_sample=6) as renderer:
        renderer.run(10)
        renderer.merge(film_file.read(tmp_path / "first.film").film)
        np.testing.assert_array_equal(renderer.film_state().light_layers, expected)
        np.testing.assert_array_equal(renderer.times(), times)


def test_the_near_plane_changes_no_time():
    scene = room()
    far = dataclasses.replace(scene.camera, near=1.5)
    first, _ = rendered(scene, 8)
    second, _ = rendered(dataclasses.replace(scene, camera=far), 8)
    np.testing.assert_allclose(second.sum((0, 1)), first.sum((0, 1)), rtol=0.02, atol=1e-3)


def test_scattering_takes_its_way():
    """Light of a point at the camera that fog scatters once comes between the ends of the fog."""
    fog = media.Homogeneous(sigma_a=0.0, sigma_s=0.2)
    cloud = dataclasses.replace(slab(mt.Null(), 2.0, 1.0), interior=fog)
    scene = Scene(
        camera=ray(),
        shapes=[cloud],
        lights=[Point(position=(0, 0, 0), intensity=1.0)],
        integrator=Path(light_paths=0, max_depth=2),
        film=timed((0.0, 20.0), 200),
    )
    times, colours = rendered(scene, 2048)
    light = times[0, 0, :, 0].astype(np.float64)
    lit = np.nonzero(light)[0]
    assert 40 <= lit.min() <= 41 and 58 <= lit.max() <= 60
    middle = np.arange(40, 60) * 0.05 + 0.025  # along the ray [m]
    expected = 0.2 / (4.0 * np.pi) * np.exp(-0.4 * (middle - 2.0)) / middle**2 * 0.05
    assert light[40:60].sum() == pytest.approx(expected.sum(), rel=0.01)
    np.testing.assert_allclose(light[40:60], expected, rtol=0.35)
    assert light.sum() == pytest.approx(colours[0, 0, 0], rel=1e-5)


def test_light_from_infinity_is_outside():
    scene = Scene(
        camera=ray(),
        shapes=[wall(3.0)],
        lights=[Directional(direction=AHEAD, irradiance=1.0)],
        integrator=CAMERA,
        film=timed((0.0, 1e6), 4),
    )
    times, _ = rendered(scene)
    assert not times[:, :, :-1].any() and times[0, 0, -1, 0] == pytest.approx(0.5 / np.pi, rel=0.01)


GLOW = media.Homogeneous(sigma_a=1.0, sigma_s=0.0, emission=1.0)


@pytest.mark.parametrize(
    ("changes", "film", "message"),
    [
        ({"integrator": Vcm()}, {}, "only paths from the camera have times"),
        ({"integrator": ParticleTracer()}, {}, "only paths from the camera have times"),
        ({"integrator": Path(light_paths=1)}, {}, "only paths from the camera have times"),
        ({}, {"filtering": "splatting"}, "one pixel"),
        ({"shapes": [dataclasses.replace(slab(mt.Null()), interior=GLOW)]}, {}, "no single time"),
    ],
)
def test_what_has_no_times_is_refused(changes, film, message):
    scene = dataclasses.replace(room(**film), **changes)
    with pytest.raises(SceneError, match=message):
        clpt.Renderer(scene)


def test_ranges_that_make_no_sense_are_refused():
    with pytest.raises(SceneError, match="above time_min"):
        Film(time_bins=3, time_min=5.0, time_max=5.0)
    with pytest.raises(SceneError, match=r"film\.time_bins"):
        Film(time_bins=-1)
    plain = Scene(lights=[Constant()], camera=ray(), film=Film(size=(2, 2)))
    with clpt.Renderer(plain) as renderer, pytest.raises(SceneError, match="has no times"):
        renderer.times()


F2 = {"int_ior": "f2", "ext_ior": 1.0}
SHINING = {"emission": Area(radiance=1.0), "material": mt.Diffuse(reflectance=0.0)}
IN_GLASS = {  # shapes, metres of glass, and of air
    "behind glass": ([slab(mt.Dielectric(**F2), thick=2.0), wall(4.0, **SHINING)], 2.0, 2.0),
    "camera in glass": ([slab(mt.Dielectric(**F2), -3.0, 5.0), wall(3.0, **SHINING)], 2.0, 1.0),
    "rough glass": ([slab(mt.RoughDielectric(**F2, alpha=0.05))], 1.0, 9.0),
}


@pytest.mark.parametrize("name", IN_GLASS)
def test_pulses_go_at_the_speed_of_groups_in_glass(name):
    """F2 at 589.3 nm: n is 1.620, and n - lambda dn / dlambda by Schott's formula 1.670."""
    shapes, glass, air = IN_GLASS[name]
    reach = {"mode": "spectral", "lambda_min": 587.3, "lambda_max": 591.3}
    scene = Scene(
        camera=ray(),
        shapes=shapes,
        lights=[Point(position=(0, 0, 10), intensity=1.0)] if "rough" in name else [],
        integrator=Path(light_paths=0, max_depth=3),
        film=timed((0.05, 20.05), 20000, **reach),
    )
    times, _ = rendered(scene, 256)
    index = spectra.index("f2").sample([589.3 - 0.1, 589.3, 589.3 + 0.1])
    group = index[1] - 589.3 * (index[2] - index[0]) / 0.2
    assert group == pytest.approx(1.67038, abs=1e-4)
    first = 0.05 + 1e-3 * np.nonzero(times[0, 0, :-1].any(axis=1))[0][0]
    assert first == pytest.approx(group * glass + air, abs=3e-3)


def test_light_in_even_glass_has_the_index_of_phases():
    """A constant index, in spectral mode too: it has no slope."""
    even = mt.Dielectric(int_ior=1.6, ext_ior=1.0)
    scene = Scene(
        camera=ray(),
        shapes=[slab(even, thick=2.0), wall(4.0, **SHINING)],
        integrator=CAMERA,
        film=timed((0.05, 10.05), 1000, mode="spectral"),
    )
    times, _ = rendered(scene, 64)
    assert np.nonzero(times[0, 0, :-1].any(axis=1))[0][0] == 514
