"""Pictures of curves: with spheres, instances and every layout, and beside Mitsuba's."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import clpt
from clpt import transforms as T
from clpt.geometry.instancing import FEW
from clpt.geometry.tubes import as_tubes
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import cameras, integrators, lights, materials
from clpt.scene.shapes import Curves, Group, Instance, Spheres
from tests.pictures.support import assert_agree, exposures, mitsubas, with_film

RNG = np.random.default_rng(4)
POINTS = np.concatenate(
    [
        np.column_stack(
            [x + 0.1 * RNG.normal(size=6), np.linspace(-1, 1, 6), 0.2 * RNG.normal(size=6),
             np.full(6, 0.06)]
        )
        for x in np.linspace(-0.6, 0.6, 5)
    ]
)  # fmt: skip
GREY = materials.Diffuse(reflectance=(0.7, 0.5, 0.3))
CURVES = Curves(points=POINTS, lengths=(6,) * 5, material=GREY)


def scene(*shapes, size: int = 40) -> clpt.Scene:
    return clpt.Scene(
        camera=cameras.Perspective(fov=35.0, to_world=T.look_at((0, 0, 4), (0, 0, 0), (0, 1, 0))),
        film=integrators.Film(width=size, height=size, mode="rgb"),
        integrator=integrators.Path(max_depth=4),
        shapes=list(shapes),
        lights=[
            lights.Constant(radiance=(0.3, 0.4, 0.5)),
            lights.Directional(direction=(-1.0, -0.4, -1.0), irradiance=(2.0, 2.0, 2.0)),
        ],
    )


def mixed(curves: Curves) -> clpt.Scene:
    """Curves alone and in a group that is turned and scaled, beside many spheres."""
    centers = np.random.default_rng(1).uniform(-1.0, 1.0, (30, 3))
    group = Group((curves, Spheres(centers=centers[:5], radii=0.1, material=GREY)))
    turned = T.rotate([0, 0, 1], 70.0) @ T.scale(0.5)
    places = [T.translate([x, 0.3, -1.0]) @ turned for x in (-1, 1)]
    copies = [Instance(group=group, to_world=place) for place in places]
    return scene(curves, Spheres(centers=centers, radii=0.05, material=GREY), *copies)


@pytest.mark.slow
def test_every_layout_and_tubes_show_the_same():
    exact = mixed(CURVES)
    assert {"spheres", "curves"} == set(lower(exact).features.geometry.analytic)
    image = clpt.render(exact, spp=32)
    assert np.isfinite(image).all()
    for layout in ("brute", "compact"):
        other = clpt.render(exact, spp=32, layout=layout)
        assert np.abs(other - image).mean() < 2e-3
    tubes = clpt.render(mixed(as_tubes(CURVES)), spp=32)
    assert np.abs(tubes.mean() / image.mean() - 1.0) < 0.01
    assert np.abs(tubes - image).mean() < 0.03


def u_of_mitsuba(along, normal) -> float:
    """u of a point of a strand by the frame of Mitsuba's curves, whose guide is +z."""
    tangent, normal = (np.array(v, float) / np.linalg.norm(v) for v in (along, normal))
    turned = np.array([0.0, 0.0, 1.0]) - tangent * tangent[2]
    if np.linalg.norm(turned) < 1e-9:
        turned = np.array([0.0, 1.0, 0.0])
    turned /= np.linalg.norm(turned)
    return (
        float(np.arctan2(turned @ normal, np.cross(turned, tangent) @ normal) / (2.0 * np.pi)) % 1.0
    )


@pytest.mark.parametrize("lit", [False, True], ids=["curves", "tubes"])
@pytest.mark.parametrize("to_world", [np.eye(4), T.rotate((1, 1, 0), 70.0)], ids=["", "turned"])
def test_u_begins_where_mitsubas_does(lit, to_world):
    for along, normal in [
        ((1, 0, 0), (0, 0, 1)), ((1, 0, 0), (0, 1, 0.3)), ((0, 1, 0), (1, 0, 0.2)),
        ((1, 1, 0), (0, 0, 1)), ((0, 0, 1), (1, 0.5, 0)), ((0, 0, -1), (1, 0.5, 0)),
        ((1, 2, 3), (3, 0, -1)),
    ]:  # fmt: skip
        end = 3.0 * np.array(along) / np.linalg.norm(along) @ to_world[:3, :3]
        strand = Curves(
            points=[(*-end, 0.3), (*end, 0.3)], basis="linear", to_world=to_world,
            emission=lights.Area() if lit else None,
        )  # fmt: skip
        view = T.look_at(4.0 * np.array(normal), (0, 0, 0), along) @ T.scale([0.02, 0.02, 1.0])
        seen = clpt.Scene(
            camera=cameras.Orthographic(to_world=view),
            film=integrators.Film(width=2, height=2, mode="rgb", layers=["uv"]), shapes=[strand],
        )  # fmt: skip
        with clpt.Renderer(seen) as renderer:
            renderer.run(1)
            u = renderer.layers()["uv"][..., 0]
        np.testing.assert_allclose(u, u_of_mitsuba(along, normal), atol=0.03)


