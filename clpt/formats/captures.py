"""Sets of calibrated pictures: COLMAP's text models and NeRF's transforms.json, in and out.

Both count pixels from the corner of the top left pixel, OpenCV and `calibrated` from its middle.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from clpt.errors import SceneError
from clpt.files import input_files, output_files
from clpt.scene.cameras import Calibrated
from clpt.scene.conventions import pose, to_world
from clpt.scene.motion import quaternion, rotation

COLMAP = {  # lengths: of focal lengths, then of coefficients, which stand behind cx and cy
    "SIMPLE_PINHOLE": ("opencv", 1, 0), "PINHOLE": ("opencv", 2, 0),
    "SIMPLE_RADIAL": ("opencv", 1, 1), "RADIAL": ("opencv", 1, 2), "OPENCV": ("opencv", 2, 4),
    "FULL_OPENCV": ("opencv", 2, 8), "SIMPLE_RADIAL_FISHEYE": ("kannala_brandt", 1, 1),
    "RADIAL_FISHEYE": ("kannala_brandt", 1, 2), "OPENCV_FISHEYE": ("kannala_brandt", 2, 4),
    "FOV": ("fov", 2, 1),
}  # fmt: skip
NERF = {"OPENCV": "opencv", "PINHOLE": "opencv", "SIMPLE_PINHOLE": "opencv",
        "OPENCV_FISHEYE": "kannala_brandt"}  # fmt: skip
KEYS = {
    "opencv": ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
    "kannala_brandt": ("k1", "k2", "k3", "k4"),
}  # of coefficients in a transforms.json


@dataclass(frozen=True)
class Capture:
    """A picture's file name, its camera, and its width and height [pixels]."""

    name: str
    camera: Calibrated
    width: int
    height: int


def read_colmap(folder: str | Path) -> list[Capture]:
    """Return the pictures of a COLMAP model as text: cameras.txt and images.txt.

    Raises SceneError with the line.
    """
    folder = Path(folder)
    models = dict(map(_colmap_camera, _rows(folder / "cameras.txt", 5)))
    captures = []
    for path, number, row in _rows(folder / "images.txt", 10, step=2):
        try:
            turn, shift = np.roll(np.array(row[1:5], float), -1), np.array(row[5:8], float)
            model, size = models[row[8]]
        except (ValueError, KeyError) as error:
            raise SceneError(f"is no image of a camera: {error}", file=path, line=number) from None
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = rotation(turn / np.linalg.norm(turn)), shift
        camera = Calibrated(**model, size=size, to_world=to_world(matrix, "colmap"))
        captures.append(Capture(" ".join(row[9:]), camera, *size))
    return captures


def _rows(path: Path, least: int, step: int = 1) -> list[tuple[Path, int, list[str]]]:
    """Return the words of each `step`-th line that is no comment, and its number."""
    lines = enumerate(input_files.read(path).splitlines(), 1)
    rows = [(path, number, line.split()) for number, line in lines if line[:1] != "#"]
    rows = rows[::step] if step > 1 else [row for row in rows if row[2]]
    for _, number, row in rows:
        if row and len(row) < least:
            message = f"{len(row)} words, not {least} or more"
            raise SceneError(message, file=path, line=number)
    return [row for row in rows if row[2]]


def _colmap_camera(row: tuple[Path, int, list[str]]) -> tuple[str, tuple[dict[str, Any], Any]]:
    path, line, (number, name, *words) = row
    try:
        model, focals, count = COLMAP[name]
        width, height, values = int(words[0]), int(words[1]), [float(word) for word in words[2:]]
    except (ValueError, KeyError):
        message = f"a camera {name} is not read; {', '.join(COLMAP)} are"
        raise SceneError(message, file=path, line=line) from None
    if len(values) != focals + 2 + count:
        message = f"{name} has {focals + 2 + count} parameters, not {len(values)}"
        raise SceneError(message, file=path, line=line)
    cx, cy, *distortion = values[focals:]
    if model == "opencv" and 0 < count < 4:  # COLMAP has less than OpenCV
        distortion += [0.0] * (4 - count)
    intrinsics = values[0], values[focals - 1], cx - 0.5, cy - 0.5
    camera = {"model": model, "intrinsics": intrinsics, "distortion": tuple(distortion)}
    return number, (camera, (width, height))


