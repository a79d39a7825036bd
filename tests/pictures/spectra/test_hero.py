"""Dispersive materials keep their mean, and where their lobes are rough also their noise."""

from __future__ import annotations

from typing import Any

import pytest

from clpt import spectra
from clpt import transforms as tf
from clpt.scene import Film, Scene, materials
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Path
from clpt.scene.lights import Area, Constant
from clpt.scene.params import params
from clpt.scene.roles import INDEX
from clpt.scene.shapes import Rectangle, Sphere
from clpt.spectra import Spectrum, Tabulated
from tests.pictures.builders import BLACK, UP
from tests.pictures.support import assert_agree, blocks, exposures, quick

SHORT, LONG = (1.35, 1.8)  # the index below and above EDGE
EDGE, GAP = 550.0, 2.0  # [nm]; there is no light nearer to the edge than GAP
STEP = Tabulated((EDGE - 1.0, EDGE + 1.0), (SHORT, LONG), "hold")


# What shows that light is bent, and hides nothing of it.
LOOK = {
    "ext_ior": 1.0, "roughness": 0.4, "spec_trans": 0.7, "transmission": 0.7, "coat_alpha": 0.3,
    "mode": "transmissive", "profile": "explicit",
}  # fmt: skip


def band(lo: float, hi: float) -> Tabulated:
    """An even spectrum from lo to hi [nm], nothing elsewhere."""
    return Tabulated((lo - 0.5, lo, hi, hi + 0.5), (0.0, 1.0, 1.0, 0.0))


BELOW, ABOVE = band(420.0, EDGE - GAP), band(EDGE + GAP, 680.0)
WHITE = Tabulated((300.0, 900.0), (1.0, 1.0))
BOTH = Tabulated(BELOW.lambdas + ABOVE.lambdas, BELOW.values + ABOVE.values)


def ball(
    kind: type[materials.Material], index: Spectrum | float, light: Tabulated, alpha: float = 0.3
) -> Scene:
    """A ball of a material under a lamp and a dim sky of one spectrum, over a grey table."""
    given: dict[str, Any] = {name: value for name, value in LOOK.items() if name in params(kind)}
    given |= {name: alpha for name in ("alpha_u", "alpha_v") if name in params(kind)}
    material = kind(**{**given, str(bending(kind)): index})
    scaled = Tabulated(light.lambdas, [8.0 * v for v in light.values])
    lamp = tf.translate([0.5, 2.0, 0.0]) @ tf.rotate([1, 0, 0], 90) @ tf.scale(0.7)
    return Scene(
        camera=Perspective(to_world=tf.look_at([0, 1, 4], [0, 0, 0], UP), fov=32.0),
        shapes=[
            Sphere(material=material),
            Rectangle(
                material=materials.Diffuse(),
                to_world=tf.translate([0, -1, 0]) @ tf.rotate([1, 0, 0], -90) @ tf.scale(3.0),
            ),
            Rectangle(material=BLACK, emission=Area(radiance=scaled), to_world=lamp),
        ],
        lights=[Constant(radiance=light)],
        integrator=Path(max_depth=6),
        film=Film(width=24, height=24),
    )


def bending(kind: type[materials.Material]) -> str | None:
    """The parameter that bends light; None of a kind that has none. A metal's may be textured."""
    indices = [name for name, p in params(kind).items() if p.role is INDEX and not p.textured]
    return indices[0] if indices else None


KINDS = [kind for kind in materials.LEAVES if bending(kind)]
QUICK = (materials.Dielectric,)


@pytest.mark.parametrize("kind", quick(KINDS, *QUICK), ids=lambda kind: kind.kind)
def test_a_step_in_the_index_is_two_indices(kind: type[materials.Material]) -> None:
    """The picture is the sum of those of two bands of light, each with its constant index.

    Welch's t-test of blocks of 4x4 pixels, at the significance of tests/pictures/support.py.
    """
    ours = exposures(ball(kind, STEP, BOTH), 48, 16)
    parts = [exposures(ball(kind, *of), 48, 16, 99) for of in ((SHORT, BELOW), (LONG, ABOVE))]
    assert_agree(blocks(ours), blocks(parts[0] + parts[1]), kind.kind)
    assert abs(ours.mean() / (parts[0] + parts[1]).mean() - 1.0) < 0.02


@pytest.mark.slow
@pytest.mark.parametrize(("alpha", "bound"), [(0.3, 1.1), (0.05, 1.3)])
def test_rough_dispersive_glass_costs_little_noise(alpha: float, bound: float) -> None:
    """Between exposures, rough flint varies nearly as little as glass of an even index.

    Measured: 1.00 and 1.1 times the variance; 1.01 and 1.7 where only the hero's pdf is counted.
    """

    def noise(index: Spectrum) -> float:
        scene = ball(materials.RoughDielectric, index, WHITE, alpha)
        images = exposures(scene, 64, 4)[:, 6:18, 6:18].mean(axis=-1)
        return float((images.var(axis=0) / images.mean(axis=0) ** 2).mean())

    flint = spectra.glass("sf11")
    ratio = noise(flint) / noise(spectra.Constant(float(flint.sample(550.0))))
    assert ratio < bound
