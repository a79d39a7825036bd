"""Normal and bump maps: on flat squares by a formula, on pictures beside Mitsuba."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import clpt
from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Film, Scene, integrators
from clpt.scene import materials as m
from clpt.scene.cameras import Orthographic
from clpt.scene.lights import Directional
from clpt.scene.shapes import Group, Instance, Mesh, Rectangle
from clpt.scene.textures import Bitmap
from tests.pictures.support import SIGNIFICANCE, agreement

UP = np.array([0.0, 1.0, 0.0])
LIGHT = np.array([0.5, 0.3, 0.8]) / np.linalg.norm([0.5, 0.3, 0.8])  # toward it
WHITE = m.Diffuse(reflectance=(1.0, 1.0, 1.0))


def tilted(x: float, y: float, **more: object) -> m.NormalMap:
    """A normal map that is the same everywhere; x and y of a unit normal."""
    n = np.array([x, y, np.sqrt(1.0 - x * x - y * y)])
    image = np.tile(np.float32(n / 2 + 0.5), (2, 2, 1))
    return m.NormalMap(material=WHITE, map=Bitmap(image=image, raw=True), **more)


def ramp(du: float, dv: float) -> m.BumpMap:
    """A height that rises by du and dv over the unit square of uv, between two texels."""
    v, u = np.mgrid[0:2, 0:2] - 0.5
    image = np.float32(du * u - dv * v)  # row 0 is the upper one
    inner = np.array([[0.5, 0, 0.25], [0, 0.5, 0.25], [0, 0, 1]])
    return m.BumpMap(material=WHITE, height=Bitmap(image=image, raw=True, to_uv=inner))


def expected(n: np.ndarray, shadowed: bool = True) -> float:
    """Radiance of white under light of irradiance pi: cos, times the softened edge's share."""
    n = n / np.linalg.norm(n)
    if n @ LIGHT <= 0.0:
        return 0.0
    alpha2 = min(0.125 * (1.0 / n[2] ** 2 - 1.0), 1.0)
    share = 2.0 / (1.0 + np.sqrt(1.0 + alpha2 * (1.0 / LIGHT[2] ** 2 - 1.0)))
    return float(n @ LIGHT * (share if shadowed else 1.0))


def normal(x: float, y: float) -> np.ndarray:
    return np.array([x, y, np.sqrt(1.0 - x * x - y * y)])


TURNED = tf.rotate([0, 1, 0], 180)  # the back is seen; u runs to the left then
BOTH = m.TwoSided(front=WHITE)
CASES = [  # material, placement, the normal that is shaded with, whether the edge is softened
    (WHITE, np.eye(4), normal(0, 0), False),
    (tilted(0, 0), np.eye(4), normal(0, 0), True),
    (tilted(0.4, 0), np.eye(4), normal(0.4, 0), True),
    (tilted(0, 0.4), np.eye(4), normal(0, 0.4), True),
    (tilted(-0.3, 0.6, shadowing=False), np.eye(4), normal(-0.3, 0.6), False),
    (tilted(0.3, 0.2, scale=2.0), np.eye(4), np.array([0.6, 0.4, normal(0.3, 0.2)[2]]), True),
    (m.TwoSided(front=tilted(0.3, 0.2)), TURNED, normal(-0.3, 0.2), True),
    (dataclasses.replace(tilted(0.3, 0.2), material=BOTH), TURNED, normal(0.3, -0.2), True),
    (ramp(0.6, 0.0), np.eye(4), np.array([-0.3, 0.0, 1.0]), True),
    (ramp(0.0, 0.6), np.eye(4), np.array([0.0, -0.3, 1.0]), True),
    (m.TwoSided(front=ramp(0.6, 0.4)), TURNED, np.array([0.3, -0.2, 1.0]), True),
    (dataclasses.replace(ramp(0.6, 0.4), material=BOTH), TURNED, np.array([-0.3, 0.2, 1.0]), True),
]


def test_flat_squares() -> None:
    """Every case against its formula, exactly: nothing here is random."""
    squares: list = [
        Rectangle(material=material, to_world=tf.translate([2.0 * i + 1.0, 0.0, 0.0]) @ placed)
        for i, (material, placed, _, _) in enumerate(CASES)
    ]
    count = len(CASES) + 2
    corners = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], np.float32)
    for along_v in (False, True):  # uv that are mirrored: v runs downward
        i = len(squares)
        mesh = Mesh(
            vertices=corners,
            faces=np.array([(0, 1, 2), (0, 2, 3)], np.uint32),
            uvs=np.array([(0, 1), (1, 1), (1, 0), (0, 0)], np.float32),
            material=tilted(0.2, 0.5, along_v=along_v),
            to_world=tf.translate([2.0 * i + 1.0, 0.0, 0.0]),
        )
        squares.append(mesh)
    view = tf.look_at([count, 0, 4], [count, 0, 0], UP) @ tf.scale([count, 1.0, 1.0])
    scene = Scene(
        camera=Orthographic(to_world=view),
        shapes=squares,
        lights=[Directional(direction=tuple(-LIGHT), irradiance=(np.pi,) * 3)],
        integrator=integrators.Direct(),
        film=Film(width=count, height=1, mode="rgb"),
    )
    picture = clpt.render(scene, 16)[0, :, 0]
    wanted = [expected(n, shadowed) for _, _, n, shadowed in CASES]
    wanted += [expected(normal(0.2, 0.5)), expected(normal(0.2, -0.5))]
    np.testing.assert_allclose(picture, wanted, rtol=3e-3)


