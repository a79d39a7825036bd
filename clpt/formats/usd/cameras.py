"""Cameras: UsdGeomCamera, and the size of the picture."""

from __future__ import annotations

import math
from typing import Any

from pxr import Usd, UsdGeom

from clpt import transforms
from clpt.formats.gltf.cameras_lights import FROM_GLTF, size
from clpt.formats.usd.document import Document
from clpt.formats.usd.render_settings import Settings
from clpt.scene.cameras import Camera, Orthographic, Perspective, ThinLens

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