def write_colmap(folder: str | Path, captures: Iterable[Capture]) -> None:
    """Write cameras.txt, images.txt and an empty points3D.txt, a camera for each picture.

    Raises SceneError for a model that COLMAP does not have.
    """
    folder, cameras, images = Path(folder), [], []
    for number, capture in enumerate(captures, 1):
        camera = capture.camera
        count = max(len(camera.distortion), 4 if camera.distortion else 0)
        fits = [
            name for name, (model, focals, most) in COLMAP.items()
            if model == camera.model and focals == 2 and most >= count
        ]  # fmt: skip
        if not fits:
            message = f"COLMAP has no {camera.model} of {count} coefficients"
            raise SceneError(message, where=capture.name)
        fx, fy, cx, cy = camera.intrinsics
        values = [fx, fy, cx + 0.5, cy + 0.5, *camera.distortion]
        values += [0.0] * (4 + COLMAP[fits[0]][2] - len(values))
        size = f"{capture.width} {capture.height}"
        cameras.append(f"{number} {fits[0]} {size} {' '.join(map(repr, map(float, values)))}")
        matrix = pose(camera.to_world, "colmap")
        row = map(repr, map(float, (*np.roll(quaternion(matrix[:3, :3]), 1), *matrix[:3, 3])))
        images.append(f"{number} {' '.join(row)} {number} {capture.name}\n")
    folder.mkdir(parents=True, exist_ok=True)
    for name, lines in (("cameras", cameras), ("images", images), ("points3D", [])):
        output_files.write_text(folder / f"{name}.txt", "\n".join(lines) + "\n")


def read_transforms(path: str | Path, size: tuple[int, int] | None = None) -> list[Capture]:
    """Return the frames of a transforms.json of NeRF, Instant NGP or Nerfstudio.

    size: (width, height) [pixels] of files without `w` and `h`. Raises SceneError.
    """
    try:
        document = json.loads(input_files.read(path))
        return [_frame({**document, **frame}, size) for frame in document["frames"]]
    except (ValueError, KeyError, TypeError) as error:
        if isinstance(error, SceneError):
            raise SceneError(str(error), file=path) from None
        raise SceneError(f"is no transforms.json: {error!r}", file=path) from None


def _frame(frame: Mapping[str, Any], size: tuple[int, int] | None) -> Capture:
    if size is None and not {"w", "h"} <= frame.keys():
        raise SceneError("has no w and h: give size=(width, height)")
    width, height = (int(frame["w"]), int(frame["h"])) if "w" in frame else size or (0, 0)
    name = frame.get("camera_model", "OPENCV")
    if name not in NERF:
        raise SceneError(f"camera_model {name} is not read; {', '.join(NERF)} are")
    model = NERF[name]
    if "fl_x" in frame:
        fx, fy = frame["fl_x"], frame.get("fl_y", frame["fl_x"])
    else:
        fx = 0.5 * width / np.tan(0.5 * frame["camera_angle_x"])
        fy = (
            0.5 * height / np.tan(0.5 * frame["camera_angle_y"])
            if "camera_angle_y" in frame
            else fx
        )
    distortion = [float(frame.get(key, 0.0)) for key in KEYS[model]]
    if not any(distortion[4:]):
        distortion = distortion[:4] if any(distortion) else []
    cx, cy = frame.get("cx", 0.5 * width), frame.get("cy", 0.5 * height)
    camera = Calibrated(
        model=model, intrinsics=(fx, fy, cx - 0.5, cy - 0.5), distortion=tuple(distortion),
        size=(width, height), to_world=to_world(frame["transform_matrix"], "nerf"),
    )  # fmt: skip
    return Capture(str(frame["file_path"]), camera, width, height)


def write_transforms(path: str | Path, captures: Iterable[Capture]) -> None:
    """Write a transforms.json whose frames have their own intrinsics, as Nerfstudio reads them.

    Raises SceneError for a model that it does not have.
    """
    frames = []
    for capture in captures:
        camera = capture.camera
        keys = KEYS.get(camera.model, ())
        if len(camera.distortion) > len(keys) or not keys:
            message = f"has no {camera.model} of {len(camera.distortion)} coefficients"
            raise SceneError(message, where=capture.name)
        fx, fy, cx, cy = map(float, camera.intrinsics)
        frames.append({
            "file_path": capture.name, "w": capture.width, "h": capture.height,
            "camera_model": "OPENCV" if camera.model == "opencv" else "OPENCV_FISHEYE",
            "fl_x": fx, "fl_y": fy, "cx": cx + 0.5, "cy": cy + 0.5,
            **dict(zip(keys, map(float, camera.distortion), strict=False)),
            "transform_matrix": pose(camera.to_world, "nerf").tolist(),
        })  # fmt: skip
    output_files.write_text(Path(path), json.dumps({"frames": frames}, indent=1) + "\n")
