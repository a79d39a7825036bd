"""Cameras: the rays that a film position stands for, against Mitsuba and against matrices."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from clpt import spectra, transforms
from clpt.errors import SceneError
from clpt.lenses import projections
from clpt.render.camera import encode_camera
from clpt.render.flow import stages
from clpt.render.records import CameraFeatures
from clpt.render.records import camera as camera_records
from clpt.scene import cameras as scene
from clpt.scene import roles
from clpt.scene.params import params
from tests.kernels.scene_harness import SceneProbe
from tests.rotation import rotating

BODY = """
    vec2 film = {x[0], x[1]}, lens = {x[2], x[3]};
    Spectrum weight, lambdas = spectrum_of(x[4]);
    CameraRay ray = RAY((global const RECORD *)scene.camera, film, lens);
    r[0] = ray.o.x; r[1] = ray.o.y; r[2] = ray.o.z;
    r[3] = ray.d.x; r[4] = ray.d.y; r[5] = ray.d.z; r[6] = ray.far;
"""
PLACE = transforms.look_at([3.0, 2.0, -1.5], [0.2, 0.4, 0.1], [0.1, 1.0, 0.2])


@cache
def _text(kind: str) -> dict[str, str]:
    return {"generated/camera.cl": stages.camera_text(CameraFeatures(kind, losses=True))}


def rays(camera, width, height, film, lens=None, lanes=8, index=None):
    """Origins and directions (n, 3) at film positions (n, 2); index: of a lens's glass."""
    values = ray_values(camera, width, height, film, lens, lanes, index)
    return values[:, :3], values[:, 3:6]


def ray_values(camera, width, height, film, lens=None, lanes=8, index=None):
    """Origins, directions and ends of rays (n, 7), as `rays` has them."""
    kind, words = camera.kind, encode_camera(camera, width, height)
    call = f"{kind}_ray(camera, film, lens)"
    if kind in camera_records.WEIGHTED:
        call = f"{kind}_ray(scene, camera, film, lens, lambdas, &weight)"
    if index is not None:
        call = f"{kind}_glass_ray(camera, film, lens, x[4])"
    defines = {"RAY(camera, film, lens)": call, "RECORD": camera_records.RECORDS[kind].name}
    probe = SceneProbe(
        BODY,
        5,
        7,
        files=("cameras/camera.cl", "generated/camera.cl"),
        lanes=lanes,
        virtual=_text(kind),
        defines=defines,
        tables={"camera": words},
    )
    lens = np.full_like(film, 0.5) if lens is None else lens
    return probe(*film.T, *lens.T, np.full(len(film), index or 1.0)).T


def _samples(n=64, seed=1):
    rng = np.random.default_rng(seed)
    film, lens = rng.random((2, n, 2), np.float32)
    film[:4] = [[0, 0], [1, 0], [0, 1], [0.5, 0.5]]
    return film, lens


FULL = {"fov": 50.0, "near": 0.3, "far": 80.0}
PEERS = {
    "x": (scene.Perspective(to_world=PLACE, **FULL), 64, 48, "perspective", {"fov_axis": "x"}),
    "y": (
        scene.Perspective(to_world=PLACE, fov_axis="y", **FULL),
        64,
        48,
        "perspective",
        {"fov_axis": "y"},
    ),
    "smaller": (
        scene.Perspective(to_world=PLACE, fov_axis="smaller", **FULL),
        30,
        70,
        "perspective",
        {"fov_axis": "smaller"},
    ),
    "larger": (
        scene.Perspective(to_world=PLACE, fov_axis="larger", **FULL),
        30,
        70,
        "perspective",
        {"fov_axis": "larger"},
    ),
    "offset": (
        scene.Perspective(to_world=PLACE, offset_x=0.2, offset_y=-0.1, **FULL),
        64,
        32,
        "perspective",
        {"principal_point_offset_x": 0.2, "principal_point_offset_y": -0.1},
    ),
    "lens": (
        scene.ThinLens(to_world=PLACE, aperture_radius=0.3, focus_distance=4.0, **FULL),
        64,
        32,
        "thinlens",
        {"aperture_radius": 0.3, "focus_distance": 4.0},
    ),
    "parallel": (
        scene.Orthographic(to_world=PLACE @ transforms.scale([2.0, 3.0, 1.5]), near=0.3, far=80.0),
        64,
        32,
        "orthographic",
        {},
    ),
}


