"""Panes of thin glass that are no depth: what goes straight through, by paths of either end."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

import clpt
from clpt import transforms as tf
from clpt.scene import Film, Scene
from clpt.scene import materials as m
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Auto, ParticleTracer, Path, Vcm, is_long, shared
from clpt.scene.lights import Area, Constant, Point
from clpt.scene.params import fields_of
from clpt.scene.shapes import Rectangle
from tests.pictures.builders import ALBEDO, facing_down
from tests.pictures.support import (
    assert_agree,
    assert_mean,
    exposures,
    mitsubas,
    with_film,
    with_path,
)

PANE = m.ThinDielectric(int_ior=1.5, ext_ior=1.0)
FRESNEL = (0.5 / 2.5) ** 2
REFLECTED = 2.0 * FRESNEL / (1.0 + FRESNEL)  # by both faces of a pane, at normal incidence
COUNT = 4


def stack(path: Path) -> Scene:
    """Panes over each other, and nothing but the sky around them."""
    places = [tf.translate([0, 0, -0.1 * i]) @ tf.scale(50.0) for i in range(COUNT)]
    return Scene(
        camera=facing_down(),
        shapes=[Rectangle(material=PANE, to_world=place) for place in places],
        lights=[Constant(radiance=(1.0, 1.0, 1.0))],
        integrator=path,
        film=Film(width=4, height=4, mode="rgb"),
    )


def seen(depth: int, free: bool) -> float:
    """What is seen of a sky of 1: the chance of each path that is no longer than `depth`."""
    found, alive = 0.0, {(0, 1, 1): 1.0}  # the next pane, the direction, the steps with the sky
    while alive:
        (place, way, steps), chance = alive.popitem()
        if not 0 <= place < COUNT:
            found += chance * (steps <= depth)
        elif steps <= depth:
            on, back = (place + way, way, steps + (not free)), (place - way, -way, steps + 1)
            for state, share in ((on, 1.0 - REFLECTED), (back, REFLECTED)):
                alive[state] = alive.get(state, 0.0) + chance * share
    return found


@pytest.mark.parametrize(("depth", "free"), [(1, True), (2, True), (3, True), (5, False)])
def test_a_stack_of_panes(depth: int, free: bool) -> None:
    images = exposures(stack(Path(max_depth=depth, free_panes=free, light_paths=0)), 16, 1024)
    assert_mean(images, [seen(depth, free)] * 3, 0.01)


def test_panes_are_free_unless_a_file_counts_them() -> None:
    """An odd depth: a path through all four panes takes four of five steps."""
    assert seen(4, False) < 0.2 < 0.7 < seen(1, True)
    assert Path().free_panes and Auto().free_panes
    assert [is_long(depth) for depth in (-1, 1, 8, 64, 65)] == [True, False, False, True, True]


def passed(cosine: np.ndarray) -> np.ndarray:
    """What a pane lets through, by Fresnel's equations in both polarisations."""
    behind = np.sqrt(1.0 - (1.0 - cosine**2) / 1.5**2)
    across = ((cosine - 1.5 * behind) / (cosine + 1.5 * behind)) ** 2
    along = ((1.5 * cosine - behind) / (1.5 * cosine + behind)) ** 2
    return 1.0 - across / (1.0 + across) - along / (1.0 + along)


def grounded(light_paths: float, tint: Sequence[float], opacity: float, **lights: float) -> Scene:
    """The ground under a pane of which a part is cut out; `sky`, `lamp`: how bright both are.

    One set of programs serves all that have light paths, and one all others.
    """
    sky, lamp = (float(lights.get(name, 0.0)) for name in ("sky", "lamp"))
    stained = m.ThinDielectric(int_ior=1.5, ext_ior=1.0, specular_transmittance=tuple(tint))
    place = tf.translate([0, 0, 0.2]) @ tf.scale(4000.0)
    return Scene(
        camera=Perspective(to_world=tf.look_at([0, 0, 0.1], [0, 0, 0], [0, 1, 0]), fov=20.0),
        shapes=[
            Rectangle(material=m.Diffuse(reflectance=ALBEDO), to_world=tf.scale(40.0)),
            Rectangle(material=m.Mask(material=stained, opacity=opacity), to_world=place),
        ],
        lights=[
            Constant(radiance=(sky, sky, sky)),
            Point(position=(0.0, 0.0, 2.0), intensity=(lamp, lamp, lamp)),
        ],
        integrator=Path(max_depth=2, free_panes=True, light_paths=light_paths),
        film=Film(width=4, height=4, mode="rgb"),
    )


@pytest.mark.parametrize("light_paths", [0, 1])
def test_a_point_light_through_coloured_panes(light_paths: float) -> None:
    """Shadow rays find it, and light paths that are joined to the camera; never both."""
    tint = np.array([0.5, 0.8, 0.2])
    images = exposures(grounded(light_paths, tint, 0.5, lamp=4.0), 16, 256)
    through = 0.5 + 0.5 * tint * (1.0 - REFLECTED)
    assert_mean(images, ALBEDO / np.pi * through, 0.02, 2e-3)


