"""A video of frames that are image files, by the ffmpeg of the package imageio-ffmpeg.

The package's own writer does not tell whether ffmpeg came to its end, so it is not used. A .webp is
a picture that moves, for pages; Pillow writes it.
"""

from __future__ import annotations

import subprocess
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from fractions import Fraction
from itertools import pairwise
from pathlib import Path

import numpy as np
from PIL import Image

from clpt import images
from clpt.files import output_files

from ...errors import SceneError
from ..process.failures import extra
from ..process.stopping import stops

LOOK = 0.02  # seconds between two looks at ffmpeg
MOVING_PICTURE = ".webp"
FORMATS = (".mp4", ".mov", ".mkv", ".webm", MOVING_PICTURE)
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
    if path.suffix.lower() != MOVING_PICTURE:
        with extra("video", "--video"):
            import imageio_ffmpeg  # noqa: F401


def write(path: Path, frames: Sequence[Path], fps: float) -> None:
    """Write .png files of equal size as a video. Raises SceneError."""
    if path.suffix.lower() == MOVING_PICTURE:
        _moving_picture(path, frames, fps)
        return
    with extra("video", "--video"):
        from imageio_ffmpeg import get_ffmpeg_exe
    try:
        with output_files.replacing(path) as partial:
            _encode(get_ffmpeg_exe(), partial, frames, fps)
    except OSError as error:
        raise SceneError(f"cannot be written: {error}", file=path) from error


def _moving_picture(path: Path, frames: Sequence[Path], fps: float) -> None:
    """Write .png files of equal size as a .webp that begins again at its end. Raises SceneError."""
    first, *others = (Image.fromarray(_read(frame)) for frame in frames)
    if any(other.size != first.size for other in others):
        raise SceneError("frames of a video have one size", file=frames[0])
    ends = [round(1000 * n / fps) for n in range(len(frames) + 1)]  # [ms]
    try:
        with output_files.replacing(path) as partial:
            first.save(
                partial, "WEBP", save_all=True, append_images=others, loop=0, quality=80, method=6,
                duration=[end - begin for begin, end in pairwise(ends)],
            )  # fmt: skip
    except OSError as error:
        raise SceneError(f"cannot be written: {error}", file=path) from error


def _encode(ffmpeg: str, path: Path, frames: Sequence[Path], fps: float) -> None:
    """Let ffmpeg write a file. Raises OSError, with the message of ffmpeg, where it fails.

    A signal raises KeyboardInterrupt when ffmpeg is gone: without an owner it would write on.
    """
    height, width = _read(frames[0]).shape[:2]
    rate = str(Fraction(fps).limit_denominator())
    codec = "libvpx-vp9" if path.suffix.lower() == ".webm" else "libx264"
    command = [
        ffmpeg, "-y", "-v", "error", "-xerror", "-f", "rawvideo", "-pix_fmt", "rgb24",
        "-s", f"{width}x{height}", "-r", rate, "-i", "-", "-an", "-vcodec", codec,
        "-pix_fmt", "yuv420p", *QUALITY[codec], "-vf", FILTER, str(path),
    ]  # fmt: skip
    with (
        stops() as stopped,
        tempfile.TemporaryFile() as said,
        subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=said,
            start_new_session=True,  # Ctrl-C is for this process
        ) as process,
    ):  # fmt: skip
        _feed(process, frames, (height, width), stopped)
        while process.poll() is None and not stopped:
            time.sleep(LOOK)
        if stopped:
            process.kill()
            process.wait()
            raise KeyboardInterrupt(*stopped)
        if process.returncode:
            said.seek(0)
            lines = said.read().decode("utf-8", "replace").strip().splitlines()
            raise OSError(lines[-1] if lines else f"ffmpeg ended with status {process.returncode}")


def _feed(
    process: subprocess.Popen[bytes],
    frames: Sequence[Path],
    size: tuple[int, int],
    stopped: Sequence[int],
) -> None:
    """Give ffmpeg the pixels of frames, until a signal has come; it ends if they cannot be read."""
    assert process.stdin is not None
    try:
        for frame in frames:
            pixels = _read(frame)
            if pixels.shape[:2] != size:
                raise SceneError("frames of a video have one size", file=frame)
            process.stdin.write(pixels.tobytes())
            if stopped:
                break
        process.stdin.close()
    except BrokenPipeError:  # it ended, and says why
        with suppress(OSError):
            process.stdin.close()
    except BaseException:
        process.kill()
        raise


def _read(path: Path) -> np.ndarray:
    """A .png as (h, w, 3) uint8: transparent pixels are over black."""
    values = images.read_stored(path).values
    if values.shape[2] == 4:
        values = (values[..., :3].astype(np.uint16) * values[..., 3:] // 255).astype(np.uint8)
    return np.repeat(values, 3, axis=2) if values.shape[2] == 1 else values
