"""Cameras (UsdGeomCamera), and render settings and products: size and form of the picture."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from pxr import Usd, UsdGeom, UsdRender

from clpt import transforms
from clpt.formats.gltf.cameras_lights import FROM_GLTF, size
from clpt.formats.usd.document import Document
from clpt.scene.cameras import Camera, Orthographic, Perspective, ThinLens

POLICIES = (
    "expandAperture", "cropAperture", "adjustApertureWidth", "adjustApertureHeight",
    "adjustPixelAspectRatio",
)  # fmt: skip

# What renderers call their variables (RenderVar), in small letters, and the layer of the same
# content; None: the picture itself.
VARIABLES: dict[str, str | None] = {
    "ci": None, "color": None, "c.*": None, "beauty": None, "combined": None, "a": None,
    "alpha": None, "rgba": None, "rgb": None,
    "albedo": "albedo", "diffuse_albedo": "albedo", "diffusealbedo": "albedo",
    "n": "shading_normal", "nn": "shading_normal", "normal": "shading_normal",
    "ng": "geometric_normal", "ngn": "geometric_normal",
    "depth": "z", "z": "z", "cameradepth": "z", "lineardepth": "z", "distance": "depth",
    "p": "position", "pworld": "position", "position": "position", "worldposition": "position",
    "st": "uv", "uv": "uv", "motion": "motion", "motionvector": "motion",
    "id": "shape_id", "primid": "shape_id", "materialid": "material_id",
    "elementid": "primitive_id", "variance": "variance", "samplecount": "samples",
    "cryptoobject": "crypto_object", "crypto_object": "crypto_object",
    "cryptomaterial": "crypto_material", "crypto_material": "crypto_material",
    "direct": "direct", "indirect": "indirect",
}  # fmt: skip


@dataclass(frozen=True)
class Settings:
    """The picture of a stage, as its settings say.

    camera: a prim path, or None. size: of the picture [pixels], or None. policy: of POLICIES, how
    the camera's aperture gets the picture's form. still: without motion blur. sharp: without depth
    of field. layers: that its variables are.
    """

    camera: str | None = None
    size: tuple[int, int] | None = None
    policy: str = POLICIES[0]
    still: bool = False
    sharp: bool = False
    layers: tuple[str, ...] = ()

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
    return Settings(
        camera, pixels, policy, bool(still), bool(sharp), _layers(document, sources[1:])
    )


def _layers(document: Document, products: list[Usd.Prim]) -> tuple[str, ...]:
    """Return the layers that the variables of products name, each once."""
    names: list[str] = []
    for product in products:
        for path in product.GetRelationship("orderedVars").GetTargets():
            variable = document.stage.GetPrimAtPath(path)
            source = str(_authored(variable, "sourceName", path.name)) if variable else path.name
            known = source.rpartition(":")[2].lower()  # without a renderer's name before it
            if known not in VARIABLES:
                document.warn(f"the variable {source!r} is left out", path)
            elif (layer := VARIABLES[known]) is not None:
                names.append(layer)
    return tuple(dict.fromkeys(names))


def _authored(prim: Usd.Prim, name: str, default: object) -> Any:
    """Return an attribute's value that a file has, else the default."""
    attribute = prim.GetAttribute(name)
    return attribute.Get() if attribute and attribute.HasAuthoredValue() else default


TENTH = 0.1  # of a unit of the stage: the unit of focal lengths and apertures
FAR = 1e30  # [m] where the file's far plane is none


def camera(document: Document, prim: Usd.Prim, settings: Settings) -> Camera:
    """Return a camera for a picture of the settings' form."""
    view = UsdGeom.Camera(prim).GetCamera(document.time)
    to_world = transforms.rigid(document.to_metres @ document.placement(prim)) @ FROM_GLTF
    width, height = view.horizontalAperture, view.verticalAperture
    if not (width > 0.0 and height > 0.0):
        raise document.error("its apertures must be above 0", prim.GetPath())
    unit = TENTH * document.metres
    near, far = view.clippingRange.min * document.metres, view.clippingRange.max * document.metres
    shared: dict[str, Any] = {"near": max(near, 0.0), "far": far if far > near else FAR}
    width, height = settings.aperture(width, height)
    if view.projection == view.Orthographic:
        half = 0.5 * width * unit
        return Orthographic(to_world=to_world @ transforms.scale([half, half, 1.0]), **shared)
    if not view.focalLength > 0.0:
        raise document.error("its focal length must be above 0", prim.GetPath())
    shared |= {
        "to_world": to_world,
        "fov": math.degrees(2.0 * math.atan(0.5 * width / view.focalLength)),
        "offset_x": view.horizontalApertureOffset / width,
        "offset_y": -view.verticalApertureOffset / height,
    }
    if view.fStop > 0.0 and view.focusDistance > 0.0 and not settings.sharp:
        radius = 0.5 * view.focalLength * unit / view.fStop
        focus = view.focusDistance * document.metres
        return ThinLens(aperture_radius=radius, focus_distance=focus, **shared)
    return Perspective(**shared)


def picture_size(document: Document, prim: Usd.Prim) -> tuple[int, int]:
    """Return width and height of a picture that has the form of a camera's aperture."""
    view = UsdGeom.Camera(prim).GetCamera(document.time)
    return size(view.aspectRatio if view.aspectRatio > 0.0 else 1.0)


def exposure(document: Document, prim: Usd.Prim) -> float:
    """Return the stops by which a camera brightens the picture."""
    scale = UsdGeom.Camera(prim).ComputeLinearExposureScale(document.time)
    return math.log2(scale) if scale > 0.0 and math.isfinite(scale) else 0.0
