"""Render settings and products: the camera, the size and the form of the picture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pxr import Usd, UsdRender

from clpt.formats.usd.document import Document

POLICIES = (
    "expandAperture", "cropAperture", "adjustApertureWidth", "adjustApertureHeight",
    "adjustPixelAspectRatio",
)  # fmt: skip


@dataclass(frozen=True)
class Settings:
    """The picture of a stage, as its settings say.

    camera: a prim path, or None. size: of the picture [pixels], or None. policy: of POLICIES, how
    the camera's aperture gets the picture's form. still: without motion blur. sharp: without depth
    of field.
    """

    camera: str | None = None
    size: tuple[int, int] | None = None
    policy: str = POLICIES[0]
    still: bool = False
    sharp: bool = False

    def aperture(self, width: float, height: float) -> tuple[float, float]:
        """Return a camera's aperture in the form of the picture."""
        if self.size is None or self.policy == "adjustPixelAspectRatio":
            return width, height
        aspect = self.size[0] / self.size[1]
        wider = aspect > width / height
        if self.policy == "cropAperture":
            wider = not wider
        if self.policy.startswith("adjustAperture"):
            wider = self.policy == "adjustApertureWidth"
        return (height * aspect, height) if wider else (width, width / aspect)


def settings(document: Document, shown: list[Usd.Prim]) -> Settings:
    """Return the settings of the stage's metadata, else those of its only RenderSettings prim.

    shown: its RenderSettings prims. What the first product says counts before them.
    """
    stage = document.stage
    prim = UsdRender.Settings.GetStageRenderSettings(stage).GetPrim()
    if not prim:
        prim = shown[0] if len(shown) == 1 else None
    if not prim:
        return Settings()
    sources = [prim]
    products = prim.GetRelationship("products").GetTargets()
    if products and stage.GetPrimAtPath(products[0]):
        sources.append(stage.GetPrimAtPath(products[0]))
    camera, size, policy = None, None, POLICIES[0]
    for source in sources:
        targets = source.GetRelationship("camera").GetTargets()
        camera = str(targets[0]) if targets else camera
        size = _authored(source, "resolution", size)
        policy = _authored(source, "aspectRatioConformPolicy", policy)
    if policy not in POLICIES:
        document.warn(
            f"aspectRatioConformPolicy {policy!r} is read as {POLICIES[0]}", prim.GetPath()
        )
    still = (
        prim.GetAttribute("disableMotionBlur").Get()
        or prim.GetAttribute("instantaneousShutter").Get()
    )
    sharp = prim.GetAttribute("disableDepthOfField").Get()
    pixels = None if size is None else (max(int(size[0]), 1), max(int(size[1]), 1))
    return Settings(camera, pixels, policy, bool(still), bool(sharp))


def _authored(prim: Usd.Prim, name: str, default: object) -> Any:
    """Return an attribute's value that a file has, else the default."""
    attribute = prim.GetAttribute(name)
    return attribute.Get() if attribute and attribute.HasAuthoredValue() else default
