"""Every kind of file that clpt writes, by a name: what writes a small one to a path."""

from __future__ import annotations

import functools
import importlib.util
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

import numpy as np

import clpt
from clpt import images, measured, scene
from clpt.cli.display import Display
from clpt.cli.files import checkpoints
from clpt.cli.render.frames import write_video
from clpt.files import output_files
from clpt.formats.meshes import spheres_curves
from clpt.formats.native import motion
from clpt.images import spectral_exr
from clpt.measured import measurement
from clpt.render.film import film_file
from clpt.scene.motion import Deformation
from tests.render.film.test_film_file import made as film

NOISE = np.random.default_rng(5).random((9, 14, 3), np.float32)
POINTS = np.random.default_rng(6).random((8, 3), np.float32)
SPHERES = scene.shapes.Spheres(centers=POINTS, radii=POINTS[:, 0])

Writer = Callable[[Path], None]


def picture(path: Path) -> None:
    images.write(path, NOISE)


def layers(path: Path) -> None:
    images.write(path, NOISE, layers={"depth": NOISE[..., 0], "normal": NOISE})


def spectral(path: Path) -> None:
    spectral_exr.write(path, spectral_exr.SpectralImage(NOISE, [400.0, 500.0, 600.0], True))


def checkpoint(path: Path) -> None:
    """Write one as a render does; what it could not do is an error."""
    said: list[str] = []
    shown = Display()
    shown.note = said.append
    kept = film((1, 10, 4, 5))
    renderer = SimpleNamespace(_hold=lambda: None, saved_film=lambda held: kept)
    writer = checkpoints.Checkpoints(renderer, path, 1e9, False, (), shown)
    try:
        writer.save(stopped=False)
    finally:
        if writer._writer is not None and writer._writer.is_alive():
            writer._writer.join()  # a thread, which Ctrl-C does not stop
    if said:
        raise OSError(said[0])


def saved_scene(path: Path) -> None:
    film = scene.Film(width=8, height=8)
    clpt.save(scene.Scene(camera=scene.cameras.Perspective(), film=film), path)


def merl(path: Path) -> None:
    measured.write_merl(path, measured.MerlTable(values=np.full((2, 3, 4, 3), 0.25)))


def plot(path: Path) -> None:
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    from clpt.cli import plots

    same = {"SOURCE_DATE_EPOCH": "0"}
    with rc_context({"svg.hashsalt": "same"}), mock.patch.dict(os.environ, same):
        figure = Figure(figsize=(1.0, 1.0))
        figure.subplots().plot([0.0, 1.0])
        plots.save(figure, path)


@functools.cache
def frames() -> list[Path]:
    folder = Path(tempfile.mkdtemp(prefix="clpt-test-frames-"))
    for number in range(4):
        images.write(folder / f"{number}.png", np.roll(np.repeat(NOISE, 4, 0), number, 0))
    return sorted(folder.iterdir())


def film_of_frames(path: Path) -> None:
    write_video(path, frames(), 24.0)


WRITERS: dict[str, tuple[str, Writer]] = {
    **{f"picture {suffix}": (f"a{suffix}", picture) for suffix in images.WRITABLE},
    "layers": ("a.exr", layers),
    "spectra": ("a.exr", spectral),
    "bands": ("a.npy", lambda path: images.write_npy(path, NOISE)),
    "stored picture": ("a.png", lambda path: images.write_stored(path, np.uint8(NOISE * 255))),
    "film": ("a.film", lambda path: film_file.write(path, film())),
    "checkpoint": ("a.resume.exr", checkpoint),
    "text": ("a.cl", lambda path: output_files.write_text(path, "kernel\n" * 500)),
    "scene": ("scene.json", saved_scene),
    "strands": ("a.txt", lambda path: spheres_curves.write_strands(path, POINTS, np.array([4, 4]))),
    "particles": ("a.npz", lambda path: spheres_curves.write_spheres(path, SPHERES)),
    "deformation": (
        "a.npz",
        lambda path: motion.write_deformation(
            Deformation((0.0, 1.0), np.stack([POINTS, POINTS]), None), path
        ),
    ),
    "merl": ("a.binary", merl),
    "tensors": (
        "a.bsdf",
        lambda path: measurement.write_tensors(path, {"points": POINTS, "n": NOISE}),
    ),
    "plot png": ("a.png", plot),
    "plot svg": ("a.svg", plot),
    "plot pdf": ("a.pdf", plot),
}
if importlib.util.find_spec("imageio_ffmpeg"):
    WRITERS["video"] = "a.mp4", film_of_frames
