"""Pictures of measured materials: beside Mitsuba's, and with other kinds in a scene."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import clpt
from clpt import measured
from clpt.scene import cameras, integrators, lights, materials, shapes
from tests.measured.surfaces import metal

NODES = np.linspace(380.0, 740.0, 10)


@pytest.mark.slow
def test_other_kinds_stand_before_them():
    """A table is read in the lanes of its material alone; the rest of a block reads what exists."""
    kinds = (
        materials.Merl(data=measured.tabulate(metal(0.4), (20, 15, 30))),
        materials.Measured(data=measured.fit(metal(0.4), normals=32, size=16)),
    )
    balls = [
        shapes.Sphere(center=(x, 0, 0), radius=0.9, material=kind)
        for x, kind in zip((-1, 1), kinds, strict=True)
    ]
    floor = shapes.Sphere(center=(0, -101, 0), radius=100.0, material=materials.Diffuse())
    scene = clpt.Scene(
        camera=cameras.Perspective(
            fov=40.0, to_world=clpt.transforms.look_at((0, 0, 6), (0, 0, 0), (0, 1, 0))
        ),
        film=integrators.Film(width=32, height=24),
        integrator=integrators.Path(max_depth=3),
        shapes=[floor, *balls],
        lights=[lights.Constant(radiance=1.0)],
    )
    image = clpt.render(scene, spp=64)
    assert np.isfinite(image).all()
    halves = image[:, :16].mean(axis=(0, 1)), image[:, 16:].mean(axis=(0, 1))
    np.testing.assert_allclose(*halves, rtol=0.02)


@pytest.mark.slow
@pytest.mark.peers
def test_beside_mitsuba(tmp_path):
    """t-tests of blocks of pixels; one fails by chance in 3000 runs of all."""
    mi = pytest.importorskip("mitsuba", reason="the renderer that we compare with")
    mi.set_variant("scalar_spectral")
    colour = np.linspace(0.3, 0.9, len(NODES))
    quarter = np.linspace(-np.pi, -0.5 * np.pi, 4)
    data = measured.fit(metal(0.4, 0.2, colour), NODES, phi_i=quarter, normals=32, size=16)
    measured.write(tmp_path / "a.bsdf", data)
    (tmp_path / "a.xml").write_text("""<scene version="3.0.0">
        <integrator type="path"><integer name="max_depth" value="3"/></integrator>
        <sensor type="perspective"><float name="fov" value="30"/>
            <transform name="to_world">
                <lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform>
            <film type="hdrfilm">
                <integer name="width" value="24"/><integer name="height" value="24"/>
                <rfilter type="box"/></film></sensor>
        <shape type="rectangle"><transform name="to_world"><rotate x="1" angle="-50"/></transform>
            <bsdf type="measured"><string name="filename" value="a.bsdf"/></bsdf></shape>
        <emitter type="constant"><spectrum name="radiance" value="350:.2,850:.5"/></emitter>
        <shape type="sphere"><point name="center" x="1" y="3" z="2"/>
            <emitter type="area"><spectrum name="radiance" value="350:12,850:7"/></emitter></shape>
        </scene>""")
    theirs, ours, runs = [], [], 8
    scene = clpt.load(tmp_path / "a.xml")
    scene.film = dataclasses.replace(scene.film, mode="spectral")
    other = mi.load_file(str(tmp_path / "a.xml"))
    for seed in range(runs):
        theirs.append(np.array(mi.render(other, spp=64, seed=seed))[..., :3])
        scene.seed = seed
        ours.append(clpt.render(scene, spp=128))
    a, b = (np.array(one).reshape(runs, 6, 4, 6, 4, 3).mean(axis=(2, 4)) for one in (ours, theirs))
    error = np.sqrt((a.var(axis=0, ddof=1) + b.var(axis=0, ddof=1)) / runs)
    beside = 2e-3 * b.mean(axis=0)  # their observer's and ours, seen in the even background
    z = (a.mean(axis=0) - b.mean(axis=0)) / np.hypot(error, beside)
    assert np.sqrt((z**2).mean()) < 1.3 and np.abs(z).max() < 7.5
    np.testing.assert_allclose(a.mean(axis=(0, 1, 2)), b.mean(axis=(0, 1, 2)), rtol=0.005)