def test_tangents_as_given() -> None:
    """The frame is that of the mesh's tangents, whatever its uvs, also in mirrors and instances."""
    corners = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], np.float32)
    lean, turn = (0.2, 0.5), tf.rotate([0, 0, 1], 30)

    def square(angle: float, side: float, **more: object) -> Mesh:
        c, s = np.cos(angle), np.sin(angle)
        given: dict = {
            "vertices": corners,
            "faces": np.array([(0, 1, 2), (0, 2, 3)], np.uint32),
            "normals": np.tile(np.float32([0, 0, 1]), (4, 1)),
            "uvs": np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float32),
            "tangents": np.tile(np.float32([c, s, 0, side]), (4, 1)),
            "material": tilted(*lean, along_v=True),
        }
        return Mesh(**{**given, **more})

    def shaded(angle: float, side: float) -> np.ndarray:
        c, s = np.cos(angle), np.sin(angle)
        x, y = lean[0], side * lean[1]
        return np.array([c * x - s * y, s * x + c * y, normal(*lean)[2]])

    mirror = np.diag([-1.0, 1.0, 1.0, 1.0])
    turned = np.radians(30)
    flip = np.array([-1.0, 1.0, 1.0])
    group = Group((square(1.0, 1.0),), "tangents")
    cases = [  # shape, placement, the normal that is shaded with
        (square(0.0, 1.0, tangents=None), np.eye(4), shaded(0.0, 1.0)),
        (square(0.0, 1.0), np.eye(4), shaded(0.0, 1.0)),
        (square(1.0, 1.0), np.eye(4), shaded(1.0, 1.0)),
        (square(1.0, -1.0), np.eye(4), shaded(1.0, -1.0)),
        (square(1.0, 1.0), turn, shaded(1.0 + turned, 1.0)),
        (square(1.0, 1.0), mirror, flip * shaded(1.0, 1.0)),
        (square(1.0, -1.0, uvs=None), np.eye(4), shaded(1.0, -1.0)),
        (Instance(group=group), turn, shaded(1.0 + turned, 1.0)),
        (Instance(group=group), mirror, flip * shaded(1.0, 1.0)),
    ]
    count = len(cases)
    view = tf.look_at([count, 0, 4], [count, 0, 0], UP) @ tf.scale([count, 1.0, 1.0])
    placed = [tf.translate([2.0 * i + 1.0, 0.0, 0.0]) @ m for i, (_, m, _) in enumerate(cases)]
    scene = Scene(
        camera=Orthographic(to_world=view),
        shapes=[
            dataclasses.replace(shape, to_world=own)
            for (shape, _, _), own in zip(cases, placed, strict=True)
        ],
        lights=[Directional(direction=tuple(-LIGHT), irradiance=(np.pi,) * 3)],
        integrator=integrators.Direct(),
        film=Film(width=3 * count, height=3, mode="rgb"),
    )
    picture = clpt.render(scene, 16)[1, 1::3, 0]
    np.testing.assert_allclose(picture, [expected(n) for _, _, n in cases], rtol=3e-3)
    with pytest.raises(SceneError, match="tangents need normals"):
        lower(Scene(camera=Orthographic(), shapes=[square(0.0, 1.0, normals=None)]))


def test_coat_with_normals_of_its_own() -> None:
    """A coat that says the normals of the map around it is the coat without any of its own."""
    corners = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], np.float32)
    n = normal(0.1, 0.3)
    plain = {"clearcoat": 1.0, "clearcoat_roughness": 0.7, "base_color": (0.5, 0.5, 0.5)}
    own = {f"clearcoat_normal_{x}": v / 2 + 0.5 for x, v in zip("xyz", n, strict=True)}
    squares = []
    for v in (1.0, -1.0):  # of uvs that are mirrored, too
        for more in ({}, {**own, "clearcoat_apart": 1.0}, {"clearcoat_apart": 1.0}):
            surface = m.GltfSurface(**plain, **more)
            squares.append(
                Mesh(
                    vertices=corners,
                    faces=np.array([(0, 1, 2), (0, 2, 3)], np.uint32),
                    uvs=np.array([(0, 0), (1, 0), (1, v), (0, v)], np.float32),
                    material=dataclasses.replace(tilted(0.1, 0.3, along_v=True), material=surface),
                    to_world=tf.translate([2.0 * len(squares) + 1.0, 0.0, 0.0]),
                )
            )
    count = len(squares)
    view = tf.look_at([count, 0, 4], [count, 0, 0], UP) @ tf.scale([count, 1.0, 1.0])
    scene = Scene(
        camera=Orthographic(to_world=view),
        shapes=squares,
        lights=[Directional(direction=tuple(-LIGHT), irradiance=(np.pi,) * 3)],
        integrator=integrators.Direct(),
        film=Film(width=3 * count, height=3, mode="rgb"),
    )
    picture = clpt.render(scene, 16)[1, 1::3, 0]
    np.testing.assert_allclose(picture[[1, 4]], picture[[0, 3]], rtol=1e-3)
    assert abs(picture[2] - picture[0]) > 0.01 * picture[0]