@pytest.mark.peers
@pytest.mark.parametrize("name", PEERS)
def test_same_rays_as_mitsuba(name):
    mi = pytest.importorskip("mitsuba", reason="the renderer that we compare with is not installed")
    mi.set_variant("scalar_rgb")
    ours, width, height, plugin, more = PEERS[name]
    film, lens = _samples()
    origins, directions = rays(ours, width, height, film, lens)
    if plugin != "orthographic":
        more = {**more, "fov": ours.fov}
    theirs = mi.load_dict(
        {
            "type": plugin,
            "to_world": mi.ScalarTransform4f(ours.to_world),
            "near_clip": ours.near,
            "far_clip": ours.far,
            "film": {"type": "hdrfilm", "width": width, "height": height},
            **more,
        }
    )
    for o, d, f, s in zip(origins, directions, film, lens, strict=True):
        ray, _ = theirs.sample_ray(0.0, 0.5, mi.Point2f(*map(float, f)), mi.Point2f(*map(float, s)))
        np.testing.assert_allclose(o, [*ray.o], atol=2e-5)
        np.testing.assert_allclose(d, [*ray.d], atol=2e-6)


def _gl_perspective(fov, aspect, near, far=None):
    f = 1.0 / np.tan(np.radians(fov) / 2.0)
    z = (
        (-1.0, -2.0 * near)
        if far is None
        else (
            (far + near) / (near - far),
            2.0 * far * near / (near - far),
        )
    )
    return np.array([[f / aspect, 0, 0, 0], [0, f, 0, 0], [0, 0, *z], [0, 0, -1, 0]])


@pytest.mark.parametrize("far", [5.0, 1e6, None], ids=["near", "far", "infinite"])
@pytest.mark.parametrize("size", [1.0, 1e-4, 1e4])
def test_matrix_is_the_perspective_camera(far, size):
    """The same pinhole as an OpenGL camera, whose eye looks along -z with +x to the right."""
    place = PLACE.copy()
    place[:3, 3] *= size
    camera = scene.Perspective(to_world=place, fov=50.0, fov_axis="y", near=0.5 * size, far=1e9)
    view = np.linalg.inv(place @ np.diag([-1.0, 1.0, -1.0, 1.0]))
    planes = (0.5 * size, None if far is None else far * size)
    matrix = scene.Matrix(view=view, projection=_gl_perspective(50.0, 2.0, *planes))
    film, _ = _samples()
    origins, directions = rays(camera, 64, 32, film)
    again, along = rays(matrix, 64, 32, film)
    np.testing.assert_allclose(along, directions, atol=1e-6)
    np.testing.assert_allclose(again / size, origins / size, atol=3e-6)


def test_matrix_of_parallel_rays():
    """glOrtho(-3, 3, -2, 2, 1, 9) from (0, 0, 5): rays along -z that start at z = 4."""
    projection = np.diag([1 / 3, 1 / 2, -2 / 8, 1.0])
    projection[2, 3] = -10 / 8
    matrix = scene.Matrix(view=transforms.translate([0, 0, -5]), projection=projection)
    film, _ = _samples()
    origins, directions = rays(matrix, 60, 40, film)
    expected = np.column_stack([6 * film[:, 0] - 3, 2 - 4 * film[:, 1], np.full(len(film), 4.0)])
    np.testing.assert_allclose(origins, expected, atol=1e-6)
    np.testing.assert_allclose(directions, [[0, 0, -1]] * len(film), atol=1e-7)


def test_spherical_directions():
    film = np.array([[0.5, 0.5], [0.25, 0.5], [0.75, 0.5], [0.3, 0.0], [0.3, 1.0], [1.0, 0.5]])
    _, directions = rays(scene.Spherical(), 8, 4, film.astype(np.float32))
    expected = [[0, 0, 1], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, -1]]
    np.testing.assert_allclose(directions, expected, atol=1e-6)


def test_spherical_wraps_beyond_the_film():
    film = np.array([[-0.1, 0.3], [0.9, 0.3], [0.2, -0.1], [0.7, 0.1], [0.2, 1.1], [0.7, 0.9]])
    _, directions = rays(scene.Spherical(to_world=PLACE), 8, 4, film.astype(np.float32))
    np.testing.assert_allclose(directions[::2], directions[1::2], atol=1e-6)


def test_lens_in_focus():
    """All rays of one film position meet in the plane of focus; the aperture is filled evenly."""
    _, lens = _samples(4096)
    film = np.tile(np.float32([[0.3, 0.8]]), (len(lens), 1))
    camera = scene.ThinLens(aperture_radius=0.5, focus_distance=3.0, near=0.0)
    origins, directions = rays(camera, 64, 64, film, lens)
    pinhole, along = rays(scene.Perspective(near=0.0), 64, 64, film[:1])
    target = pinhole[0] + along[0] * 3.0 / along[0, 2]
    met = origins + directions * (3.0 / directions[:, 2:])
    np.testing.assert_allclose(met, np.tile(target, (len(met), 1)), atol=5e-6)
    radius = np.linalg.norm(origins[:, :2], axis=1) / 0.5
    assert radius.max() <= 1.0 + 1e-6
    # r^2 is uniform: its mean is 1/2 within 5 standard errors (two-sided significance 6e-7)
    assert abs(np.mean(radius**2) - 0.5) < 5 * np.sqrt(1 / 12 / len(lens))


