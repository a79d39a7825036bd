# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras and views of viewports as cameras of clpt, and the parts of pictures to render."""

from __future__ import annotations

import math
from typing import Any

import bpy
from mathutils import Matrix

from . import measured
from .graphs import Json
from .lights import TO_CLPT, listed, rigid

NOWHERE: Json = {"type": "perspective", "to_world": [
    {"look_at": {"origin": [7, -7, 5], "target": [0, 0, 0], "up": [0, 0, 1]}}
]}  # fmt: skip
WHOLE = (math.pi, 0.5 * math.pi)  # of a panorama of all directions


def final(source: Any, window: Matrix) -> tuple[Json, str]:
    """Return the camera of a scene, and what is lost. window: its projection."""
    camera, place = source.data, rigid(source.matrix_world) @ TO_CLPT
    lost = ""
    ends = {"near": camera.clip_start, "far": camera.clip_end}
    if camera.type == "ORTHO":
        half = 1.0 / window[0][0]
        place = place @ Matrix.Diagonal((half, half, 1.0, 1.0))
        described = {"type": "orthographic", **ends}
    elif _sees_all(camera):
        described = {"type": "spherical"}
    else:
        if camera.type != "PERSP":
            lost = f"the camera {camera.type.title()} is read as a perspective"
        described = _through(source, source.matrix_world, window, ends)
    return {**described, "to_world": listed(place)}, lost


def _sees_all(camera: Any) -> bool:
    """Return whether a camera is a panorama in latitude and longitude of all directions."""
    if camera.type != "PANO" or camera.panorama_type != "EQUIRECTANGULAR":
        return False
    ends = camera.longitude_max, camera.latitude_max, -camera.longitude_min, -camera.latitude_min
    return all(abs(end - whole) < 1e-5 for end, whole in zip(ends, WHOLE * 2, strict=True))


def view(context: Any) -> Json:
    """Return the view of a 3D viewport as a camera; its width is all that the region shows."""
    shown, space = context.region_data, context.space_data
    window, place = shown.window_matrix, shown.view_matrix.inverted()
    if shown.is_perspective:
        through = context.scene.camera if shown.view_perspective == "CAMERA" else None
        ends = {"near": space.clip_start, "far": space.clip_end}
        described = _through(through, place, window, ends)
    else:
        depth = -2.0 / window[2][2]  # what is seen begins behind the view's place
        near = (window[2][3] + 1.0) / window[2][2]
        half = 1.0 / window[0][0]
        middle = Matrix.Translation((-window[0][3] * half, -window[1][3] / window[1][1], -near))
        place = place @ middle @ Matrix.Diagonal((half, half, 1.0, 1.0))
        described = {"type": "orthographic", "near": 0.0, "far": depth}
    return {**described, "to_world": listed(place @ TO_CLPT)}


def _through(source: Any, matrix: Matrix, window: Matrix, ends: Json) -> Json:
    """Return a perspective, with the depth of field or the real lens of a camera at a place.

    source: the camera, None for a view without one; ends: what is too near and too far.
    """
    described: Json = {
        "type": "perspective", "fov_axis": "x",
        "fov": math.degrees(2.0 * math.atan(1.0 / window[0][0])),
        "offset_x": 0.5 * window[0][2], "offset_y": -0.5 * window[1][2], **ends,
    }  # fmt: skip
    if source is None:
        return described
    camera, focus = source.data, source.data.dof.focus_distance
    if camera.dof.focus_object is not None:
        focus = (camera.dof.focus_object.matrix_world.translation - matrix.translation).length
    if camera.clpt.lens:
        width = 2e-3 * camera.lens / window[0][0]
        return measured.lens(camera, width, focus if camera.dof.use_dof else focus or 10.0)
    if camera.dof.use_dof:
        radius = 0.5e-3 * camera.lens / camera.dof.aperture_fstop
        described |= {"type": "thin_lens", "aperture_radius": radius, "focus_distance": focus}
    return described


# ---- parts of pictures: x, y from above, width, height

Part = tuple[int, int, int, int]


def border(render: bpy.types.RenderSettings, width: int, height: int) -> Part:
    """Return the part of a final picture that is rendered."""
    left, right = (int(share * width) for share in (render.border_min_x, render.border_max_x))
    below, above = (int(share * height) for share in (render.border_min_y, render.border_max_y))
    return left, height - above, max(right - left, 1), max(above - below, 1)


def view_border(context: Any, depsgraph: Any) -> Part | None:
    """Return the part of a viewport that is rendered, None for all of it."""
    space, shown, render = context.space_data, context.region_data, context.scene.render
    through = shown.view_perspective == "CAMERA" and context.scene.camera is not None
    holder = render if through else space
    name = "border" if through else "render_border"
    if not (render.use_border if through else space.use_render_border):
        return None
    shares = [getattr(holder, f"{name}_{end}_{axis}") for axis in "xy" for end in ("min", "max")]
    if through:
        shares = _of_camera(shares, context, depsgraph)
    width, height = context.region.width, context.region.height
    across = [min(max(int(share * width), 0), width) for share in shares[:2]]
    up = [min(max(int(share * height), 0), height) for share in shares[2:]]
    if across[0] == across[1] or up[0] == up[1]:
        return None
    return across[0], height - up[1], across[1] - across[0], up[1] - up[0]


def _of_camera(shares: list[float], context: Any, depsgraph: Any) -> list[float]:
    """Return shares of a camera's frame, twice of x and of y, as shares of the region."""
    render, region = context.scene.render, context.region_data.window_matrix
    frame = context.scene.camera.calc_matrix_camera(
        depsgraph, x=render.resolution_x, y=render.resolution_y,
        scale_x=render.pixel_aspect_x, scale_y=render.pixel_aspect_y,
    )  # fmt: skip
    column = 2 if context.region_data.is_perspective else 3
    sign = -1.0 if column == 2 else 1.0
    found = []
    for number, share in enumerate(shares):
        axis = number // 2
        slope = (2.0 * share - 1.0 - sign * frame[axis][column]) / frame[axis][axis]
        found.append(0.5 + 0.5 * (region[axis][axis] * slope + sign * region[axis][column]))
    return found
