"""The contract of lights off all shapes: samples lie within bounds(), their power is extent().

`python -m tests.kernels.kind_contract NAME...` checks kinds of the package that Python finds: a
test runs it beside a copy of the package that has kinds of the tests' own (`strangers.py`).
"""

from __future__ import annotations

import dataclasses
import sys
from typing import Any

import numpy as np

from clpt import transforms
from clpt.scene import lights
from clpt.scene.params import params
from clpt.scene.roles import EMISSION
from tests.kernels.light_probe import lit

SIGMAS = 5.0  # of a mean: a chance of 6e-7 for each check
PLACE = transforms.translate([0.3, -0.2, 0.4]) @ transforms.rotate([1, 2, 3], 50.0)
SAMPLE = """
    vec2 u = {x[4], x[5]};
    vec3 p = v3(x[0], x[1], x[2]);
    Receiver side = {v3(x[6], x[7], x[8])};
    LightSample s = light_sample(scene, p, side, x[3], u, lambdas);
    r[0] = s.wi.x; r[1] = s.wi.y; r[2] = s.wi.z; r[3] = s.t;
    r[4] = sel(s.pdf == 0.0f, (real)(0.0f), s.radiance.x);
"""
NUMBERS = (1, 40, 10_000)
LAMPS = [cls for cls in lights.KINDS if cls.reach == "placed"]


def lamp_of(cls: type[lights.Light], strength: float = 1.0, place: Any = PLACE) -> lights.Light:
    """Return a light with an emission of a strength at a place."""
    names = {field.name for field in dataclasses.fields(cls)}
    emission = next(name for name, param in params(cls).items() if param.role is EMISSION)
    at = {"to_world": place} if "to_world" in names else {"position": place[:3, 3]}
    return cls(**at, **{emission: strength})


def sampled(scene: Any, points: np.ndarray, normal: np.ndarray, seed: int) -> np.ndarray:
    """Return wi, t and radiance (5, n) of samples from points (3, n) with normals (3, n)."""
    u = np.random.default_rng(seed).random((3, points.shape[1]))
    return np.asarray(scene(SAMPLE, np.vstack([points, u, normal]), 5), float)


def on_sphere(count: int, seed: int) -> np.ndarray:
    d = np.random.default_rng(seed).normal(size=(3, count))
    return d / np.linalg.norm(d, axis=0)


def check_bounds(cls: type[lights.Light]) -> None:
    """Each point that shines lies within the box, and each ray within the cone."""
    lamp = lamp_of(cls)
    bounds = lamp.bounds()
    if bounds is None:
        return
    count = 1 << 14
    centre = 0.5 * (bounds.low + bounds.high)[:, None]
    points = centre + on_sphere(count, 2) * np.random.default_rng(3).uniform(0.2, 9.0, count)
    r = sampled(lit([lamp]), points, np.zeros_like(points), 4)
    shines = r[4] > 0.0
    assert shines.any(), cls.kind
    met = (points + r[:3] * r[3])[:, shines]
    slack = 1e-4
    assert (met >= bounds.low[:, None] - slack).all(), f"{cls.kind} shines below its box"
    assert (met <= bounds.high[:, None] + slack).all(), f"{cls.kind} shines above its box"
    angle = np.arccos(np.clip(-bounds.axis @ r[:3, shines], -1.0, 1.0))
    assert angle.max() <= bounds.theta_o + bounds.theta_e + 1e-3, f"{cls.kind} leaves its cone"


def check_power(cls: type[lights.Light]) -> None:
    """The power through a sphere is that of extent(), or of sampling_power() without one."""
    lamp = lamp_of(cls)
    powered = isinstance(lamp, lights.PoweredLamp)
    expected = lamp.extent(0.0) if powered else lamp.sampling_power(1.0, 1.0, 1.0)
    radius, count = 40.0, 1 << 18
    d = on_sphere(count, 5)
    points = PLACE[:3, 3][:, None] + radius * d
    r = sampled(lit([lamp]), points, np.zeros_like(points), 6)
    through = -(r[:3] * d).sum(axis=0) * r[4] * 4.0 * np.pi * radius**2
    error = SIGMAS * through.std() / np.sqrt(count) + 2e-3 * expected
    assert abs(through.mean() - expected) < error, (cls.kind, through.mean(), expected, error)


def check_number(cls: type[lights.Light], number: int) -> None:
    """Lights of 1 / n each light a floor as a single one does, where it stands half below it."""
    place = transforms.translate([1.0, 0.0, -0.5]) @ transforms.rotate([0, 1, 0], 90.0)
    count = 1 << 16
    points = np.zeros((3, count))
    normal = np.tile([[0.0], [0.0], [1.0]], count)
    means = []
    for many in (1, number):
        scene = lit([lamp_of(cls, 1.0 / many, place)] * many, tree=many > 1)
        r = sampled(scene, points, normal, 7 + many)
        values = np.maximum(r[2], 0.0) * r[4]
        means.append((values.mean(), values.std() / np.sqrt(count)))
    (one, error), (many_mean, many_error) = means
    allowed = SIGMAS * float(np.hypot(error, many_error)) + 1e-6
    assert abs(one - many_mean) < allowed, (cls.kind, number, one, many_mean, allowed)


def main() -> None:
    for cls in LAMPS:
        if cls.__name__ in sys.argv[1:]:
            check_bounds(cls)
            check_bounds(cls)
            check_power(cls)
            for number in NUMBERS:
                check_number(cls, number)
            print(cls.__name__, "keeps its contract", cls().bounds() is not None)


if __name__ == "__main__":
    main()
