"""The worked examples of CONTRIBUTING.md, taken from its text, hold: a material and a light."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from clpt.scene.materials import diffuse
from clpt.testing.probe import COMPONENTS
from clpt.testing.settings import directions, settings
from tests.kernels.harness import Probe

GUIDE = Path(__file__).resolve().parents[2] / "CONTRIBUTING.md"


def example(language: str, number: int = 0) -> str:
    """The example of a material (0) or of a light (1) in a language."""
    text = GUIDE.read_text(encoding="utf-8")
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)[number]


@pytest.mark.parametrize("mode", COMPONENTS)
def test_the_example_is_a_material(mode):
    scope = dict(vars(diffuse))
    exec(compile(example("python"), str(GUIDE), "exec", dont_inherit=True), scope)
    cls, rng = scope["Translucent"], np.random.default_rng(21)
    cls.source = example("c")
    probe = Probe(cls, mode)
    for params in settings(cls, mode, rng, 3):
        for wo in directions(rng, 3):
            wi = directions(rng, 20_000)
            r = probe(params, wo[None], wi, rng.random((len(wi), 3)))
            # 6 standard errors of a mean over the sphere, whose values deviate by less than 1.3
            assert r["pdf"].mean() * 4.0 * np.pi == pytest.approx(1.0, abs=0.055)
            product = r["weight"] * r["sampled_pdf"][:, None]
            np.testing.assert_allclose(product, r["eval_again"], rtol=1e-4, atol=1e-6)
            crossed = np.mean(r["wi"][:, 2] * wo[2] < 0.0)
            assert crossed == pytest.approx(float(params["passed"]), abs=0.02)
            np.testing.assert_allclose(r["albedo"], np.tile(params["colour"], (len(wi), 1)))


@pytest.mark.slow
def test_the_example_is_a_light(tmp_path: Path):
    """In a copy of the package: light that a ground reflects, against its integral."""
    root = GUIDE.parent
    for folder in ("clpt", "kernels"):
        shutil.copytree(root / folder, tmp_path / folder)
    lights = tmp_path / "clpt/scene/lights.py"
    text = lights.read_text("utf-8")
    before, after = text.split("\nON_SHAPES = ")
    after = after.replace("KINDS = (", "KINDS = (\n    GradientSky,", 1)
    lights.write_text(f"{before}\n{example('python', 1)}\n\nON_SHAPES = {after}", "utf-8")
    (tmp_path / "kernels/lights/kinds/gradient_sky.cl").write_text(example("c", 1), "utf-8")
    command = [sys.executable, "-c", LIT_GROUND]
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    # the integral of (low (1 - c) + high c) c over the hemisphere, c being the cosine: pi times
    # this
    assert float(done.stdout) == pytest.approx(0.5 * (0.3 / 3.0 + 2.0 * 1.2 / 3.0), rel=0.01)


LIT_GROUND = """
import clpt
from clpt import transforms as tf
from clpt.scene import Film, Scene, cameras, lights, materials, shapes
from clpt.scene.integrators import Path

place = tf.rotate([1, 0, 0], -90) @ tf.scale(100.0)
ground = shapes.Rectangle(to_world=place, material=materials.Diffuse(reflectance=0.5))
sky = lights.GradientSky(horizon=(0.3, 0.3, 0.3), zenith=(1.2, 1.2, 1.2))
camera = cameras.Perspective(to_world=tf.look_at([0, 2, 0], [0, 0, 0], [0, 0, 1]))
film = Film(width=8, height=8, mode="rgb")
scene = Scene(camera=camera, shapes=[ground], lights=[sky], film=film, integrator=Path(max_depth=2))
print(clpt.render(scene, 64).mean())
"""
