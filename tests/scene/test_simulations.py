"""Scenes of MuJoCo and PyVista: rays meet what their own rays meet."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import clpt
from clpt import dataset
from clpt.errors import SceneError
from clpt.scene import Film, Scene, cameras, conventions, lights, materials, shapes

SIZE = WIDTH, HEIGHT = 32, 24
MODEL = """<mujoco>
<asset><mesh name="m" vertex="0 0 0 .4 0 0 0 .4 0 0 0 .4"/>
<material name="red" rgba="1 .2 .1 1" roughness=".3" metallic=".5" specular=".4"/></asset>
<visual><headlight ambient="0 0 0" diffuse="0 0 0"/></visual>
<worldbody><light dir="0 .6 -.8" directional="true" diffuse=".5 .5 .5"/>
<camera name="side" pos="0 -3 1.6" xyaxes="1 0 0 0 .4 1" fovy="50"/>
<geom name="floor" type="plane" size="0 0 1" rgba="1 1 1 1"/>
<body name="b" pos="0 0 .6" euler="10 20 30"><freejoint/>
<geom name="box" type="box" size=".2 .2 .3" material="red" pos="-.8 0 0"/>
<geom type="capsule" fromto=".8 0 -.2 .8 .3 .4" size=".12"/>
<geom name="egg" type="ellipsoid" size=".15 .2 .3" pos="0 .5 .3"/>
<geom type="mesh" mesh="m" pos=".2 -.5 .2"/><geom type="cylinder" size=".15 .2" pos="-.3 .3 .5"/>
<geom type="sphere" size=".18" rgba="0 0 1 .5"/>
<geom type="sphere" size=".9" group="4"/></body></worldbody></mujoco>"""


def test_mujoco_rays_meet_the_same():
    """Distances through the pixels' middles, by mj_ray; at edges of shapes a few may differ."""
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string(MODEL)
    state = mujoco.MjData(model)
    mujoco.mj_forward(model, state)
    scene = Scene.from_mujoco(model, state, camera="side")
    scene = dataclasses.replace(scene, film=Film(size=SIZE, mode="rgb"))
    opaque = [dataclasses.replace(shape, material=materials.Diffuse()) for shape in scene.shapes]
    truth = dataset.ground_truth(dataclasses.replace(scene, shapes=opaque))
    camera = conventions.calibrated(scene.camera, *SIZE)
    pixels = np.stack(np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT)), -1)
    rays, origin = camera.unproject(pixels, *SIZE), np.asarray(scene.camera.to_world)[:3, 3]
    groups, geom = np.array([1, 1, 1, 0, 0, 0], np.uint8), np.zeros(1, np.int32)
    expected = np.zeros((HEIGHT, WIDTH))
    for at in np.ndindex(expected.shape):
        arguments = (model, state, origin, rays[at], groups, 1, -1, geom)
        try:
            expected[at] = max(mujoco.mj_ray(*arguments), 0.0)
        except TypeError:  # from 3.4 on with a normal
            expected[at] = max(mujoco.mj_ray(*arguments, None), 0.0)
    found = np.where(truth.depth > 0.0, np.linalg.norm(truth.position - origin, axis=-1), 0.0)
    away = np.abs(found - expected) > 0.01 * np.maximum(expected, 1.0)
    assert away.mean() < 0.02, away.sum()
    assert {"floor", "box", "egg", "b.002"} <= set(truth.names)
    assert isinstance(scene["box.material.front"], materials.Principled)
    lit = [light for light in scene.lights if isinstance(light, lights.Directional)]
    assert len(lit) == 1 and not any(isinstance(s, lights.Constant) for s in scene.lights)
    floor = dataclasses.replace(scene, shapes=[s for s in scene.shapes if s.name == "floor"])
    image = clpt.render(floor, spp=16)
    np.testing.assert_allclose(image[-1, :, 1], 0.5 * 0.8, rtol=0.02)  # diffuse times cosine
    with pytest.raises(SceneError, match="no camera 'top', but side"):
        Scene.from_mujoco(model, state, camera="top")
    assert Scene.from_mujoco(model, state).camera.fov_axis == "y"


def test_mujoco_wants_a_model():
    with pytest.raises(SceneError, match=r"mujoco\.MjModel"):
        Scene.from_mujoco("humanoid.xml", None)


def test_pyvista_rays_meet_the_same():
    """Depth of a plotter's meshes by their own ray trace, colors by the lookup table."""
    pv = pytest.importorskip("pyvista")
    plotter = pv.Plotter(off_screen=True, window_size=SIZE)
    ball = pv.Sphere(theta_resolution=40, phi_resolution=40)
    ball["height"] = ball.points[:, 2]
    plotter.add_mesh(ball, scalars="height", name="ball", show_scalar_bar=False)
    cube = plotter.add_mesh(pv.Cube(), color="red", name="cube")
    cube.SetPosition(1.2, 0.0, 0.0)
    plotter.add_mesh(pv.ImageData(dimensions=(3, 3, 3)), name="grid", opacity=0.5, pbr=False)
    plotter.camera.position, plotter.camera.focal_point = (3.0, -4.0, 2.0), (0.5, 0.2, 0.3)
    scene = Scene.from_pyvista(plotter)
    assert (scene.film.width, scene.film.height) == SIZE
    assert {"ball", "cube", "grid"} <= {shape.name for shape in scene.shapes}
    kept = [
        dataclasses.replace(shape, material=materials.Diffuse())
        for shape in scene.shapes if shape.name in ("ball", "cube")
    ]  # fmt: skip
    truth = dataset.ground_truth(dataclasses.replace(scene, shapes=kept))
    camera = conventions.calibrated(scene.camera, *SIZE)
    pixels = np.stack(np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT)), -1)
    rays, origin = camera.unproject(pixels, *SIZE), np.asarray(scene.camera.to_world)[:3, 3]
    moved = pv.Cube().translate((1.2, 0.0, 0.0))
    wrong = 0
    for at in np.ndindex(HEIGHT, WIDTH):
        ends = [mesh.ray_trace(origin, origin + 20.0 * rays[at], first_point=True)[0]
                for mesh in (ball, moved)]  # fmt: skip
        near = min((np.linalg.norm(p - origin) for p in ends if len(p)), default=0.0)
        hit = truth.depth[at] > 0.0
        found = np.linalg.norm(truth.position[at] - origin) if hit else 0.0
        wrong += abs(found - near) > 0.01
    assert wrong < 0.02 * WIDTH * HEIGHT
    (mesh,) = (shape for shape in scene.shapes if shape.name == "ball")
    assert isinstance(mesh, shapes.Mesh) and len(mesh.attributes["vertex_color"]) == len(
        mesh.vertices
    )
    top, bottom = (
        mesh.attributes["vertex_color"][f(mesh.vertices[:, 2])] for f in (np.argmax, np.argmin)
    )
    assert np.abs(top - bottom).max() > 0.3
    clpt.render(scene, spp=1)


def test_pyvista_parallel_projection():
    pv = pytest.importorskip("pyvista")
    plotter = pv.Plotter(off_screen=True, window_size=SIZE)
    plotter.add_mesh(pv.Cube(), color="white")
    plotter.camera.parallel_projection = True
    plotter.camera.parallel_scale = 2.0
    scene = Scene.from_pyvista(plotter)
    assert isinstance(scene.camera, cameras.Orthographic)
    assert scene.camera.half_height(WIDTH / HEIGHT) == pytest.approx(2.0)


def test_pyvista_wants_a_plotter():
    with pytest.raises(SceneError, match=r"pyvista\.Plotter"):
        Scene.from_pyvista(object())
