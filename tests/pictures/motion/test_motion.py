"""Motion while the shutter is open: against formulas, and against the mean of still pictures."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clpt
from clpt import transforms
from clpt.errors import SceneError
from clpt.geometry import motion
from clpt.geometry.tubes import as_tubes
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Scene, cameras, integrators, lights, materials, media, shapes, textures
from clpt.scene.motion import Deformation, Keys, Shutter, decomposed, rotation
from tests.pictures.support import Values

TIMES = np.linspace(0.0, 1.0, 5)
GREY = materials.TwoSided(front=materials.Diffuse(reflectance=0.5))
WALL = shapes.Rectangle(
    to_world=transforms.translate([0, 0, 2])
    @ transforms.rotate([0, 1, 0], 180)
    @ transforms.scale(5),
    material=materials.Diffuse(reflectance=0.6),
)
LOOK = transforms.look_at([0, 0, -5], [0, 0, 0], [0, 1, 0])
STEPS = integrators.Path(max_depth=3)
Z = 5.0  # of the largest of some hundreds of normal numbers: 1e-4


def turn(axis: Any, degrees: float) -> Keys:
    return Keys(TIMES, [transforms.rotate(axis, degrees * t) for t in TIMES])


def slide(first: Any, last: Any) -> Keys:
    return Keys([0.0, 1.0], [transforms.translate(first), transforms.translate(last)])


def scene(things: Any, lamps: Any, shutter: Shutter | None, **camera: Any) -> Scene:
    kind = camera.get("kind", cameras.Perspective)
    given = {"to_world": LOOK, **({} if kind is cameras.Lens else {"fov": 40.0}), **camera}
    given.pop("kind", None)
    return Scene(
        camera=kind(shutter=shutter, **given),
        shapes=list(things),
        lights=list(lamps),
        film=integrators.Film(width=32, height=32, mode="rgb", filter=integrators.Box()),
        integrator=STEPS,
    )


GROUP = shapes.Group(
    shapes=(
        shapes.Cube(to_world=transforms.scale(0.15), material=GREY),
        shapes.Sphere(center=(0.3, 0, 0), radius=0.12, material=GREY),
        shapes.Rectangle(
            to_world=transforms.translate([0, 0.3, 0]) @ transforms.scale(0.1),
            emission=lights.Area(radiance=2.0, two_sided=True),
        ),
    )
)
STRETCHED = Keys(
    [0.0, 1.0],
    [np.eye(4), transforms.rotate([0, 0, 1], 40) @ transforms.scale([1.5, 0.5, 1.0])],
)
AMBIENT = lights.Constant(radiance=0.3)
AIR = materials.Null()
FLAME = media.Grid(
    density=np.random.default_rng(3).random((24, 24, 24)),
    to_world=transforms.translate([-1.3, -1, -1]) @ transforms.scale(2),
    sigma_a=0.5,
    emission=1.0,
)
BRUSHED = shapes.Mesh(
    vertices=[[-1, -1, 0], [-1, 1, 0], [1, 1, 0], [1, -1, 0]],
    faces=[[0, 1, 2], [0, 2, 3]],
    normals=[[0, 0, -1]] * 4,
    tangents=[[1, 1, 0, 1]] * 4,
    material=materials.TwoSided(
        front=materials.RoughConductor(eta=1.5, k=4.0, alpha_u=0.08, alpha_v=0.5)
    ),
    motion=turn([0, 0.3, 1], 80),
)


def ball(rings: int, radius: float = 1.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices, faces and uvs of a ball of triangles about z."""
    u, v = np.meshgrid(np.linspace(0, 1, 2 * rings + 1), np.linspace(1e-3, 1 - 1e-3, rings + 1))
    azimuth, polar = 2 * np.pi * u, np.pi * v
    points = [np.cos(azimuth) * np.sin(polar), np.sin(azimuth) * np.sin(polar), np.cos(polar)]
    first = (np.arange(rings)[:, None] * (2 * rings + 1) + np.arange(2 * rings)).reshape(-1, 1)
    corners = first + np.array([0, 2 * rings + 1, 1, 1, 2 * rings + 1, 2 * rings + 2])
    uvs = np.stack([u, v], axis=-1).reshape(-1, 2)
    return radius * np.stack(points, axis=-1).reshape(-1, 3), corners.reshape(-1, 3), uvs


