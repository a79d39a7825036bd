"""No light is lost where there are caustics: a furnace, films of odd sizes, Mitsuba's picture.

Their form is in test_caustics.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest
import trimesh

import clpt
from clpt import transforms as tf
from clpt.scene import Film, Scene
from clpt.scene import materials as m
from clpt.scene.integrators import Integrator, Path, Vcm
from clpt.scene.lights import Constant
from clpt.scene.shapes import Cube, Shape, Sphere
from tests.pictures.support import assert_agree, blocks, exposures
from tests.pictures.transport.test_caustics import (
    COUNT,
    EVEN,
    GLASS,
    MIRROR,
    WAYS,
    assert_formula,
    looking,
    prism,
)
from tests.pictures.transport.test_hybrid import narrow

SWITCHES: dict[str, Integrator] = {
    "path": Path(light_paths=1),
    "both": Vcm(radius=0.05),
    "light_tracing": Vcm(merging=False),
    "merging": Vcm(radius=0.05, light_tracing=False),
    "neither": Vcm(light_tracing=False, merging=False),
}


def furnace(integrator: Integrator, mode: str, width: int, height: int) -> Scene:
    """Glass, clear and frosted, a mirror and a prism: as bright as the even sky around them.

    In the spectral mode the prism is of flint glass.
    """
    spectral = mode == "spectral"
    glass = m.Dielectric(int_ior=GLASS if spectral else 1.7)
    frosted = m.RoughDielectric(int_ior=1.5, alpha_u=0.03, alpha_v=0.03)
    shapes: list[Shape] = [
        Sphere(center=(0, 0, 0.5), radius=0.35, material=m.Dielectric(int_ior=1.5)),
        Sphere(center=(0, 0, -0.5), radius=0.35, material=frosted),
        Cube(to_world=tf.translate([0.8, 0, 0]) @ tf.scale(0.2), material=MIRROR),
        dataclasses.replace(
            prism(), to_world=tf.translate([-0.8, 0, 0.3]) @ tf.scale(1.2), material=glass
        ),
    ]
    film: dict[str, Any] = {"bands": 1} if spectral else {}
    return Scene(
        camera=looking([0, 0, 0], [0, 3, 0], 1.1, (0, 0, 1)),
        shapes=shapes,
        lights=[Constant(radiance=EVEN if spectral else (1.0, 1.0, 1.0))],
        film=Film(width=width, height=height, mode=mode, **film),
        integrator=dataclasses.replace(integrator, max_depth=-1, rr_depth=20),
    )


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
@pytest.mark.parametrize("switch", SWITCHES)
def test_furnace(switch: str, mode: str) -> None:
    """Within .2 %; of alpha .03 microfacets lose a few hundredths of 1 %."""
    made = exposures(furnace(SWITCHES[switch], mode, 12, 12), COUNT, 48, device=narrow())
    assert_formula(made.mean(axis=(1, 2, 3)), 1.0, 0.002)


@pytest.mark.slow
@pytest.mark.parametrize("size", [(1, 1), (3, 5), (17, 9)])
def test_films_of_odd_sizes(size: tuple[int, int]) -> None:
    """Light paths that fill no tile; a film of one pixel has one for each pass."""
    made = exposures(furnace(SWITCHES["both"], "rgb", *size), COUNT, 16, device=narrow())
    assert_formula(made.mean(axis=(1, 2, 3)), 1.0, 0.02)


BALL_ON_A_FLOOR = """<scene version="3.0.0">
  <default name="integrator" value="path"/>
  <integrator type="$integrator"><integer name="max_depth" value="6"/></integrator>
  <sensor type="perspective"><float name="fov" value="30"/>
    <transform name="to_world"><lookat origin="0, -1.2, 0.28" target="0, 0, 0" up="0, 0, 1"/>
    </transform>
    <film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="12"/>
      <rfilter type="box"/></film></sensor>
  <shape type="rectangle"><transform name="to_world"><scale value="2"/></transform>
    <bsdf type="diffuse"><spectrum name="reflectance" value="0.5"/></bsdf></shape>
  <shape type="obj"><string name="filename" value="ball.obj"/>
    <boolean name="face_normals" value="{flat}"/>
    <bsdf type="dielectric"><float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/>
    </bsdf></shape>
  {light}
</scene>"""
LAMPS = {
    "spot": """<emitter type="spot"><float name="cutoff_angle" value="20"/>
      <float name="beam_width" value="15"/><rgb name="intensity" value="9, 9, 9"/>
      <transform name="to_world">
        <lookat origin="0.1, 0, 2" target="0, 0, 0.7" up="0, 1, 0"/></transform></emitter>""",
    "disk": """<shape type="disk"><transform name="to_world"><scale value="0.5"/>
      <rotate x="1" angle="180"/><translate x="0.1" z="2"/></transform>
      <emitter type="area"><rgb name="radiance" value="10, 10, 10"/></emitter></shape>""",
}
PEERS = [  # of a spot Mitsuba's paths from the camera find no caustic
    ("spot", "ptracer", ("path", "merging", "vcm", "particle_tracer")),
    ("disk", "path", ("path", "merging", "vcm")),
]


@pytest.mark.peers
@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
@pytest.mark.parametrize("flat", [True, False], ids=["flat", "smooth"])
@pytest.mark.parametrize(("lamp", "peer", "ways"), PEERS, ids=["spot", "disk"])
def test_beside_mitsuba(
    tmp_path: FilePath, lamp: str, peer: str, ways: tuple[str, ...], flat: bool, mode: str
) -> None:
    """The caustic of a ball of triangles, in blocks: 1 % beside chance; photons' as a whole."""
    mi = pytest.importorskip("mitsuba", reason="the renderer that we compare with is not installed")
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.4)
    ball.apply_translation([0, 0, 0.7])
    tmp_path.joinpath("ball.obj").write_text(
        ball.export(None, "obj", include_normals=True), "utf-8"
    )
    path = tmp_path / "scene.xml"
    path.write_text(BALL_ON_A_FLOOR.format(flat=str(flat).lower(), light=LAMPS[lamp]), "utf-8")
    mi.set_variant(f"scalar_{mode}")
    loaded = mi.load_file(str(path), integrator=peer)
    images = [np.array(mi.render(loaded, spp=256, seed=seed))[:, :, :3] for seed in range(16)]
    scene = clpt.load(path)
    scene = dataclasses.replace(scene, film=dataclasses.replace(scene.film, mode=mode))
    for way in ways:
        changes: dict[str, Any] = {} if way == "particle_tracer" else {"light_paths": 8}
        changes |= {"radius": 0.01} if way == "merging" else {}
        integrator = dataclasses.replace(WAYS[way], max_depth=6, **changes)
        lit = dataclasses.replace(scene, integrator=integrator)
        ours = exposures(lit, COUNT, 256 // changes.get("light_paths", 1), device=narrow())
        pictures = [ours, np.array(images)]
        if way == "merging":  # which blurs
            pictures = [a.mean(axis=(1, 2), keepdims=True) for a in pictures]
        else:
            pictures = [blocks(a) for a in pictures]
        assert_agree(*pictures, f"{way}, {lamp}", 0.01)