def test_what_becomes_tubes():
    """What shines, what is stretched, and what is instanced often; the rest is met as it is."""
    shining = dataclasses.replace(CURVES, emission=lights.Area(radiance=(1.0, 1.0, 1.0)))
    stretched = dataclasses.replace(CURVES, to_world=T.scale([1.0, 2.0, 1.0]))
    group = Group((CURVES,))
    often = [Instance(group=group, to_world=T.translate([i, 0, 0])) for i in range(FEW + 1)]
    for things in ([shining], [stretched], often):
        assert not lower(scene(*things)).features.geometry.analytic
    assert lower(scene(*often[:FEW])).features.geometry.analytic == ("curves",)
    memory = [lower(scene(one)) for one in (CURVES, as_tubes(CURVES))]
    assert memory[0].tables["spheres"].nbytes < memory[1].vertices.nbytes


def test_curves_that_move_are_where_they_would_be_lowered():
    """The same bits but for the order of pieces; points that change are lowered again."""
    named = dataclasses.replace(CURVES, name="hair")
    renderer = clpt.Renderer(scene(named))
    renderer.run(2)
    place = T.translate([0.2, 0.1, -0.3]) @ T.rotate([0, 0, 1], 40.0) @ T.scale(0.8)
    for matrix in (T.rotate([0, 1, 0], 60.0), place):
        renderer.update(transforms={"hair": matrix})
    renderer.run(4)
    moved = dataclasses.replace(named, to_world=place)
    expected = clpt.render(scene(moved), spp=4)
    assert np.abs(renderer.image() - expected).mean() < 1e-4
    bent = dataclasses.replace(named, points=POINTS + np.array([0.3, 0.0, 0.0, 0.0]))
    renderer.update(scene=scene(bent))
    renderer.run(4)
    assert np.abs(renderer.image() - clpt.render(scene(bent), spp=4)).mean() < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["bsplinecurve", "linearcurve"])
def test_beside_mitsuba(kind, tmp_path):
    """Pixels and their mean, of 24 renders each: in RGB as Mitsuba's, with independent samples.

    Welch's z per pixel is a t of 23 to 46 degrees of freedom, its square 1.05 to 1.10 in the mean.
    The picture has 1,000 pixels that are not even sky, so that chance moves the mean of squares by
    .045, and 1.25 is three times that above.
    """
    strands = POINTS.reshape(5, 6, 4) * [1, 2.2, 1, 1]  # ends, which Mitsuba leaves open, are off
    lines = ("\n".join(" ".join(map(str, row)) for row in strand.tolist()) for strand in strands)
    (tmp_path / "hair.txt").write_text("\n\n".join(lines) + "\n")
    path = tmp_path / "scene.xml"
    path.write_text(
        f"""<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="4"/>
        </integrator><sensor type="perspective"><float name="fov" value="28"/>
        <transform name="to_world"><lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform>
        <film type="hdrfilm"><integer name="width" value="48"/><integer name="height" value="48"/>
        <rfilter type="box"/></film><sampler type="independent"/></sensor>
        <shape type="{kind}"><string name="filename" value="hair.txt"/><bsdf type="twosided">
        <bsdf type="diffuse"><rgb name="reflectance" value=".7,.5,.3"/></bsdf></bsdf></shape>
        <emitter type="constant"><rgb name="radiance" value=".3,.4,.5"/></emitter>
        <emitter type="directional"><vector name="direction" x="-1" y="-.4" z="-1"/>
        <rgb name="irradiance" value="2,2,2"/></emitter></scene>"""
    )
    theirs = mitsubas(path, 24, 128)
    # Spectra of colours multiply to other colours than Mitsuba's RGB: .2 % brighter here. Sobol's
    # sampler has a third of the variance, which leaves Welch's z fewer degrees of freedom.
    own = with_film(clpt.load(path), mode="rgb")
    ours = exposures(dataclasses.replace(own, sampler=integrators.Independent()), 24, 128)
    error = np.sqrt((theirs.var(axis=0, ddof=1) + ours.var(axis=0, ddof=1)) / 24.0)
    noisy = error > 1e-4  # not the even sky
    z = (ours.mean(axis=0) - theirs.mean(axis=0))[noisy] / error[noisy]
    assert noisy.mean() > 0.3
    assert (z**2).mean() < 1.25 and np.abs(z).max() < 6.0
    means = [images.mean(axis=(1, 2), keepdims=True) for images in (ours, theirs)]
    assert_agree(*means, f"mean of {kind}")
    assert abs(ours.mean() / theirs.mean() - 1.0) < 1e-3