@rotating("cls, lanes", scene.KINDS, (8, 16))
def test_unit_directions_in_all_lane_widths(cls, lanes):
    film, lens = _samples()
    camera = cls() if cls is scene.Matrix else cls(to_world=PLACE)
    single = rays(camera, 40, 30, film, lens, lanes=1)
    np.testing.assert_allclose(np.linalg.norm(single[1], axis=1), 1.0, atol=3e-7)
    for a, b in zip(rays(camera, 40, 30, film, lens, lanes=lanes), single, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-6)


GLASSES = {"sf11": (4.0, 0.05), "bk7": (1.5, 0.085), "diamond": (30.0, 0.4)}


@pytest.mark.parametrize("name", GLASSES)
def test_lens_of_glass_focuses_each_wavelength_elsewhere(name):
    """Rays of one film position and wavelength meet at the distance of the thin lens's equation.

    1 / f = (n - 1) K and 1 / s + 1 / s' = 1 / f (Hecht 2017, 5.2), in float64, the film
    at the s' that is sharp at 587.56 nm.
    """
    focus, length = GLASSES[name]
    index = spectra.glass(name)
    camera = scene.ThinLens(
        aperture_radius=0.02, focus_distance=focus, focal_length=length, glass=name, near=0.0
    )
    curvatures = 1.0 / length / (index.sample(587.56) - 1.0)
    image = 1.0 / (1.0 / length - 1.0 / focus)
    _, lens = _samples(64)
    film = np.tile(np.float32([[0.3, 0.8]]), (len(lens), 1))
    _, chief = rays(scene.Perspective(near=0.0), 64, 64, film[:1])
    chief = chief[0] / chief[0, 2]
    for wavelength in np.linspace(390.0, 780.0, 10):
        n = float(index.sample(wavelength))
        expected = (n - 1.0) * curvatures - 1.0 / image  # 1 / s; below 0 beyond infinity
        origins, directions = rays(camera, 64, 64, film, lens, index=n)
        slopes = directions / directions[:, 2:]
        radius2 = np.sum(origins[:, :2] ** 2, axis=1)
        found = -np.sum((slopes - chief)[:, :2] * origins[:, :2], axis=1) / np.maximum(
            radius2, 1e-9
        )
        np.testing.assert_allclose(found[radius2 > 4e-5], expected, atol=5e-5 / 0.006, rtol=1e-4)


SINGULAR = np.diag([1.0, 0.0, 1.0, 1.0])


@pytest.mark.parametrize(
    ("camera", "part"),
    [
        (scene.Perspective(to_world=SINGULAR), "perspective.to_world"),
        (scene.Perspective(to_world=np.full((4, 4), np.nan)), "finite"),
        (scene.Perspective(to_world=transforms.scale(2.0)), "scale"),
        (scene.Orthographic(to_world=_gl_perspective(50, 1, 1)), "0 0 0 1"),
        (scene.ThinLens(near=2.0, far=1.0), "near"),
        (scene.Matrix(view=SINGULAR), "matrix.view"),
        (scene.Matrix(projection=SINGULAR), "matrix.projection"),
    ],
)
def test_unusable_cameras(camera, part):
    with pytest.raises(SceneError, match=part.replace(".", r"\.")):
        encode_camera(camera, 4, 4)


# ---- the contract of a kind, with all numbers that it declares away from their defaults


def numbers(cls):
    """The names of the numbers that a camera declares, with their declarations."""
    return {name: p for name, p in params(cls).items() if p.role is roles.REAL}


def varied(cls):
    """A camera whose numbers are not their defaults."""
    plain = cls()
    values = {
        name: float(np.clip(1.2 * getattr(plain, name) or 0.1, p.low, p.high))
        for name, p in numbers(cls).items()
    }
    return cls(to_world=PLACE, **values)


BASES = {scene.Lens: {"blades": 6, "f_number": 4.0}}  # where each number matters


@pytest.mark.parametrize("cls, name", [(cls, name) for cls in scene.KINDS for name in numbers(cls)])
def test_every_number_changes_rays(cls, name):
    """Of a traced lens it changes the record: rays that are reflected have its numbers too."""
    one = cls(**BASES[cls]) if cls in BASES else varied(cls)
    pair = one, replace(one, **{name: 1.1 * getattr(one, name) or 0.02})
    if cls is scene.Lens:
        first, second = (encode_camera(camera, 40, 30) for camera in pair)
        assert first.shape != second.shape or (first != second).any()
        return
    index = 1.6 if hasattr(one, "glass") else None
    first, second = (ray_values(camera, 40, 30, *_samples(), index=index) for camera in pair)
    assert not np.allclose(first, second, rtol=1e-5, atol=1e-6)


