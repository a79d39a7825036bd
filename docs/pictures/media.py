"""Pictures of media and phase functions: three balls each, of what scatters, before a lamp."""

from __future__ import annotations

from typing import Any

import numpy as np

from clpt import mie
from clpt.scene import Scene, integrators, media, phases, shapes
from clpt.scene.materials import Null
from clpt.transforms import scale, translate

from .materials import blue_lamp, dye
from .studio import PLACES, Array, Picture, studio

BLUE: dict[str, Any] = {"mode": "spectral", "lamps": blue_lamp(), "dim": 0.05}
STEPS = np.linspace(0.0, 1.0, 9)
WHITE, AMBER, WINE = (5.0, 5.0, 5.0), (1.5, 4.0, 9.0), (0.4, 5.0, 4.4)


def balls(caption: str, *made: media.Medium, spp: int = 128, **lit: Any) -> Picture:
    """Balls of three media, from left to right; lit: of `studio`."""

    def scene() -> Scene:
        things = [
            shapes.Sphere(center=(x, 0.56, 0.0), radius=0.55, material=Null(), interior=medium)
            for medium, x in zip(made, PLACES, strict=True)
        ]
        made_scene = studio(list(things), **lit)
        made_scene.integrator = integrators.Path(max_depth=100)
        return made_scene

    return Picture(caption, scene, spp)


def _ball(density: Array, x: float, **given: Any) -> media.Grid:
    """A density in the box around one of the balls."""
    box = translate([x - 0.55, 0.01, -0.55]) @ scale(1.1)
    return media.Grid(density=density, to_world=box, scale=2.0, **{"albedo": 0.95, **given})


def _phases(caption: str, *made: phases.Phase) -> Picture:
    return balls(caption, *(media.Homogeneous(sigma_s=3.0, phase=one) for one in made))


def _drops(radius: float) -> media.Medium:
    """Mist of drops of water of a radius [m], as dense for all."""
    fog = mie.droplets(
        mie.sizes("log_normal", radius, 0.05, 24), 1e-7, lambdas=np.arange(390.0, 721.0, 30.0)
    )
    return media.Homogeneous(sigma_s=3.0, phase=fog.phase)


MEDIA = {
    "homogeneous": balls(
        "mist; amber, whose extinction depends on the wavelength; wine, which only absorbs",
        media.Homogeneous(sigma_s=WHITE),
        media.Homogeneous(sigma_t=AMBER, albedo=(0.999, 0.99, 0.96)),
        media.Homogeneous(sigma_a=WINE),
    ),
    "grid": balls(
        "a density of 12^3 random numbers; bands; smoke that thins out upward, and absorbs by "
        "wavelength",
        _ball(np.random.default_rng(3).random((12, 12, 12)) ** 4, -1.42, sigma_s=40.0),
        _ball((np.arange(9) % 2.0)[None, :, None], 0.0, sigma_s=14.0),
        _ball((1.0 - np.linspace(0.0, 1.0, 24))[None, :, None] ** 2, 1.42, sigma_t=AMBER),
    ),
    "cloud": balls(
        "`wispiness` of 0, 1 and 4; `density` of 1, 2 and 4",
        *(
            media.Cloud(
                sigma_s=60.0,
                wispiness=wispiness,
                density=density,
                low=(0.0, 0.3, 0.0),
                high=(1.0, 1.0, 1.0),
                to_world=translate([x - 0.55, -0.33, -0.55]) @ scale([1.1, 1.45, 1.1]),
            )
            for x, wispiness, density in ((-1.42, 0.0, 1.0), (0.0, 1.0, 2.0), (1.42, 4.0, 4.0))
        ),
    ),
    "dyed": balls(
        "under a blue lamp: `strength` of 0.5, 4 and 32 of a dye that gives out orange",
        *(
            media.Dyed(dye=dye()["reradiation"], strength=strength, sigma_s=0.3)
            for strength in (0.5, 4.0, 32.0)
        ),
        **BLUE,
    ),
    "soot": balls(
        "soot of 0.01, 0.04 and 0.16 millionths, as hot as a candle",
        *(
            media.Soot(
                density=np.ones((2, 2, 2)),
                share=share * 1e-8,
                temperature=np.full((2, 2, 2), 1900.0),
                brightness=0.3,
                to_world=translate([x - 0.55, 0.01, -0.55]) @ scale(1.1),
            )
            for x, share in ((-1.42, 1.0), (0.0, 4.0), (1.42, 16.0))
        ),
    ),
    "mixture": balls(
        "mist that thins out upward; wine that thins out downward; a mixture of both",
        *(
            media.Mixture(
                parts=tuple(
                    _ball(STEPS[None, ::way, None], x, **given)
                    for way, given in (
                        (-1, {"sigma_t": 4.0}),
                        (1, {"sigma_t": WINE, "albedo": 0.0}),
                    )
                    if way in ways
                )
            )
            for x, ways in ((-1.42, (-1,)), (0.0, (1,)), (1.42, (-1, 1)))
        ),
    ),
}
PHASES = {
    "isotropic": balls(
        "extinction of 1, 4 and 16 a metre",
        *(media.Homogeneous(sigma_s=each) for each in (1.0, 4.0, 16.0)),
    ),
    "henyey_greenstein": _phases(
        "`g` of -0.6, 0.3 and 0.9", *(phases.HenyeyGreenstein(g=g) for g in (-0.6, 0.3, 0.9))
    ),
    "rayleigh": balls(
        "`sigma_s` by the fourth power of the wavelength: 0.5, 2 and 8 times",
        *(
            media.Homogeneous(sigma_s=(0.55, 1.1, 2.6), scale=k, phase=phases.Rayleigh())
            for k in (0.5, 2.0, 8.0)
        ),
    ),
    "draine": _phases(
        "`g` of 0.6 and `alpha` of 0, 1 and 30",
        *(phases.Draine(g=0.6, alpha=alpha) for alpha in (0.0, 1.0, 30.0)),
    ),
    "reradiating": balls(
        "under a blue lamp: `amount` of 0, 0.4 and 1 of a dye that gives out orange",
        *(
            media.Homogeneous(
                sigma_s=6.0,
                phase=phases.Reradiating(
                    reflectance=0.3, reradiation=dye()["reradiation"], amount=amount
                ),
            )
            for amount in (0.0, 0.4, 1.0)
        ),
        **BLUE,
    ),
    "tabulated": balls(
        "drops of water of 0.05, 0.5 and 5 um of radius, by `clpt mie`",
        *(_drops(radius) for radius in (5e-8, 5e-7, 5e-6)),
    ),
    "blend": _phases(
        "of `g` of -0.7 and 0.9, with a `weight` of 0, 0.5 and 1",
        *(
            phases.Blend(
                weight=weight,
                first=phases.HenyeyGreenstein(g=-0.7),
                second=phases.HenyeyGreenstein(g=0.9),
            )
            for weight in (0.0, 0.5, 1.0)
        ),
    ),
}
