"""A video of frames that are image files, by the ffmpeg of the package imageio-ffmpeg."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from .. import images, output_files
from ..errors import SceneError
from .extras import extra

FORMATS = (".mp4", ".mov", ".mkv", ".webm")
QUALITY = {"libx264": ["-crf", "16"], "libvpx-vp9": ["-crf", "24", "-b:v", "0"]}
# Even sides, which chroma of half the size needs, and colours as screens for Rec. 709 expect.
FILTER = (
    "pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv,"
    "setparams=color_primaries=bt709:color_trc=iec61966-2-1:colorspace=bt709:range=tv"
)


def check(path: Path) -> None:
    """Raise SceneError for a video that cannot be written, ClptError without the package."""
    if path.suffix.lower() not in FORMATS:
        raise SceneError(f"a video is one of {' '.join(FORMATS)}", file=path)
    try:
        output_files.check_writable(path)
    except OSError as error:
        raise SceneError(f"cannot be written: {error}", file=path) from error
    with extra("video", "--video"):
        import imageio_ffmpeg  # noqa: F401


def write(path: Path, frames: Sequence[Path], fps: float) -> None:
    """Write .png files of one size as a video. Raises SceneError."""
    with extra("video", "--video"):
        import imageio_ffmpeg
    height, width = _read(frames[0]).shape[:2]
    codec = "libvpx-vp9" if path.suffix.lower() == ".webm" else "libx264"
    try:
        with output_files.replacing(path) as partial:
            writer = imageio_ffmpeg.write_frames(
                str(partial), (width, height), fps=fps, codec=codec, quality=None,
                macro_block_size=1, pix_fmt_out="yuv420p", ffmpeg_log_level="error",
                output_params=[*QUALITY[codec], "-vf", FILTER],
            )  # fmt: skip
            writer.send(None)
            for frame in frames:
                pixels = _read(frame)
                if pixels.shape[:2] != (height, width):
                    raise SceneError("frames of a video have one size", file=frame)
                writer.send(np.ascontiguousarray(pixels))
            writer.close()
    except OSError as error:
        raise SceneError(f"cannot be written: {error}", file=path) from error


def _read(path: Path) -> np.ndarray:
    """A .png as (h, w, 3) uint8: what is transparent is over black."""
    values = images.read_stored(path).values
    if values.shape[2] == 4:
        values = (values[..., :3].astype(np.uint16) * values[..., 3:] // 255).astype(np.uint8)
    return np.repeat(values, 3, axis=2) if values.shape[2] == 1 else values
