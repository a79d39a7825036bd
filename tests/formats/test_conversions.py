"""Scenes of each format as each other: the same triangles, and pictures of the same brightness."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from scipy import stats

import clpt
from clpt import transforms
from clpt.cli import cli
from clpt.formats import as_gltf, as_openpbr
from clpt.geometry import triangles
from clpt.scene import Film, Scene
from clpt.scene.cameras import Orthographic
from clpt.scene.integrators import Box
from clpt.scene.integrators import Path as Paths
from clpt.scene.lights import Constant
from clpt.scene.materials import Plastic, RoughPlastic
from clpt.scene.shapes import Sphere

SOURCES = {
    "a.xml": '<scene version="3.0.0"><shape type="cube"/></scene>',
    "a.pbrt": 'WorldBegin\nShape "trianglemesh" "point3 P" [0 0 0 1 0 0 0 1 0]\n'
    '"integer indices" [0 1 2]\n',
    "a.obj": "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    "a.usda": '#usda 1.0\ndef Cube "c" {}\n',
    "a.json": '{"camera": {"type": "perspective"}, "shapes": [{"type": "cube"}]}',
}


@pytest.mark.parametrize("name", SOURCES)
def test_formats_are_converted(name: str, tmp_path: Path) -> None:
    """Scenes of five formats to each that is written, and again, with the same triangles."""
    if name.endswith(".usda"):
        pytest.importorskip("pxr")
    (tmp_path / name).write_text(SOURCES[name])

    def corners(file: Path) -> np.ndarray[Any, Any]:
        parts = [
            triangles.triangulate(s)[:2] for s in clpt.load(file).shapes if s.name != "backdrop"
        ]
        rows = np.concatenate([v[f].reshape(-1, 3) for v, f in parts])
        return np.asarray(rows[np.lexsort(rows.round(4).T)])

    wanted = corners(tmp_path / name)
    targets = ["b.glb", "b.gltf", "b.json"]
    try:
        import pxr  # noqa: F401

        targets += ["b.usdc", "b.usdz"]
    except ImportError:
        pass
    for target in targets:
        told = CliRunner().invoke(cli, ["convert", str(tmp_path / name), str(tmp_path / target)])
        assert told.exit_code == 0, told.output
        assert np.allclose(corners(tmp_path / target), wanted, atol=1e-4), target


ROOM = {
    "a.xml": """<scene version="3.0.0">
        <sensor type="perspective"><float name="fov" value="40"/><transform name="to_world">
            <lookat origin="0, 2, 6" target="0, 0, 0" up="0, 1, 0"/></transform></sensor>
        <shape type="rectangle"><transform name="to_world"><scale value="3"/>
            <rotate x="1" angle="-90"/></transform><bsdf type="diffuse">
            <rgb name="reflectance" value="0.2, 0.5, 0.8"/></bsdf></shape>
        <shape type="cube"><transform name="to_world"><rotate y="1" angle="30"/>
            <translate y="1"/></transform><bsdf type="twosided"><bsdf type="roughconductor">
            <string name="distribution" value="ggx"/>
            <string name="material" value="Au"/><float name="alpha" value="0.3"/></bsdf></bsdf>
            </shape>
        <shape type="rectangle"><transform name="to_world"><rotate x="1" angle="90"/>
            <translate y="4"/></transform><emitter type="area">
            <rgb name="radiance" value="9, 7, 5"/></emitter></shape></scene>""",
    "a.pbrt": """LookAt 0 2 6 0 0 0 0 1 0
        Camera "perspective" "float fov" 40
        WorldBegin
        AttributeBegin
        AreaLightSource "diffuse" "rgb L" [9 7 5] "bool twosided" true
        Shape "trianglemesh" "point3 P" [-1 4 -1 1 4 -1 1 4 1 -1 4 1]
            "integer indices" [0 1 2 0 2 3]
        AttributeEnd
        Material "diffuse" "rgb reflectance" [0.2 0.5 0.8]
        Shape "trianglemesh" "point3 P" [-3 0 -3 3 0 -3 3 0 3 -3 0 3]
            "integer indices" [0 2 1 0 3 2]
        Material "coateddiffuse" "rgb reflectance" [0.8 0.4 0.1] "float roughness" 0
        Translate 0 1 0
        Shape "sphere"
        """,
    "a.usda": """#usda 1.0
        (
            metersPerUnit = 1
        )
        def Camera "V" {
            float horizontalAperture = 20
            float verticalAperture = 20
            float focalLength = 27
            double3 xformOp:translate = (0, 2, 6)
            float xformOp:rotateX = -18
            uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateX"]
        }
        def Cube "C" {
            color3f[] primvars:displayColor = [(0.2, 0.5, 0.8)]
        }
        def RectLight "L" {
            float inputs:intensity = 9
            float inputs:width = 2
            float inputs:height = 2
            double3 xformOp:translate = (0, 4, 0)
            float xformOp:rotateX = -90
            uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateX"]
        }
        """,
}
RUNS, SAMPLES = 10, 48
CHAINS = [
    ("a.xml", "b.usda", "b.json"), ("a.xml", "b.glb"), ("a.pbrt", "b.usdz"), ("a.pbrt", "b.glb"),
    ("a.usda", "b.json", "b.usdc"), ("cornell_box", "b.usda", "b.json"), ("cornell_box", "b.glb"),
]  # fmt: skip
SIDE = 16  # pixels of a ball
SIGNIFICANCE = 1e-3 / (3 * len(CHAINS))  # of all colors of all chains together: 1 in 1,000
MODEL = 0.02  # relative: plastics are approximated; a sphere has facets in some formats


@pytest.mark.parametrize("target", ["b.json", "b.glb", "b.usda"])
def test_the_camera_of_pbrt_keeps_its_up(target: str, tmp_path: Path) -> None:
    """It mirrors its picture, which glTF and USD cannot: they tell it, and up stays up."""
    if target == "b.usda":
        pytest.importorskip("pxr")
    (tmp_path / "a.pbrt").write_text(ROOM["a.pbrt"])
    before = clpt.load(tmp_path / "a.pbrt")
    lost = clpt.save(before, tmp_path / target)
    after = clpt.load(tmp_path / target).camera.to_world
    assert ("that the picture is mirrored, left for right" in lost) == (target != "b.json")
    side = 1.0 if target == "b.json" else -1.0
    assert np.allclose(after, np.asarray(before.camera.to_world) * [side, 1.0, 1.0, 1.0], atol=1e-6)


def _means(scene: Scene, first_seed: int) -> np.ndarray[Any, Any]:
    """Means of the picture's colors of independent runs, (runs, 3)."""
    scene.film = dataclasses.replace(scene.film, mode="rgb")
    scene.integrator, runs = Paths(max_depth=8), []
    for scene.seed in range(first_seed, first_seed + RUNS):
        runs.append(clpt.render(scene, spp=SAMPLES)[..., :3].mean(axis=(0, 1)))
    return np.array(runs)


