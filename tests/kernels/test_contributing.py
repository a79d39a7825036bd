"""The worked example of CONTRIBUTING.md, taken from its text, is a material that holds."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from clpt.scene import materials
from clpt.testing.probe import COMPONENTS
from clpt.testing.settings import directions, settings
from tests.kernels.harness import Probe

GUIDE = Path(__file__).resolve().parents[2] / "CONTRIBUTING.md"


def example(language: str) -> str:
    (text,) = re.findall(rf"```{language}\n(.*?)```", GUIDE.read_text(encoding="utf-8"), re.DOTALL)
    return text


@pytest.mark.parametrize("mode", COMPONENTS)
def test_the_example_is_a_material(mode):
    scope = dict(vars(materials))
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
