"""The medium inside a glTF body: KHR_materials_volume and KHR_materials_volume_scatter.

A body lets light through and has a thickness. docs/gltf.md has the formulas.
"""

from __future__ import annotations

import math
from typing import Any

from clpt.formats.gltf.document import Element
from clpt.scene.insides import absorbed
from clpt.scene.media import Homogeneous

VOLUME = "KHR_materials_volume"
SCATTER = ("KHR_materials_volume_scatter", "KHR_materials_scatter")  # the same draft's two names
COLOURS = ("multiscatterColor", "multiscatterColorFactor", "scatterAlbedo")  # its drafts' names
SHARES = {  # of light that goes through a surface
    "KHR_materials_transmission": "transmissionFactor",
    "KHR_materials_diffuse_transmission": "diffuseTransmissionFactor",
}
STEEPEST = 0.99  # mean cosine: at 1 nothing would be scattered


def body(element: Element) -> Element | None:
    """Return the volume of a material that has an inside; None of sheets and of what is opaque."""
    volume = element.extension(VOLUME)
    if volume is None or volume.number("thicknessFactor", 0.0, low=0.0) == 0.0:
        return None
    given = {factor: element.extension(name) for name, factor in SHARES.items()}
    shares = [e.number(factor, 0.0) for factor, e in given.items() if e is not None]
    return volume if any(shares) else None


def extinction(volume: Element) -> Any:
    """Return how much light a metre takes away [1/m]: a number or RGBUnbounded.

    Raises SceneError for a distance of 0.
    """
    distance = volume.number("attenuationDistance", math.inf, low=0.0)
    if distance == 0.0:
        raise volume.error("must be above 0", "attenuationDistance")
    left = volume.numbers("attenuationColor", 3, (1.0, 1.0, 1.0), low=0.0, high=1.0)
    return absorbed(left, distance)


def medium(element: Element | None) -> Homogeneous | None:
    """Return what scatters light inside of a material's body; None where nothing does.

    Raises SceneError for numbers out of range.
    """
    volume = None if element is None else body(element)
    if element is None or volume is None:
        return None
    scatter = next((e for e in map(element.extension, SCATTER) if e is not None), None)
    if scatter is None:
        return None
    key = next((name for name in COLOURS if name in scatter), COLOURS[0])
    colour = scatter.numbers(key, 3, (0.0, 0.0, 0.0), low=0.0, high=1.0)
    g = scatter.number("scatterAnisotropy", 0.0, low=-1.0, high=1.0)
    if "multiscatterColorTexture" in scatter:
        scatter.warn("left out, since a body has one colour inside", "multiscatterColorTexture")
    taken = extinction(volume)
    if not any(colour) or taken == 0.0:
        return None
    made = Homogeneous.from_albedo(colour, 1.0, max(-STEEPEST, min(g, STEEPEST)))
    return Homogeneous(
        name=element.text("name", ""), phase=made.phase, albedo=made.albedo, sigma_t=taken
    )