PLASTICS = [
    Plastic(diffuse_reflectance=(0.9, 0.4, 0.05), nonlinear=True),
    *(
        RoughPlastic(
            diffuse_reflectance=(0.9, 0.4, 0.05),
            alpha=roughness**2,
            distribution=name,
            nonlinear=saturates,
        )
        for roughness in (0.3, 0.6)
        for name in ("ggx", "beckmann")
        for saturates in (False, True)
    ),
]


def test_plastics_keep_their_albedo() -> None:
    """Balls in even light, with parallel rays, are as bright as their material's mean albedo.

    They stand far from each other. Facets of GGX reflect up to .008 less than Beckmann's, and
    Schlick's formula of glTF .006 less than Fresnel's.
    """
    lost: list[str] = []
    rows = [
        (material, as_openpbr.surface(material, lost.append).base, as_gltf.surface(
            material, lost.append)[0])
        for material in PLASTICS
    ]  # fmt: skip
    balls = [
        Sphere(
            center=(2.0 * x - 2.0, 2.0 * y + 1.0 - len(rows), 40.0 * (3 * y + x)), material=material
        )
        for y, row in enumerate(reversed(rows))
        for x, material in enumerate(row)
    ]
    view = transforms.look_at([0, 0, 2000], [0, 0, 0], [0, 1, 0])
    scene = Scene(
        camera=Orthographic(to_world=view @ transforms.scale([3.0, 3.0, 1.0])),
        shapes=balls,
        lights=[Constant(radiance=1.0)],
        film=Film(width=3 * SIDE, height=len(rows) * SIDE, filter=Box(), mode="rgb"),
        integrator=Paths(max_depth=3),
    )
    picture = clpt.render(scene, spp=128)[..., :3]
    parts = picture.reshape(len(rows), SIDE, 3, SIDE, 3).mean(axis=(1, 3))
    albedo = 1.0 - (1.0 - parts) * 4.0 / np.pi  # what a ball leaves of its square is white
    before, openpbr, gltf = albedo.swapaxes(0, 1)
    gaussian = [isinstance(m, RoughPlastic) and m.distribution == "beckmann" for m in PLASTICS]
    allowed = 0.02 * before + np.where(gaussian, 0.008, 0.002)[:, None]
    assert (np.abs(openpbr - before) < allowed).all(), (openpbr - before).round(3)
    assert (np.abs(gltf - before) < allowed + 0.006).all(), (gltf - before).round(3)


@pytest.mark.slow
@pytest.mark.parametrize("chain", CHAINS, ids="-".join)
def test_pictures_keep_their_brightness(chain: tuple[str, ...], tmp_path: Path) -> None:
    """Means of each color differ by at most MODEL at the significance, over a whole chain."""
    if any(".usd" in name for name in chain):
        pytest.importorskip("pxr")
    source = tmp_path / chain[0]
    if chain[0] in ROOM:
        source.write_text(ROOM[chain[0]])
    before = clpt.load(source if chain[0] in ROOM else f"scenes/{chain[0]}")
    before.film = dataclasses.replace(before.film, width=24, height=24)
    after = before
    for name in chain[1:]:
        clpt.save(after, tmp_path / name)
        after = clpt.load(tmp_path / name)
    after.film = dataclasses.replace(after.film, width=24, height=24)
    first, second = _means(before, 1), _means(after, 1001)
    spread = np.sqrt((first.var(axis=0, ddof=1) + second.var(axis=0, ddof=1)) / RUNS)
    allowed = stats.t.isf(SIGNIFICANCE / 2.0, RUNS - 1) * spread
    assert (allowed < 0.05 * first.mean(axis=0)).all()  # or it would see nothing
    differ = np.abs(second.mean(axis=0) - first.mean(axis=0))
    assert (differ < MODEL * first.mean(axis=0) + allowed).all(), second.mean(0) / first.mean(0)
