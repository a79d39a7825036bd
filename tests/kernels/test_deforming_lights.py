"""Triangles of lamps that deform, sampled at a time, against float64."""

from __future__ import annotations

import numpy as np

from clpt import transforms
from clpt.records import LIGHT
from clpt.render.flow import choices, flags, stages
from clpt.render.flow.scene_to_tables import Lowered, lower
from clpt.render.geometry import cases as shapes
from clpt.render.lights import cases as lights
from clpt.render.materials import cases as parameters
from clpt.scene import Film, Scene, cameras, integrators
from clpt.scene.lights import Area
from clpt.scene.motion import Deformation, Shutter
from clpt.scene.shapes import Cube, Mesh
from tests.kernels.scene_harness import SceneProbe

TIMES = (0.0, 0.3, 1.0)
COUNT = 4096
NONE = "Receiver none = {v3((real)(0.0f), (real)(0.0f), (real)(0.0f))};"
SAMPLE = f"""
    scene.time = x[0];
    vec2 u = {{x[2], x[3]}}, v = {{x[4], x[5]}};
    {NONE}
    Wavelengths lambdas = wavelengths_sample(scene, x[4]);
    vec3 p = v3((real)(0.2f), (real)(-0.3f), (real)(2.5f));
    LightSample s = light_sample(scene, p, none, x[1], u, lambdas);
    r[0] = s.wi.x; r[1] = s.wi.y; r[2] = s.wi.z; r[3] = s.t; r[4] = s.pdf; r[5] = to_real(s.row);
    LightRay e = light_emit(scene, x[1], u, v, lambdas);
    r[6] = e.o.x; r[7] = e.o.y; r[8] = e.o.z; r[9] = e.power.y; r[10] = to_real(e.row);
    r[11] = e.n.x; r[12] = e.n.y; r[13] = e.n.z;
    r[14] = light_emit_pdf(scene, e.row, neg3(e.d), (real)(1.0f));
    r[15] = light_pdf(scene, s.row, p, none, s.wi, s.t, scale3(s.wi, (real)(-1.0f)));
"""


def lowered() -> tuple[Lowered, np.ndarray]:
    """A lamp of three triangles with three keys beside a cube that is one, and its corners."""
    rng = np.random.default_rng(3)
    points = rng.normal(size=(3, 5, 3)).astype(np.float32) * 0.5
    faces = np.array([[0, 1, 2], [2, 1, 3], [2, 3, 4]])
    lamp = Mesh(
        vertices=points[0],
        faces=faces,
        emission=Area(radiance=2.0, two_sided=True),
        deformation=Deformation(TIMES, points),
    )
    still = Cube(
        to_world=transforms.translate([3, 0, 0]) @ transforms.scale(0.2),
        emission=Area(radiance=2.0, two_sided=True),
    )
    scene = Scene(
        camera=cameras.Perspective(shutter=Shutter(0.0, 1.0)),
        shapes=[still, lamp],
        film=Film(width=8, height=8, mode="rgb"),
        integrator=integrators.Path(light_paths=1),
    )
    return lower(scene), points[:, faces]


def test_points_and_densities_of_lamps_that_deform() -> None:
    made, corners = lowered()
    features = made.features
    assert {"vertices", "emitters"} == {*features.motion.parts} and not features.lights.tree
    virtual = {
        **shapes.virtual_files(features),
        **lights.virtual_files(),
        **parameters.virtual_files(features),
        **choices.virtual_files(features, "wide8"),
        "generated/lights.cl": stages.lights_text(features),
        "generated/emission.cl": lights.emission_text(features),
    }
    settings = {name: made.settings[name] for name in made.settings.dtype.names}
    probe = SceneProbe(
        SAMPLE,
        6,
        16,
        files=(
            *("shapes/shape.cl", "lights/light.cl"),
            *("generated/lights.cl", "generated/emission.cl"),
        ),
        virtual=virtual,
        defines=flags.of_scene(features),
        tables={**made.tables, "vertices": made.vertices, "faces": made.faces},
        settings=settings,
    )
    x = np.random.default_rng(4).random((6, COUNT)).astype(np.float32)
    r = probe(*x).astype(np.float64)
    table = made.tables["lights"].view(LIGHT.dtype)[: int(made.settings["light_count"])]
    pmf = table["pmf"].astype(np.float64)
    number = r[5].astype(int)
    first = len(pmf) - 3
    bends = number >= first
    assert 0.2 < bends.mean() < 0.999
    step = np.minimum(np.searchsorted(TIMES, x[0], "right") - 1, 1)
    share = (x[0] - np.take(TIMES, step)) / np.diff(TIMES)[step]
    there = (1 - share)[:, None, None, None] * corners[step]
    there = there + share[:, None, None, None] * corners[step + 1]  # (n, 3, 3, 3)
    p = np.array([0.2, -0.3, 2.5])

    def of(which: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The first corner, the unit normal and the area of a triangle a sample."""
        a, b, c = np.moveaxis(there[np.arange(COUNT), np.clip(which - first, 0, 2)], 1, 0)
        n = np.cross(b - a, c - a)
        length = np.linalg.norm(n, axis=1)
        return a, n / length[:, None], length / 2.0

    a, n, area = of(number)
    wi, t = r[:3].T, r[3]
    cosine = np.abs((n * wi).sum(axis=1))
    lit = bends & (r[4] > 0.0) & (cosine > 0.05)
    away = ((p + wi * t[:, None] - a) * n).sum(axis=1)
    assert np.abs(away)[lit].max() < 1e-4 * 4
    expected = pmf[number] * t**2 / (area * cosine)
    assert np.allclose(r[4][lit], expected[lit], rtol=3e-3)
    assert np.allclose(r[15][lit], (pmf[number] * t**2 / area)[lit], rtol=3e-3)
    number = r[10].astype(int)
    bends = number >= first
    a, n, area = of(number)
    away = ((r[6:9].T - a) * n).sum(axis=1)
    assert np.abs(away)[bends].max() < 1e-5
    assert np.allclose(np.abs((n * r[11:14].T).sum(axis=1))[bends], 1.0, atol=1e-3)
    power = 2.0 * np.pi * 2.0 * area / pmf[number]  # of both sides
    assert np.allclose(r[9][bends], power[bends], rtol=1e-3)
    assert np.allclose(r[14][bends], (pmf[number] / (2.0 * np.pi * area))[bends], rtol=1e-3)
