"""The studio of a bare mesh: a camera that frames it, a ground and a soft light."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from clpt import transforms
from clpt.errors import SceneError
from clpt.scene import cameras, integrators, lights, shapes
from clpt.scene.framing import direction, framing_camera, middle, world_bounds
from clpt.scene.materials import Diffuse
from clpt.spectra import RGBIlluminant

Up = Literal["y", "z"]

BELOW = 1e-3  # radii from the shapes down to the ground: flat shapes do not lie in it
KEY_FROM = (-0.8, 1.3, 0.7)  # direction from the centre of the scene to the key light, +y up
Z_UP = transforms.rotate([1.0, 0.0, 0.0], 90.0)
# From a space whose up is +y and whose front is +z.
UPS: dict[str, transforms.Matrix] = {"y": transforms.IDENTITY, "z": Z_UP}


def parts(
    things: Sequence[shapes.Shape],
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
    low, high = world_bounds(things)
    centre, radius = middle(low, high)
    extra_shapes: list[shapes.Shape] = []
    extra_lights: list[lights.Light] = []
    if not own_lights:
        extra_lights = [lights.Constant(radiance=RGBIlluminant(0.35, 0.35, 0.35))]
        if camera is None:
            floor, axis = centre.copy(), int(np.argmax(turn[:3, 1]))
            floor[axis] = low[axis] - BELOW * radius
            extra_shapes = [_ground(floor, radius, turn), _key(centre, radius, turn)]
        else:
            extra_lights.append(_distant_key(turn))
    added = {
        "camera": camera is None,
        "shapes": len(extra_shapes),
        "lights": len(extra_lights),
        "up": up,
    }
    return {
        "camera": camera or framing_camera(things, turn),
        "shapes": [*things, *extra_shapes],
        "lights": [*own_lights, *extra_lights],
        "film": integrators.Film(filter=integrators.Gaussian()),
        "extra": {"studio": added},
    }


def _ground(floor: NDArray[np.float64], radius: float, up: transforms.Matrix) -> shapes.Shape:
    flat = up @ transforms.rotate([1.0, 0.0, 0.0], -90.0)
    to_world = transforms.translate(floor) @ flat @ transforms.scale(40.0 * radius)
    return shapes.Disk(to_world=to_world, material=Diffuse(reflectance=0.5), name="ground")


def _distant_key(up: transforms.Matrix) -> lights.Light:
    """Return a light about as bright as the square one, from the same side."""
    return lights.Directional(
        direction=tuple(-direction(KEY_FROM, up)), irradiance=RGBIlluminant(4.0, 4.0, 4.0)
    )


def _key(centre: NDArray[np.float64], radius: float, up: transforms.Matrix) -> shapes.Shape:
    """Return a square light of 3 radii, 4 radii away from the centre, that faces it."""
    origin = centre + 4.0 * radius * direction(KEY_FROM, up)
    to_world = transforms.look_at(origin, centre, up[:3, 1]) @ transforms.scale(1.5 * radius)
    return shapes.Rectangle(
        to_world=to_world,
        material=Diffuse(reflectance=0.0),
        emission=lights.Area(radiance=RGBIlluminant(8.0, 8.0, 8.0)),
        name="key light",
    )