def twisted(points: np.ndarray, turns: float, size: Any = 1.0) -> np.ndarray:
    """Points turned about y the more, the higher they are, and scaled."""
    angle = turns * points[:, 1]
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = points.T
    return np.stack([c * x + s * z, y, c * z - s * x], axis=1) * size


BALL, FACES, UVS = ball(12, 0.7)
TWIST = Deformation(
    [0.0, 0.3, 1.0],
    [BALL, twisted(BALL, 1.0, [1.2, 0.8, 1.0]), twisted(BALL, -0.5) + np.array([0.6, 0.2, 0.0])],
)
MANY = np.linspace(0.0, 1.0, 9)
OFTEN = np.union1d(MANY, TWIST.times)  # smooth normals are those of keys, and linear in between
BENT = shapes.Mesh(
    vertices=BALL,
    faces=FACES,
    uvs=UVS,
    normals="smooth",
    material=materials.TwoSided(
        front=materials.RoughConductor(eta=1.5, k=3.0, alpha_u=0.1, alpha_v=0.4)
    ),
    deformation=Deformation(OFTEN, [TWIST.at(t)[0] for t in OFTEN]),
)
CHECKED = dataclasses.replace(
    BENT,
    material=materials.TwoSided(
        front=materials.Diffuse(
            reflectance=textures.Checkerboard(
                color0=0.1, color1=0.8, to_uv=np.diag([6.0, 6.0, 1.0])
            )
        )
    ),
    motion=turn([0, 0.3, 1], 60),
)
STRANDS = shapes.Curves(
    points=(STRAND := np.array([[x, y, 0, 0.08] for x in (-0.6, 0, 0.6) for y in (-1, 0, 0.5, 1)])),
    lengths=(4, 4, 4),
    material=GREY,
    deformation=Deformation(
        [0.0, 1.0], [STRAND, STRAND + np.outer(STRAND[:, 1] ** 2, [0.5, 0, 0.2, 0.02])]
    ),
)
HAIR = as_tubes(STRANDS)  # as which rays meet what deforms, at rest too
SHARED = shapes.Group(
    shapes=(
        dataclasses.replace(BENT, to_world=transforms.scale(0.4), material=GREY),
        shapes.Cube(to_world=transforms.scale([0.5, 0.05, 0.05]), material=GREY),
    )
)
SWELLS = Keys(
    [0.0, 1.0],
    [
        np.eye(4),
        transforms.translate([0.3, 0, 0]) @ transforms.rotate([0, 1, 0], 30) @ transforms.scale(2),
    ],
)
BEAM = lights.Spot(
    to_world=transforms.look_at([2, 2, -3], [0, 0, 0], [0, 1, 0]),
    intensity=40.0,
    motion=slide([0, 0, 0], [-1, 0, 0]),
)
RISES = slide([0, 0, 0], [0, 1, 0])
FLAT = shapes.Rectangle(
    to_world=transforms.translate([0, 1.2, -1])
    @ transforms.rotate([1, 0, 0], 90)
    @ transforms.scale(0.5),
    emission=lights.Area(radiance=4.0, two_sided=True),
)
SHEET = np.array([[-0.6, -0.2, 0], [0.6, -0.2, 0], [0.6, 0.2, 0], [-0.6, 0.2, 0]], np.float32)
GLOWS = shapes.Mesh(  # a lamp that grows and bends
    vertices=SHEET,
    faces=[[0, 1, 2], [0, 2, 3]],
    emission=lights.Area(radiance=4.0, two_sided=True),
    deformation=Deformation(
        [0.0, 0.4, 1.0],
        [
            SHEET * [1, 0.2, 1],
            SHEET * [0.5, 3, 1] + [0, 0.3, 0],
            SHEET + np.array([[0, 0, 1], [0, 0, 0], [0, 1, 0], [0, 0, -1]]),
        ],
    ),
)
TURNS = dataclasses.replace(
    GLOWS,
    uvs=SHEET[:, :2] + 0.5,
    emission=lights.Area(
        radiance=textures.Checkerboard(color0=1.0, color1=6.0, to_uv=np.diag([3.0, 3.0, 1.0]))
    ),
    motion=SWELLS,
)
DULL = shapes.Sphere(center=(0, -0.8, -0.3), radius=0.4, material=GREY)
STRIP = as_tubes(  # about as bright as the wall: else all variance is that of a few pixels
    dataclasses.replace(
        STRANDS,  # MANY keys, between which a tube gets hardly thinner
        material=materials.Diffuse(reflectance=0.0),
        emission=lights.Area(radiance=0.5),
        deformation=Deformation(MANY, [STRANDS.deformation.at(t)[0] for t in MANY]),
    )
)
CASES: dict[str, tuple[Any, Any, dict[str, Any]]] = {
    "turning": ((shapes.Cube(material=GREY, motion=turn([0, 0.3, 1], 300)),), (AMBIENT,), {}),
    "scaling": (
        (shapes.Cube(to_world=transforms.scale(0.5), material=GREY, motion=STRETCHED),),
        (AMBIENT, lights.Point(position=(2, 3, -3), intensity=20.0)),
        {},
    ),
    "analytic": (
        (
            shapes.Disk(material=GREY, motion=turn([0, 1, 0.2], 60)),
            shapes.Cylinder(
                p0=(0, -1, 0), p1=(0, 1, 0), radius=0.2, material=GREY, motion=turn([0, 0, 1], 80)
            ),
            shapes.Sphere(radius=0.4, material=GREY, motion=STRETCHED),
        ),
        (AMBIENT,),
        {},
    ),
    "lamps": (
        (
            shapes.Sphere(
                radius=0.2,
                emission=lights.Area(radiance=4.0),
                motion=slide([-1, 0, 0], [1, 0.5, 0]),
            ),
            shapes.Cube(
                to_world=transforms.translate([0, -1, 0]) @ transforms.scale(0.2),
                emission=lights.Area(radiance=2.0),
                motion=turn([0, 0, 1], 50),
            ),
        ),
        (lights.Point(intensity=3.0, motion=slide([-1, 1, -1], [1, 0.5, -1])),),
        {},
    ),
    "instances": (
        [
            shapes.Instance(
                group=GROUP,
                to_world=transforms.translate([x, y, 0]),
                motion=turn([0, 0, 1], 20) if x else None,
            )
            for x in (-1, 0, 1)
            for y in (-0.5, 0.5)
        ],
        (AMBIENT,),
        {},
    ),
    "camera": (
        (shapes.Sphere(radius=0.6, material=GREY),),
        (AMBIENT,),
        {
            "to_world": np.eye(4),
            "motion": Keys(
                [0.0, 1.0], [LOOK, transforms.look_at([1, 0.3, -5], [0, 0, 0], [0.1, 1, 0])]
            ),
        },
    ),
    "lens": (
        (shapes.Sphere(radius=0.4, material=GREY), FLAT),
        (),
        {
            "kind": cameras.Lens,
            "losses": True,
            "to_world": np.eye(4),
            "motion": Keys(
                [0.0, 1.0], [LOOK, transforms.look_at([0.4, 0.3, -5], [0, 0, 0], [0.1, 1, 0])]
            ),
        },
    ),
    "ghosts": (
        (),
        (
            lights.Point(
                position=(1.5, 0.3, -3), intensity=900.0, motion=slide([0, 0, 0], [0, 1, 0])
            ),
        ),
        {
            "kind": cameras.Lens,
            "ghosts": 0.5,
            "to_world": np.eye(4),
            "motion": Keys(
                [0.0, 1.0], [LOOK, transforms.look_at([0.4, 0.3, -5], [0, 0, 0], [0.1, 1, 0])]
            ),
        },
    ),
    "flame": (
        (
            shapes.Cube(to_world=transforms.translate([-0.3, 0, 0]), material=AIR, interior=FLAME),
            shapes.Sphere(
                center=(1.2, 0, 0),
                radius=0.15,
                emission=lights.Area(radiance=3.0),
                motion=slide([0, -1, 0], [0, 1, 0]),
            ),
        ),
        (),
        {},
    ),
    "deforming": ((BENT,), (AMBIENT, lights.Point(position=(1, 2, -3), intensity=10.0)), {}),
    "checked": ((CHECKED, shapes.Cube(to_world=transforms.scale(0.2))), (AMBIENT,), {}),
    "curves": ((HAIR,), (AMBIENT,), {}),
    "shared": (
        [
            shapes.Instance(
                group=SHARED,
                to_world=transforms.translate([x, 0, 0]) @ transforms.rotate([0, 1, 0], 40 * x),
                motion=turn([0, 0, 1], 20) if x > 0.5 else None,
            )
            for x in (-0.9, 0, 0.9)
        ],
        (AMBIENT,),
        {},
    ),
    "swelling": (
        (
            shapes.Sphere(
                radius=0.2, center=(0.2, 0, 0), emission=lights.Area(radiance=4.0), motion=SWELLS
            ),
            shapes.Cube(
                to_world=transforms.translate([-0.6, 0, 0]) @ transforms.scale(0.2),
                emission=lights.Area(radiance=4.0),
                motion=SWELLS,
            ),
        ),
        (),
        {},
    ),
    "beams": (
        (shapes.Cube(to_world=transforms.scale(0.5), material=GREY, motion=turn([0, 0.3, 1], 60)),),
        (
            BEAM,
            lights.Directional(direction=(0, 0, 1), irradiance=1.0, motion=turn([0, 1, 0], 40)),
        ),
        {},
    ),
    "glowing": ((GLOWS, DULL), (), {}),
    "glowing and turning": ((TURNS, DULL), (lights.Point(position=(2, 2, -3)),), {}),
    "glowing strands": ((STRIP,), (lights.Constant(radiance=0.8),), {}),
    "glowing and shared": (
        [
            shapes.Instance(
                group=shapes.Group((GLOWS, shapes.Cube(to_world=transforms.scale(0.1)), FLAT)),
                to_world=transforms.translate([x, 0, 0]) @ transforms.scale(0.6),
                motion=turn([0, 0, 1], 40) if x > 0 else None,
            )
            for x in (-0.7, 0.7)
        ],
        (),
        {},
    ),
    "zoom": (
        (shapes.Sphere(radius=0.6, material=GREY),),
        (AMBIENT, BEAM),
        {
            "to_world": np.eye(4),
            "motion": Keys([0.0, 1.0], [LOOK, LOOK @ transforms.scale([1.0, 1.3, 0.8])]),
        },
    ),
    "tilting lens": (
        (shapes.Sphere(radius=0.6, material=GREY),),
        (BEAM,),
        {
            "kind": cameras.ThinLens,
            "aperture_radius": 0.1,
            "focus_distance": 4.0,
            "to_world": LOOK,
            "motion": turn([0, 0, 1], 20),
        },
    ),
    "caustic": (
        (
            shapes.Sphere(
                radius=0.4,
                material=materials.Dielectric(int_ior=1.5),
                motion=slide([-0.8, 0, 0], [0.6, 0.4, 0]),
            ),
        ),
        (lights.Point(position=(1, 1, -4), intensity=30.0, motion=slide([0, 0, 0], [-1, 0, 0])),),
        {},
    ),
    "tangents": ((BRUSHED,), (AMBIENT, lights.Point(position=(1, 2, -3), intensity=10.0)), {}),
    "sky": (
        (shapes.Sphere(radius=0.6, material=GREY),),
        (
            lights.Envmap(
                image=np.random.default_rng(0).random((8, 16, 3)).astype(np.float32) ** 4,
                motion=turn([0, 1, 0], 120),
            ),
        ),
        {},
    ),
}