def test_two_maps_of_a_kind_are_refused() -> None:
    twice = dataclasses.replace(tilted(0.1, 0.1), material=tilted(0.2, 0.1))
    with pytest.raises(SceneError, match="normal_map inside of a normal_map"):
        lower(Scene(camera=Orthographic(), shapes=[Rectangle(material=twice)]))


SCENE = """<scene version="3.0.0">
<integrator type="path"><integer name="max_depth" value="3"/></integrator>
<sensor type="perspective">
  <float name="fov" value="45"/>
  <transform name="to_world"><lookat origin="0,-4,3" target="0,0,0.3" up="0,0,1"/></transform>
  <film type="hdrfilm"><integer name="width" value="48"/><integer name="height" value="32"/>
    <rfilter type="box"/></film>
  <sampler type="independent"/>
</sensor>
<bsdf type="normalmap" id="normals">
  <texture name="normalmap" type="bitmap"><string name="filename" value="n.png"/>
    <boolean name="raw" value="true"/></texture>
  <bsdf type="twosided"><bsdf type="roughconductor"><float name="alpha" value="0.3"/></bsdf></bsdf>
</bsdf>
<bsdf type="twosided" id="heights"><bsdf type="bumpmap">
  <texture type="bitmap"><string name="filename" value="h.png"/>
    <boolean name="raw" value="true"/></texture>
  <float name="scale" value="0.4"/>
  <bsdf type="diffuse"/>
</bsdf></bsdf>
<shape type="rectangle">
  <transform name="to_world"><scale value="2"/></transform><ref id="heights"/></shape>
<shape type="rectangle"><transform name="to_world"><scale value=".6"/>
  <rotate x="1" angle="80"/><translate x="-1.2" z=".7"/></transform><ref id="normals"/></shape>
<shape type="rectangle"><transform name="to_world"><scale value=".6"/>
  <rotate x="1" angle="-100"/><translate x="-1.2" y="1" z=".7"/></transform>
  <ref id="normals"/></shape>
<shape type="sphere"><point name="center" x=".9" y="0" z=".7"/><float name="radius" value=".6"/>
  <ref id="normals"/></shape>
<emitter type="constant"><rgb name="radiance" value=".3"/></emitter>
<emitter type="directional"><vector name="direction" x=".7" y=".4" z="-1"/>
  <rgb name="irradiance" value="2,1.6,1"/></emitter>
</scene>"""


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
def test_beside_mitsuba(mode: str, tmp_path: Path) -> None:
    """A wavy floor, two mirrors seen from front and back, a ball: means of blocks agree."""
    mi = pytest.importorskip("mitsuba")
    y, x = np.mgrid[0:64, 0:64] / 64
    h = 0.5 + 0.25 * np.sin(6 * np.pi * x) * np.cos(4 * np.pi * y) + 0.2 * np.sin(2 * np.pi * x)
    gy, gx = np.gradient(h, 1 / 64)
    n = np.stack([-0.3 * gx, 0.2 * gy, np.ones_like(gx)], -1)
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    Image.fromarray(np.uint8(255 * (n / 2 + 0.5))).save(tmp_path / "n.png")
    Image.fromarray(np.uint8(255 * h)).save(tmp_path / "h.png")
    path = tmp_path / "scene.xml"
    path.write_text(SCENE)
    mi.set_variant(f"scalar_{mode}")
    reference = mi.load_file(str(path))
    theirs = [np.array(mi.render(reference, spp=32, seed=s))[..., :3] for s in range(8)]
    scene = clpt.load(path)
    scene = dataclasses.replace(scene, film=dataclasses.replace(scene.film, mode=mode))
    ours = [clpt.render(dataclasses.replace(scene, seed=s), 32) for s in range(8)]

    def blocks(images: list) -> np.ndarray:
        return np.array(images, np.float64).reshape(8, 4, 8, 6, 8, 3).mean(axis=(2, 4))

    assert agreement(blocks(ours), blocks(theirs), 2e-3) > SIGNIFICANCE