STEPS = {
    "screen": """
        mask seen = mask_of(1), away = x[3] > 0.5f;
        vec3 p = {x[0], x[1], x[2]};
        vec2 film = KIND_screen(RECORD, p, away, &seen);
        r[0] = film.x; r[1] = film.y; r[2] = sel(seen, (real)(1.0f), (real)(0.0f)); r[3] = 1.0f;
    """,
    "connect": """
        vec2 lens = {0.5f, 0.5f};
        vec3 p = {x[0], x[1], x[2]};
        CameraPoint c = KIND_connect(RECORD, scene.settings, p, x[3] > 0.5f, lens);
        r[0] = c.film.x / 40.0f; r[1] = c.film.y / 30.0f;
        r[2] = sel(c.seen, (real)(1.0f), (real)(0.0f)); r[3] = c.importance;
    """,
}


def projected(camera, step, points, away):
    """Where a step sees points (n, 3) on a film of 40 x 30: x, y, seen and its importance."""
    kind = camera.kind
    record = f"(global const {camera_records.RECORDS[kind].name} *)scene.camera"
    probe = SceneProbe(
        STEPS[step].replace("KIND", kind).replace("RECORD", record),
        4,
        4,
        files=(
            "cameras/camera.cl", "film/connect.cl", "generated/camera.cl",
            f"cameras/kinds/{kind}.cl#{step}",
        ),
        virtual=_text(kind),
        tables={"camera": encode_camera(camera, 40, 30)},
        settings={"film_width": 40, "film_height": 30, "width": 40, "height": 30},
    )  # fmt: skip
    return probe(*points.T, np.full(len(points), float(away)))


MODELS = {
    "opencv": ([32.0, 33.0, 19.0, 15.0], (-0.25, 0.08, 0.002, -0.003, -0.01)),
    "rational": ([28.0, 29.0, 19.5, 14.5], (0.4, -0.1, 0.001, 0.002, 0.02, 0.5, -0.05, 0.01)),
    "thin_prism": (
        [32.0, 32.0, 19.5, 14.5],
        (0.1, 0.02, 1e-3, 2e-3, 0.0, 0.0, 0.0, 0.0, 3e-3, -1e-3, 2e-3, 4e-3),
    ),
    "kannala_brandt": ([14.0, 13.0, 19.0, 15.0], (-0.02, 0.01, -0.003, 1e-3)),
    "fov": ([20.0, 20.0, 19.5, 14.5], (0.9,)),
    "ucm": ([24.0, 24.0, 19.5, 14.5], (0.6,)),
    "eucm": ([24.0, 24.0, 19.5, 14.5], (0.6, 1.2)),
    "double_sphere": ([16.0, 16.0, 19.5, 14.5], (-0.2, 0.6)),
}
SEEN = {cls.kind: varied(cls) for cls in scene.KINDS} | {
    name: scene.Calibrated(
        model=name if name in projections.MODELS else "opencv",
        intrinsics=intrinsics, distortion=distortion, to_world=PLACE,
    )
    for name, (intrinsics, distortion) in MODELS.items()
}  # fmt: skip


@pytest.mark.parametrize(
    "name, step",
    [
        (name, step)
        for name, camera in SEEN.items()
        for step, asked in (("screen", camera.has_screen), ("connect", camera.connects))
        if asked
    ],
)
def test_points_are_seen_where_their_rays_begin(name, step):
    """What a ray of the film meets is projected back to its place, near and infinitely far."""
    camera = SEEN[name]
    pixels = [4.0, 3.0] + [32.0, 24.0] * _samples()[0]
    pixels += 0.3 - 0.6 * (pixels % 1.0)  # off their edges, where directions bend
    film = np.float32(pixels / [40.0, 30.0])
    origins, directions = rays(camera, 40, 30, film)
    x, y, seen, importance = projected(camera, step, origins + 3.0 * directions, away=False)
    assert seen.all()
    np.testing.assert_allclose(np.stack([x, y], axis=1), film, atol=2e-5)
    if camera.connects:
        assert (
            pytest.approx(np.column_stack([film, np.ones(len(film))]), abs=2e-5)
            == projected(camera, step, directions, away=True)[:3].T
        )
    if step == "connect":  # over the solid angle of the film, at 1 m
        d = [directions, *(rays(camera, 40, 30, film + e)[1] for e in 1e-3 * np.eye(2))]
        solid = np.linalg.norm(np.cross(d[1] - d[0], d[2] - d[0]), axis=1) * 1e6
        distance = np.linalg.norm(origins + 3.0 * directions - PLACE[:3, 3], axis=1)
        np.testing.assert_allclose(importance * solid * distance**2, 1.0, rtol=5e-3)
