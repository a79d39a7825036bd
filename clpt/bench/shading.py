"""Cost of each kind of material: shaded items a second, beside `diffuse`.

A closed box has a single material, so that all slots shade this kind in every bounce. The yardstick
is a box of constant `diffuse`, which takes turns with each other kind.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from clpt import device, transforms
from clpt.bench.figures import Figure, Taken, clock_complaint
from clpt.bench.launches import Flight
from clpt.errors import UnknownKindError
from clpt.scene import Scene, integrators, lights, params, textures
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Film
from clpt.scene.materials import LEAVES, Diffuse, Material
from clpt.scene.roles import REFLECTANCE
from clpt.scene.shapes import Rectangle, Shape

MODES = ("rgb", "spectral")
VARIANTS = ("constant", "textured", "full")
TEXELS = 1024  # along each side of the image
WARM, BOUNCES = 4, 4
_X, _Y = (1, 0, 0), (0, 1, 0)
_SIDES = ((_X, 0), (_X, 90), (_X, 180), (_X, 270), (_Y, 90), (_Y, 270))


def variants(cls: type[Material]) -> dict[str, Material]:
    """Return a kind's materials by names of VARIANTS, where they exist.

    constant: all defaults; textured: the first colour is an image; full: shares with a default of 0
    are positive, so that no lobe is left out.
    """
    materials = {"constant": cls()}
    declared, usual = params.device_params(cls), params.defaults(cls)
    colours = [n for n, p in declared.items() if p.role is REFLECTANCE and p.textured]
    if colours:
        image: dict[str, Any] = {colours[0]: _image()}
        materials["textured"] = cls(**image)
    lobes: dict[str, Any] = {
        name: 0.3
        for name, p in declared.items()
        if p.textured and (p.low, usual[name]) == (0.0, 0.0) and p.high <= 2.0
    }
    if lobes:
        materials["full"] = cls(**lobes)
    return materials


def _image() -> textures.Bitmap:
    """Noise of all colours: neighbouring texels differ."""
    texels = np.random.default_rng(3).integers(64, 192, (TEXELS, TEXELS, 3), np.uint8)
    return textures.Bitmap(image=texels)


def box(material: Material, mode: str) -> Scene:
    """A closed box of a material around the camera, with a lamp of the same material."""
    away = transforms.translate((0, 0, -1))  # so that its front faces the camera
    walls: list[Shape] = [
        Rectangle(
            material=material,
            to_world=transforms.rotate(axis, degrees) @ away,
            emission=None if degrees else lights.Area(radiance=(4.0, 4.0, 4.0)),
        )
        for axis, degrees in _SIDES
    ]
    view = transforms.look_at((0, 0, -0.9), (0.3, 0.2, 1), (0, 1, 0))
    return Scene(
        camera=Perspective(fov=90.0, to_world=view),
        shapes=walls,
        integrator=integrators.Path(max_depth=8),
        film=Film(mode=mode),
        name="box",
    )


def measure(
    on: device.Device,
    rounds: int,
    kinds: Sequence[str] = (),
    modes: Iterable[str] = MODES,
    slots: int | None = None,
) -> Iterator[Figure]:
    """Yield figures of kinds of materials, in Mitems/s; `more` has ratios to the yardstick.

    kinds: names of leaf materials, by default all. Raises UnknownKindError, DeviceError.
    """
    known = {cls.kind: cls for cls in LEAVES}
    for name in kinds:
        if name not in known:
            raise UnknownKindError("material", name, known)
    for mode in modes:
        yardstick = Flight(on, box(Diffuse(), mode), slots)
        for kind in kinds or known:
            for variant, material in variants(known[kind]).items():
                flight = Flight(on, box(material, mode), slots)
                yield _figure(f"{kind} {variant}", flight, yardstick, rounds)


def _figure(name: str, flight: Flight, yardstick: Flight, rounds: int) -> Figure:
    """Return a kind's figure, measured in turns with the yardstick."""
    for running in (flight, yardstick):
        running.restart()
        for _ in range(WARM):
            running.bounce()
    both = [(_shade(flight), _shade(yardstick)) for _ in range(rounds + 1)][1:]
    speeds, yardstick_speeds = (
        [items * 1e-6 / t.device for items, t in side] for side in zip(*both, strict=True)
    )
    ratio = float(np.median(np.divide(speeds, yardstick_speeds)))
    mode = flight.scene.film.mode
    more = {
        "mode": mode,
        "of_diffuse": ratio,
        "items": float(np.mean([items for (items, _), _ in both])),
        "lanes": flight.wavefront.lanes,
        "note": f"{mode}, {ratio:.2f} of diffuse",
    }
    figure = Figure("shading", name, "Mitems/s", tuple(speeds), flight.scene.name, more)
    return figure.refuse(clock_complaint(taken for (_, taken), _ in both))


def _shade(flight: Flight) -> tuple[int, Taken]:
    """Return the number of items shaded in a few bounces, and the time."""
    launches: list[tuple[int, Taken]] = []

    for step in flight.wavefront.stages * BOUNCES:
        if step.bound.kernel.name == "shade":
            launches.append(flight.timed(step))
        else:
            flight.stage(step)
    taken = Taken(sum(t.device for _, t in launches), sum(t.host for _, t in launches))
    return sum(items for items, _ in launches), taken
