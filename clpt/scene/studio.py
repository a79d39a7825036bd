"""The studio of a bare mesh: a camera that frames it, a backdrop, a warm and a cool light."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from clpt import spectra, transforms
from clpt.errors import SceneError
from clpt.scene import cameras, integrators, lights, shapes
from clpt.scene.framing import direction, framing_camera, middle, world_bounds
from clpt.scene.materials import Diffuse
from clpt.spectra import RGBIlluminant

Up = Literal["y", "z"]

BELOW = 1e-3  # radii from the shapes down to the ground: flat shapes do not lie in it
KEY_FROM = (-0.8, 1.3, 0.7)  # direction from the centre of the scene to the key light, +y up
KEY_IRRADIANCE = RGBIlluminant(4.6, 3.9, 3.1)  # at the centre, warm
FILL = RGBIlluminant(0.26, 0.33, 0.42)  # radiance from all sides, cool
PAPER = 0.36  # albedo of the backdrop
FLOOR, BEND, WALL = 24.0, 12.0, 40.0  # radii of the backdrop's floor and bend, and its height
SIDES, RINGS = 96, 17  # of the backdrop around its middle, and along its bend
Z_UP = transforms.rotate([1.0, 0.0, 0.0], 90.0)
# From a space whose up is +y and whose front is +z.
UPS: dict[str, transforms.Matrix] = {"y": transforms.IDENTITY, "z": Z_UP}


def parts(
    scene_shapes: Sequence[shapes.Shape],
    *,
    camera: cameras.Camera | None = None,
    own_lights: Sequence[lights.Light] = (),
    up: Up = "y",
) -> dict[str, Any]:
    """Return the arguments of a Scene of shapes; the studio adds a camera or lights if missing.

    Without lights it adds a constant light and a key light. The key light is a square above a
    ground if the camera is the studio's too, else a directional light. `extra["studio"]` counts
    what was added. Raises SceneError for shapes too large to be framed.
    """
    if up not in UPS:
        raise SceneError(f"{up!r} is none of {', '.join(UPS)}", where="up")
    turn = UPS[up]
    low, high = world_bounds(scene_shapes)
    centre, radius = middle(low, high)
    extra_shapes: list[shapes.Shape] = []
    extra_lights: list[lights.Light] = []
    if not own_lights:
        extra_lights = [lights.Constant(radiance=FILL)]
        if camera is None:
            floor, axis = centre.copy(), int(np.argmax(turn[:3, 1]))
            floor[axis] = low[axis] - BELOW * radius
            extra_shapes = [_backdrop(floor, radius, turn), _key(centre, radius, turn)]
        else:
            extra_lights.append(_distant_key(turn))
    counts = {"shapes": len(extra_shapes), "lights": len(extra_lights)}
    added = {"camera": camera is None, **counts, "up": up}
    return {
        "camera": camera or framing_camera(scene_shapes, turn),
        "shapes": [*scene_shapes, *extra_shapes],
        "lights": [*own_lights, *extra_lights],
        "film": integrators.Film(filter=integrators.Gaussian()),
        "extra": {"studio": added},
    }


def _backdrop(floor: NDArray[np.float64], radius: float, up: transforms.Matrix) -> shapes.Shape:
    """Return a dish: a floor around a point that curves up to a wall on all sides, without a seam.

    So the camera may stand anywhere within it, and sees no horizon.
    """
    turn = np.linspace(0.0, 0.5 * np.pi, RINGS)
    out = np.concatenate([[0.0], FLOOR + BEND * np.sin(turn), [FLOOR + BEND]])
    high = np.concatenate([[0.0], BEND * (1.0 - np.cos(turn)), [WALL]])
    around = 2.0 * np.pi * np.arange(SIDES) / SIDES
    points = np.stack(
        [
            np.outer(out, np.sin(around)),
            np.outer(high, np.ones(SIDES)),
            np.outer(out, np.cos(around)),
        ],
        axis=-1,
    )
    here = np.arange(len(out) - 1)[:, None] * SIDES + np.arange(SIDES)
    beside = np.arange(len(out) - 1)[:, None] * SIDES + (np.arange(SIDES) + 1) % SIDES
    inner = np.stack([here, here + SIDES, beside + SIDES], axis=-1)
    outer = np.stack([here, beside + SIDES, beside], axis=-1)[1:]  # none at the middle
    faces = np.concatenate([inner.reshape(-1, 3), outer.reshape(-1, 3)]).astype(np.uint32)
    return shapes.Mesh(
        vertices=points.reshape(-1, 3).astype(np.float32),
        faces=faces,
        normals=shapes.SMOOTH,
        to_world=transforms.translate(floor) @ up @ transforms.scale(radius),
        material=Diffuse(reflectance=PAPER),
        name="backdrop",
    )


def _distant_key(up: transforms.Matrix) -> lights.Light:
    """Return a light about as bright as the square light, from the same side."""
    return lights.Directional(direction=tuple(-direction(KEY_FROM, up)), irradiance=KEY_IRRADIANCE)


def _key(centre: NDArray[np.float64], radius: float, up: transforms.Matrix) -> shapes.Shape:
    """Return a square light of 3 radii, 4 radii away from the centre, that faces it."""
    origin = centre + 4.0 * radius * direction(KEY_FROM, up)
    to_world = transforms.look_at(origin, centre, up[:3, 1]) @ transforms.scale(1.5 * radius)
    return shapes.Rectangle(
        to_world=to_world,
        material=Diffuse(reflectance=0.0),
        emission=lights.Area(radiance=spectra.scaled(KEY_IRRADIANCE, 16.0 / 9.0)),
        name="key light",
    )