def blocks(picture: Any) -> np.ndarray:
    """Means of 8x8 pixels, of which neighbouring pictures are nearly independent."""
    values = np.asarray(picture)[..., :3].mean(axis=2)
    return values.reshape(4, 8, 4, 8).mean(axis=(1, 3)).ravel()


def assert_alike(a: Values, b: Values) -> None:
    """A z-test, at Z, of all blocks of two pictures (runs, blocks).

    Few runs tell little of one block, so that the error is one of all blocks: the same below the
    mean of the picture, above it in proportion to the block.
    """
    mean = b.mean(axis=0)
    scale = np.maximum(1.0, mean / mean.mean())
    variance = (a.var(axis=0, ddof=1) + b.var(axis=0, ddof=1)) / scale**2
    error = np.sqrt(variance.mean() / len(a)) * scale
    assert np.all(np.abs(a.mean(axis=0) - mean) < Z * error + 2e-3 * mean.mean())


def check_case(
    name: str,
    stills: int,
    spp: int,
    runs: int,
    integrator: integrators.Integrator = STEPS,
    **options: Any,
) -> None:
    """A z-test, at Z, of all blocks of a picture in motion and of the mean of still ones."""
    things, lamps, camera = CASES[name]
    things = [*things, WALL]
    whole = dataclasses.replace(
        scene(things, lamps, Shutter(0.0, 1.0), **camera), integrator=integrator
    )
    moving = [
        blocks(clpt.render(dataclasses.replace(whole, seed=i), spp, **options)) for i in range(runs)
    ]
    still = []
    for run in range(runs):
        frames = []
        offset = np.random.default_rng(run).random()  # so that no time is favoured
        for i in range(stills):
            at = (i + offset) / stills
            one = scene(things, lamps, Shutter(at, at), **camera)
            seed = 100 + run * stills + i
            seeded = dataclasses.replace(one, seed=seed, integrator=integrator)
            frames.append(blocks(clpt.render(seeded, max(spp // stills, 4), **options)))
        still.append(np.mean(frames, axis=0))
    assert_alike(np.array(moving), np.array(still))


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(CASES))
def test_a_picture_is_the_mean_of_still_ones(name: str) -> None:
    # Up to half of the flame's variance is in one block, whose pooled error is too low
    check_case(name, stills=64, spp=2048 if name == "flame" else 512, runs=4)


@pytest.mark.slow
def test_a_caustic_is_the_mean_of_still_ones() -> None:
    """Of a bulb that moves, by a ball of glass that does, which light paths alone find."""
    check_case("caustic", 64, 512, 4, integrators.Path(max_depth=5, light_paths=1))


TRANSPORTS = {
    "light paths": integrators.Path(max_depth=4, light_paths=1),
    "light paths alone": integrators.ParticleTracer(max_depth=4),
    "guide": integrators.Path(max_depth=4, guiding=True),
    "photons": integrators.Vcm(max_depth=4),
}


def check_transport(name: str, integrator: integrators.Integrator, spp: int, runs: int) -> None:
    """A z-test, at Z, against paths from the camera alone, of a shutter that opens slowly."""
    things, lamps, camera = CASES[name]
    whole = scene([*things, WALL], lamps, Shutter(0.0, 1.0, "triangle"), **camera)
    a, b = (
        np.array(
            [
                blocks(clpt.render(dataclasses.replace(whole, integrator=how, seed=seed + i), spp))
                for i in range(runs)
            ]
        )
        for seed, how in ((0, integrators.Path(max_depth=4, light_paths=0)), (100, integrator))
    )
    assert_alike(a, b)


@pytest.mark.slow
@pytest.mark.parametrize("how", TRANSPORTS)
@pytest.mark.parametrize(
    "name",
    [
        *("lamps", "swelling", "beams", "zoom", "tilting lens", "analytic", "instances", "sky"),
        *("glowing", "glowing and turning"),
    ],
)
def test_light_paths_find_the_same_light(name: str, how: str) -> None:
    check_transport(name, TRANSPORTS[how], spp=512, runs=6)


@pytest.mark.slow
def test_light_paths_meet_moving_lamps() -> None:
    check_transport("lamps", TRANSPORTS["light paths alone"], spp=64, runs=3)


def test_light_paths_aim_at_the_ways_of_what_is_sharp() -> None:
    things, lamps, camera = CASES["caustic"]
    whole = scene([*things, WALL], lamps, Shutter(0.0, 1.0), **camera)
    lowered = lower(
        dataclasses.replace(whole, integrator=integrators.Path(max_depth=5, light_paths=1))
    )
    first, number = (int(lowered.settings[n]) for n in ("aims", "aim_count"))
    aims = lowered.tables["distributions"][first : first + 5 * number].reshape(-1, 5)
    way = np.array([[-0.8, 0, 0], [0.6, 0.4, 0]])
    away = np.linalg.norm(way[:, None] - aims[:, :3], axis=2)
    assert (away + 0.4 < aims[:, 3]).any(axis=1).all()


@pytest.mark.slow
@pytest.mark.parametrize("layout", ["binary", "wide8", "compact", "brute"])
@pytest.mark.parametrize("name", ["instances", "analytic", "lamps", "checked", "shared"])
def test_every_layout_holds_motion(name: str, layout: str) -> None:
    things, lamps, camera = CASES[name]
    whole = scene([*things, WALL], lamps, Shutter(0.0, 1.0), **camera)
    if layout == "brute" and name != "analytic":
        with pytest.raises(SceneError, match="holds no instances"):
            clpt.render(whole, 1, layout=layout)
        return
    expected, found = (np.asarray(clpt.render(whole, 64, layout=x)) for x in (None, layout))
    assert np.abs(blocks(found) - blocks(expected)).max() < 2e-3


def test_coverage_of_a_moving_sphere() -> None:
    """Parallel rays; a sphere that crosses the film from side to side covers a pixel on its way for
    its chord's share of the time; by the shutter's shape for the share of its density."""
    radius = 0.25
    ball = shapes.Sphere(
        radius=radius,
        emission=lights.Area(radiance=1.0),
        motion=slide([-2, 0, 0], [2, 0, 0]),
    )
    for shape in ("box", "triangle"):
        moving = scene([ball], [], Shutter(0.0, 1.0, shape))
        camera = cameras.Orthographic(
            to_world=transforms.translate([0, 0, -3]), shutter=moving.camera.shutter
        )
        picture = np.asarray(clpt.render(dataclasses.replace(moving, camera=camera), 1024))
        x = 1.0 - (np.arange(32) + 0.5) / 16.0  # +x is on the left
        half = np.sqrt(np.maximum(radius**2 - x[:, None] ** 2, 0.0)) / 4.0  # of the time
        middle = (x[None] + 2.0) / 4.0

        def share(t: Any, shape: str = shape) -> Any:
            return t if shape == "box" else np.where(t < 0.5, 2 * t * t, 1 - 2 * (1 - t) ** 2)

        expected = share(middle + half) - share(middle - half)
        inside = np.abs(x) < radius - 1.0 / 16.0
        found = picture[..., :3].mean(axis=2)
        assert np.abs(found - expected)[inside].max() < 0.02  # edges of pixels, and noise
        assert abs(found[inside].mean() / expected[inside].mean() - 1.0) < 0.01
        assert not found[np.abs(x) > radius + 1.0 / 16.0].any()


def test_a_shutter_without_length_is_still() -> None:
    """The same bits as the scene put where it is then, and no word of motion in the kernels."""
    keys = turn([0, 0, 1], 60)
    cube = shapes.Cube(to_world=transforms.scale(0.5), material=GREY)
    still = dataclasses.replace(cube, to_world=keys.at(0.3) @ cube.to_world)
    moved = dataclasses.replace(cube, motion=keys)
    a = clpt.render(scene([moved], [AMBIENT], Shutter(0.3, 0.3)), 4)
    b = clpt.render(scene([still], [AMBIENT], None), 4)
    assert np.array_equal(np.asarray(a), np.asarray(b))
    assert not lower(scene([moved], [AMBIENT], Shutter(0.3, 0.3))).features.motion.parts
    assert not lower(
        scene([moved], [AMBIENT], Shutter(2.0, 3.0))
    ).features.motion.parts  # after its keys
    assert lower(scene([moved], [AMBIENT], Shutter(0.3, 0.4))).features.motion.parts == (
        "instances",
    )
    _, _, zoom = CASES["zoom"]  # what scales a pinhole stays a key
    assert lower(scene([cube], [AMBIENT], Shutter(0.3, 0.3), **zoom)).features.motion.parts == (
        "camera",
    )


@pytest.mark.slow
def test_a_pinhole_that_is_scaled_at_rest() -> None:
    """Squeezed by keys across its axis it has a smaller view, which `to_world` may not say."""
    share = np.tan(np.radians(10.0)) / np.tan(np.radians(20.0))
    once = LOOK @ transforms.scale([share, share, 1.0])
    twice = LOOK @ transforms.scale([share**2, share**2, 1.0])
    at = 1.0 / (1.0 + share)  # where a scale that changes linearly from 1 to its square has come
    given: list[tuple[dict[str, Any], Shutter | None]] = [
        ({"fov": 20.0}, None),
        ({"to_world": np.eye(4), "motion": Keys([0.0], [once])}, None),
        ({"to_world": np.eye(4), "motion": Keys([0.0, 1.0], [LOOK, twice])}, Shutter(at, at)),
    ]
    things = [shapes.Sphere(radius=0.6, material=GREY), WALL]
    wholes = [scene(things, [AMBIENT], shutter, **camera) for camera, shutter in given]
    expected, *found = (blocks(clpt.render(whole, 16)) for whole in wholes)
    assert all(np.abs(one - expected).max() < 2e-3 for one in found)
    with pytest.raises(SceneError, match="must not scale"):
        lower(scene(things, [AMBIENT], None, to_world=once))


def test_boxes_hold_what_moves() -> None:
    """All points at times in float64, in boxes that are not much larger."""
    rng = np.random.default_rng(1)
    for _ in range(6):
        made = [
            transforms.translate(rng.normal(size=3) * 3)
            @ transforms.rotate(rng.normal(size=3), rng.uniform(0, 179))
            @ transforms.scale(rng.uniform(0.3, 2.0, 3))
            for _ in range(3)
        ]
        keys = Keys([0.0, 0.4, 1.0], made)
        points = rng.normal(size=(30, 3))
        low, high = motion.swept(keys, points[None], Shutter(0.1, 0.9))[0]
        way = np.array(
            [transforms.transform_points(keys.at(t), points) for t in np.linspace(0.1, 0.9, 201)]
        )
        assert (way >= low).all() and (way <= high).all()
        size = np.ptp(way.reshape(-1, 3), axis=0)
        assert (high - low < 1.05 * size + 0.05).all()


def test_a_matrix_is_taken_apart() -> None:
    rng = np.random.default_rng(2)
    for mirrored in (1.0, -1.0):
        matrix = np.eye(4)
        matrix[:3] = rng.normal(size=(3, 4))
        matrix[:3, :3] *= np.sign(np.linalg.det(matrix[:3, :3])) * mirrored
        t, q, s = decomposed(matrix)
        assert np.allclose(rotation(q) @ s, matrix[:3, :3], atol=1e-12)
        assert np.allclose(s, s.T) and np.allclose(t, matrix[:3, 3])
        assert np.allclose(Keys([1.0, 2.0], [np.eye(4) * 1.0, np.eye(4)]).at(1.5), np.eye(4))


@pytest.mark.parametrize(
    ("times", "matrices", "message"),
    [
        ([], np.zeros((0, 4, 4)), "at least one key"),
        ([0.0, 1.0], [np.eye(4)], "a 4x4 matrix for each time"),
        ([1.0, 0.5], [np.eye(4)] * 2, r"times\[1\].*later"),
        ([0.0, float("nan")], [np.eye(4)] * 2, r"times\[1\]"),
        ([0.0], [np.diag([1.0, 1.0, 0.0, 1.0])], "singular"),
        ([0.0, 1.0], [np.eye(4), np.diag([-1.0, 1.0, 1.0, 1.0])], "mirrors"),
        (["x"], [np.eye(4)], "not numbers"),
    ],
)
def test_keys_that_make_no_sense(times: Any, matrices: Any, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        Keys(times, matrices)


def test_what_cannot_move_is_refused() -> None:
    keys, shutter = STRETCHED, Shutter(0.0, 1.0)
    with pytest.raises(SceneError, match="before it opens"):
        Shutter(1.0, 0.5)
    for shape in ("round", [0.0, 0.0], [1.0], [1.0, -1.0]):
        with pytest.raises(SceneError, match=r"shutter\.shape"):
            Shutter(shape=shape)
    lamp = lights.Point(motion=keys)
    with pytest.raises(SceneError, match=r"lights\[0\]\.motion.*not scaled"):
        lower(scene([WALL], [lamp], shutter))
    shining = shapes.Sphere(emission=lights.Area(), motion=keys)
    with pytest.raises(SceneError, match="not stretched"):
        lower(scene([shining], [], shutter))
    group = shapes.Group(shapes=(shapes.Cube(motion=keys),))
    with pytest.raises(SceneError, match="to its instance"):
        lower(scene([shapes.Instance(group=group)], [AMBIENT], shutter))
    things, lamps, camera = CASES["flame"]
    tracer = dataclasses.replace(
        scene(things, lamps, shutter, **camera), integrator=integrators.ParticleTracer()
    )
    with pytest.raises(SceneError, match="which gives out light"):
        lower(tracer)


def test_what_is_left_aside_is_told() -> None:
    things, lamps, camera = CASES["flame"]
    whole = scene([*things, WALL], lamps, Shutter(0.0, 1.0), **camera)
    told = {
        "path.light_paths: left aside, as no path starts": integrators.Path(light_paths=1),
        "vcm.merging: left aside, as no path starts": integrators.Vcm(),
    }
    for line, integrator in told.items():
        lowered = lower(dataclasses.replace(whole, integrator=integrator))
        assert sum(w.startswith(line) for w in lowered.warnings) == 1, lowered.warnings
        assert (
            not lowered.features.passes[0].transport.light_paths
            and not lowered.features.transport.merged
        )
    cube = dataclasses.replace(things[0], motion=turn([0, 1, 0], 10))
    assert any(
        "the grid of its medium stays" in w
        for w in lower(scene([cube], [AMBIENT], Shutter())).warnings
    )


def test_scene_file(tmp_path: Path) -> None:
    file = tmp_path / "scene.json"
    whole = scene(
        [dataclasses.replace(WALL, motion=STRETCHED)], [AMBIENT], Shutter(0.1, 0.2, [1, 2])
    )
    clpt.save(whole, file)
    again = clpt.load(file)
    assert again.shapes[0].motion.times == (0.0, 1.0)
    assert np.allclose(again.shapes[0].motion.transforms, STRETCHED.transforms)
    assert again.camera.shutter.close == 0.2
    text = json.loads(file.read_text("utf-8"))
    text["shapes"][0]["motion"][1]["time"] = -1.0
    file.write_text(json.dumps(text, indent=1), "utf-8")
    with pytest.raises(SceneError, match=r"scene\.json:\d+.*later than 0 s"):
        clpt.load(file)


def test_pbrt(tmp_path: Path) -> None:
    file = tmp_path / "scene.pbrt"
    text = """TransformTimes 0.5 2
ActiveTransform EndTime
Translate 1 0 0
ActiveTransform All
LookAt 0 0 -5  0 0 0  0 1 0
Camera "perspective" "float shutteropen" .5 "float shutterclose" 1.5
WorldBegin
AttributeBegin
ActiveTransform EndTime
Rotate 90 0 0 1
ActiveTransform All
Translate 0 2 0
Shape "sphere"
AttributeEnd
Shape "sphere"
"""
    file.write_text(text, "utf-8")
    read = clpt.load(file)
    moving, still = read.shapes
    assert still.motion is None and moving.motion.times == (0.5, 2.0)
    ends = [moving.motion.at(t) @ moving.to_world @ [0, 0, 0, 1] for t in (0.5, 2.0)]
    assert np.allclose(ends, [[0, 2, 0, 1], [-2, 0, 0, 1]], atol=1e-6)
    assert (read.camera.shutter.open, read.camera.shutter.close) == (0.5, 1.5)
    own = read.camera.motion.at(2.0) @ read.camera.to_world
    assert np.allclose(own[:3, 3], [-1, 0, -5], atol=1e-6)
    file.write_text(text.replace("0.5 2\n", "2 0.5\n"), "utf-8")
    with pytest.raises(SceneError, match=r"scene\.pbrt:1.*must be after"):
        clpt.load(file)


def test_mitsuba(tmp_path: Path) -> None:
    file = tmp_path / "scene.xml"
    text = """<scene version="3.0.0">
<sensor type="perspective"><float name="shutter_open" value=".5"/>
<float name="shutter_close" value="1"/></sensor>
<shape type="sphere"><animation name="to_world">
<transform time="0"><translate x="1"/></transform>
<transform time="1"><rotate z="1" angle="90"/><translate x="2"/></transform>
</animation></shape>
</scene>
"""
    file.write_text(text, "utf-8")
    read = clpt.load(file)
    keys = read.shapes[0].motion
    assert np.allclose(keys.at(0.5)[:3, 3], [1.5, 0, 0]) and keys.times == (0.0, 1.0)
    assert np.allclose(keys.at(0.5)[:2, 0], np.sqrt(0.5))
    assert (read.camera.shutter.open, read.camera.shutter.close) == (0.5, 1.0)
    file.write_text(text.replace('time="1"', 'time="-1"'), "utf-8")
    with pytest.raises(SceneError, match=r"scene\.xml:6.*later than 0 s"):
        clpt.load(file)
