"""Embree 3 as the reference: a small C harness, compiled on first use (Debian: libembree-dev)."""

from __future__ import annotations

import ctypes
import subprocess
import tempfile
from pathlib import Path

import numpy as np

QUALITIES = {"low": 0, "medium": 1, "high": 2}


def _library() -> ctypes.CDLL:
    folder = Path(tempfile.mkdtemp(prefix="clpt-embree-"))
    library = folder / "harness.so"
    source = Path(__file__).with_name("harness.c")
    command = ["cc", "-O3", "-shared", "-fPIC", str(source), "-o", str(library), "-lembree3"]
    try:
        subprocess.run(command, check=True, capture_output=True, text=True)
    except (OSError, subprocess.CalledProcessError) as error:
        log = getattr(error, "stderr", "") or str(error)
        raise SystemExit(f"Embree's harness did not build (libembree-dev, cc?): {log}") from error
    loaded = ctypes.CDLL(str(library))
    library.unlink()
    folder.rmdir()
    figures = "harness_build_seconds", "harness_build_wall", "harness_closest", "harness_occluded"
    for name in figures:
        getattr(loaded, name).restype = ctypes.c_double
    loaded.harness_build.restype = ctypes.c_void_p
    return loaded


class Embree:
    """A scene in Embree; rays are (n, 8) float32: origin, tmin, direction, tmax.

    build_seconds, build_wall: of its tree, processor time and by the clock.
    """

    def __init__(
        self, vertices: np.ndarray, faces: np.ndarray, threads: int = 1, quality: str = "medium"
    ):
        self._library = _library()
        vertices = np.ascontiguousarray(vertices, np.float32)
        faces = np.ascontiguousarray(faces, np.uint32)
        self._harness = ctypes.c_void_p(
            self._library.harness_build(
                _pointer(vertices),
                ctypes.c_size_t(len(vertices)),
                _pointer(faces),
                ctypes.c_size_t(len(faces)),
                f"threads={threads}".encode(),
                QUALITIES[quality],
            )
        )
        self.build_seconds = self._library.harness_build_seconds(self._harness)
        self.build_wall = self._library.harness_build_wall(self._harness)

    def closest(self, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        """t (n,), prim (n,) uint32 (2^32 - 1: none), and the seconds of processor time it took."""
        t, prim = np.empty(len(rays), np.float32), np.empty(len(rays), np.uint32)
        count = ctypes.c_size_t(len(rays))
        seconds = self._library.harness_closest(
            self._harness, _pointer(rays), count, _pointer(t), _pointer(prim)
        )
        return t, prim, seconds

    def occluded(self, rays: np.ndarray) -> tuple[np.ndarray, float]:
        """Whether each ray meets anything, and the seconds it took."""
        met = np.empty(len(rays), np.uint32)
        count = ctypes.c_size_t(len(rays))
        seconds = self._library.harness_occluded(
            self._harness, _pointer(rays), count, _pointer(met)
        )
        return met != 0, seconds

    def close(self) -> None:
        self._library.harness_free(self._harness)


def _pointer(array: np.ndarray) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data)
