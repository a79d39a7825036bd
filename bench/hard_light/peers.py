"""Renderers of the scenes of hard light, for a given processor time on a core.

`clpt:INTEGRATOR`, `mitsuba:INTEGRATOR` and `luxcore:METHOD`; LuxCore is `pyluxcore` on PyPI, and is
left out if it is not installed. Mitsuba and LuxCore run in this process: call `run` in a separate
process.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import clpt
from bench.hard_light.scenes import SCENES, SIZE

CACHE = {
    "path.photongi.caustic.enabled": 1, "path.photongi.caustic.maxsize": 100000,
    "path.photongi.photon.maxcount": 20000000, "path.photongi.caustic.updatespp": 8,
    "path.photongi.photon.time.end": -1,
}  # fmt: skip
LUXCORE: dict[str, tuple[str, dict[str, float]]] = {
    "path": ("PATHCPU", {}),
    "bidir": ("BIDIRCPU", {}),
    "bidirvm": ("BIDIRVMCPU", {}),
    "hybrid": (
        "PATHCPU",
        {
            "path.hybridbackforward.enable": 1, "path.hybridbackforward.partition": 0.8,
            "path.hybridbackforward.glossinessthreshold": 0.05,
        },
    ),
    "cache": ("PATHCPU", CACHE),
}  # fmt: skip
DEEPEST_PHOTON = {"pool": 4}  # of the cache; others 16


@dataclass(frozen=True)
class Shot:
    """A picture (h, w, 3) float64, its processor time without loading and compiling [s], its
    samples a pixel, 0 where the renderer does not tell, and who made it."""

    image: NDArray[np.float64]
    cpu: float
    samples: int
    version: str


def run(method: str, file: Path, seconds: float, seed: int) -> Shot:
    """Render the scene of a file for about `seconds` of processor time.

    Raises KeyError for an unknown method, ImportError for a renderer that is not installed.
    """
    renderer, how = method.split(":", 1)
    return RENDERERS[renderer](file, how, seconds, seed)


def _clpt(file: Path, how: str, seconds: float, seed: int) -> Shot:
    """how: an integrator, and after commas more options of `clpt render`."""
    integrator, *more = how.split(",")
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "a.npy"

        def taken(samples: int) -> float:
            options = ["--mode", "rgb", "--integrator", integrator, *more, "--quiet"]
            numbers = ["--spp", str(samples), "--seed", str(seed), "-o", str(out)]
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            command = [sys.executable, "-m", "clpt", "render", str(file), *options, *numbers]
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

        taken(1)
        start = taken(1)
        tried, took = 16, 0.0
        while took < seconds / 8:
            tried *= 3
            took = taken(tried + 1) - start
        samples = max(1, round(seconds * tried / took))
        cpu = taken(samples + 1) - start
        image = np.load(out).astype(np.float64)[..., :3]
    return Shot(image, cpu, samples, f"clpt {clpt.__version__}")


def _mitsuba(file: Path, how: str, seconds: float, seed: int) -> Shot:
    import drjit
    import mitsuba

    mitsuba.set_variant("llvm_ad_rgb")
    drjit.set_thread_count(1)
    scene = mitsuba.load_file(str(file), integrator=how)
    np.array(mitsuba.render(scene, spp=16, seed=999))
    total, rounds, start = np.zeros((SIZE, SIZE, 3)), 0, time.process_time()
    while time.process_time() - start < seconds:
        picture = np.array(mitsuba.render(scene, spp=16, seed=seed * 10007 + rounds))
        total, rounds = total + picture[..., :3], rounds + 1
    cpu = time.process_time() - start
    return Shot(total / rounds, cpu, 16 * rounds, f"mitsuba {mitsuba.__version__}")


def _luxcore(file: Path, how: str, seconds: float, seed: int) -> Shot:
    # It looks for OpenCL devices at its start, and may crash in a driver.
    os.environ["OCL_ICD_VENDORS"] = os.devnull
    import pyluxcore

    engine, extra = LUXCORE[how]
    depth = SCENES[file.parent.name].depth
    pyluxcore.Init(lambda message: None)
    os.chdir(file.parent)
    scene = pyluxcore.Scene()
    scene.Parse(pyluxcore.Properties(file.with_suffix(".scn").name))
    settings = {
        "renderengine.type": engine, "renderengine.seed": seed, "native.threads.count": 1,
        "film.width": SIZE, "film.height": SIZE, "film.filter.type": "NONE",
        "film.imagepipelines.0.0.type": "NOP", "film.outputs.0.type": "RGB",
        "film.outputs.0.filename": "x.exr", "film.noiseestimation.step": 1000000,
        "sampler.type": "SOBOL", "sampler.sobol.adaptive.strength": 0.0,
        "path.maxdepth": depth, "light.maxdepth": depth,
        "path.photongi.photon.maxdepth": DEEPEST_PHOTON.get(file.parent.name, 16),
        **{f"path.pathdepth.{k}": depth for k in ("total", "diffuse", "glossy", "specular")},
        **extra,
    }  # fmt: skip
    properties = pyluxcore.Properties()
    for name, value in settings.items():
        properties.Set(pyluxcore.Property(name, value))
    session = pyluxcore.RenderSession(pyluxcore.RenderConfig(properties, scene))
    start = time.process_time()
    session.Start()
    while time.process_time() - start < seconds:
        time.sleep(0.05)
    session.UpdateStats()
    samples = session.GetStats().Get("stats.renderengine.pass").GetInt()
    session.Stop()
    cpu, image = time.process_time() - start, np.zeros(SIZE * SIZE * 3, np.float32)
    session.GetFilm().GetOutputFloat(pyluxcore.FilmOutputType.RGB, image, 0)
    picture = image.reshape(SIZE, SIZE, 3)[::-1].astype(np.float64)
    return Shot(picture, cpu, samples, f"pyluxcore {pyluxcore.Version()}")


RENDERERS: dict[str, Callable[[Path, str, float, int], Shot]] = {
    "clpt": _clpt,
    "mitsuba": _mitsuba,
    "luxcore": _luxcore,
}