@pytest.mark.parametrize("light_paths", [0, 1])
def test_even_light_through_a_pane(light_paths: float) -> None:
    """Both, or all three, ways to find it together as one alone would."""
    images = exposures(grounded(light_paths, (1.0, 1.0, 1.0), 1.0, sky=1.0), 16, 256)
    cosine = (np.arange(100_000) + 0.5) / 100_000
    through = float((2.0 * cosine * passed(cosine)).mean())
    assert_mean(images, [ALBEDO * through] * 3, 0.02, 2e-3)


def test_lights_behind_panes_are_hidden_as_behind_holes() -> None:
    hidden = stack(Path(max_depth=1, free_panes=True, light_paths=0, hide_lights=True))
    assert not exposures(hidden, 1, 16).any()


VOLPATH = """<scene version="3.0.0">
<integrator type="volpath"><integer name="max_depth" value="DEPTH"/></integrator>
<emitter type="point"><point name="position" value="0.3, 0.2, 2"/></emitter>
<sensor type="orthographic"><transform name="to_world"><scale value="0.2"/>
<lookat origin="0,0,5" target="0,0,0" up="0,1,0"/></transform>
<film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="4"/>
<rfilter type="box"/></film></sensor>
<emitter type="constant"/>
<shape type="rectangle"><transform name="to_world"><scale value="2"/></transform>
<bsdf type="diffuse"/></shape>
<shape type="rectangle">
<transform name="to_world"><scale value="9"/><translate z="0.5"/></transform>
<bsdf type="thindielectric"/></shape>
<shape type="rectangle">
<transform name="to_world"><scale value="9"/><translate z="1"/></transform>
<bsdf type="mask"><float name="opacity" value="0.5"/><bsdf type="thindielectric">
<rgb name="specular_transmittance" value="0.5, 0.8, 0.2"/></bsdf></bsdf></shape>
</scene>"""


FOG = """<shape type="cube"><transform name="to_world"><scale value="0.1"/>
<translate z="0.2"/></transform><bsdf type="thindielectric"/>
<medium name="interior" type="homogeneous"><rgb name="sigma_t" value=".9, .6, .3"/>
<float name="scale" value="10"/></medium></shape>
</scene>"""


@pytest.mark.slow
@pytest.mark.peers
@pytest.mark.parametrize("depth", [2, 3, 8])
def test_fog_behind_panes_is_mitsubas(tmp_path, depth: int) -> None:
    """What fills a box of thin glass under the panes is lit through them and through its sides."""
    path = tmp_path / "scene.xml"
    path.write_text(VOLPATH.replace("DEPTH", str(depth)).replace("</scene>", FOG))
    scene = with_path(with_film(clpt.load(path), mode="rgb"), light_paths=0)
    theirs = mitsubas(path, 16, 512)
    assert_agree(exposures(scene, 16, 1024), theirs, "fog", 0.01)


@pytest.mark.peers
@pytest.mark.parametrize("depth", [1, 2, 3, 4])
def test_volpath_counts_as_mitsubas(tmp_path, depth: int) -> None:
    """A wall under a pane, and under another of which half is cut out, in even light."""
    path = tmp_path / "scene.xml"
    path.write_text(VOLPATH.replace("DEPTH", str(depth)))
    scene = with_path(with_film(clpt.load(path), mode="rgb"), light_paths=0)
    theirs = mitsubas(path, 16, 512).mean(axis=(0, 1, 2))
    assert_mean(exposures(scene, 16, 1024), theirs, 0.02, 0.01)


FREE = {
    "path": Path(max_depth=3, light_paths=0),
    "light paths": Path(max_depth=3, light_paths=1),
    "vcm": Vcm(max_depth=3),
    "particle_tracer": ParticleTracer(max_depth=3),
}


@pytest.mark.slow
def test_panes_are_free_however_light_is_found() -> None:
    """A lamp over four panes over a floor: three steps are the panes' light by every way."""
    shapes = [
        Rectangle(material=m.Diffuse(reflectance=0.8), to_world=tf.scale(2.0)),
        *[
            Rectangle(material=PANE, to_world=tf.translate([0, 0, 0.5 + 0.1 * i]) @ tf.scale(4.0))
            for i in range(COUNT)
        ],
        Rectangle(
            material=m.Diffuse(reflectance=0.0),
            emission=Area(radiance=10.0),
            to_world=tf.translate([0, 0, 1.5]) @ tf.rotate([1, 0, 0], 180) @ tf.scale(0.5),
        ),
    ]
    view = tf.look_at([0, -1.2, 0.4], [0, 0, 0], [0, 0, 1])  # below the panes
    means = {}
    for name, way in FREE.items():
        scene = Scene(
            camera=Perspective(to_world=view, fov=40.0),
            shapes=shapes,
            integrator=way,
            film=Film(width=12, height=12, mode="rgb"),
        )
        means[name] = float(clpt.render(scene, 256).mean())
    assert means["path"] > 0.1
    np.testing.assert_allclose(list(means.values()), means["path"], rtol=0.03)


def test_what_auto_may_choose_has_its_parameters() -> None:
    """What is asked of `auto` holds for what it takes: else it would change the picture."""
    asked = Auto(max_depth=5, rr_depth=2, hide_lights=True, free_panes=False)
    for other in (Path, Vcm):
        assert shared(asked, other()) == fields_of(asked)
