"""Rays through the camera `lens`: how many a core takes from the film to the scene in a second.

    python -m bench.lens [--json FILE]

A double Gauss of 11 surfaces, 2^20 rays a launch, of random places, points of the pupil and
wavelengths; the least processor time of several launches. What a sample costs with losses, coatings
and ghosts stands beside.
"""

from __future__ import annotations

import time
from pathlib import Path

import click
import numpy as np
import pyopencl as cl

from bench import machine
from clpt import device
from clpt.records import SETTINGS, TABLES
from clpt.render.camera import encode_camera
from clpt.render.flow import stages
from clpt.render.flow.flags import scene_text
from clpt.render.records import CameraFeatures
from clpt.scene.cameras import Lens

RAYS, ROUNDS = 1 << 20, 7
GRID = np.linspace(360.0, 830.0, 471)
CASES = {
    "glasses that disperse": Lens(),
    "losses": Lens(losses=True),
    "three films": Lens(losses=True, coating="multi"),
    "a fifth are ghosts": Lens(ghosts=0.2, coating="single"),
}
MAIN = """#include "core/base.cl"
#include "cameras/camera.cl"
#include "generated/camera.cl"
kernel void trace(SCENE_ARGS, global const float *given, global float *made, uint n)
{
    SCENE
    uint at = get_global_id(0) * LANES;
    vec2 film = {block_load(given + at), block_load(given + n + at)};
    vec2 lens = {block_load(given + 2 * n + at), block_load(given + 3 * n + at)};
    Spectrum weight, lambdas = spectrum_of(block_load(given + 4 * n + at));
    CameraRay ray = camera_weighted_ray(scene, film, lens, lambdas, &weight);
    block_store(made + at, ray.d.x + ray.d.y + ray.o.x + ray.o.y + weight.x);
}
"""


def rate(on: device.Device, lens: Lens, lanes: int) -> float:
    """Rays in a second of processor time."""
    rows = lens.dispersive_glasses
    words = encode_camera(lens, 90, 60, range(len(rows)))
    camera = CameraFeatures("lens", disperses=True, losses=lens.reflects)
    files = {
        "generated/scene.cl": scene_text(),
        "generated/spectrum.cl": '#include "spectra/spectral.cl"\n',
        "generated/spectrum_read.cl": '#include "spectra/spectral.cl#read"\n',
        "generated/camera.cl": stages.camera_text(camera),
        "bench": MAIN,
    }
    defines = {
        "LANES": lanes, "QUEUED": 0, "SPECTRA_SIZE": 471, "SPECTRA_STEP": "1.0f",
        "CAMERA_DISPERSES": 1, "LENS_LOSSES": int(lens.reflects),
        "LENS_GHOSTS": int(lens.ghosts > 0.0),
    }  # fmt: skip
    program = device.build(on, device.assemble("bench", files, defines))
    settings = np.zeros(1, SETTINGS.dtype)
    settings["lambda_min"] = 360.0
    numbers = np.random.default_rng(1).random((5, RAYS), np.float32)
    numbers[4] = 400.0 + 300.0 * numbers[4]
    tables = {name: np.zeros(1, np.float32) for name in TABLES}
    tables["camera"], tables["settings"], tables["given"] = words, settings, numbers
    tables["spectra"] = np.concatenate([g.sample(GRID) for g in rows]).astype(np.float32)
    flags = cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR
    bound = {
        n: cl.Buffer(on.context, flags, hostbuf=np.ascontiguousarray(v)) for n, v in tables.items()
    }
    output = cl.Buffer(on.context, cl.mem_flags.WRITE_ONLY, 4 * RAYS)
    kernel = program.kernel("trace").bind(**bound, made=output, n=RAYS)
    taken = []
    for _ in range(ROUNDS):
        on.queue.finish()
        began = time.process_time()
        kernel.enqueue(on.queue, (RAYS // lanes,), (1,)).wait()
        taken.append(time.process_time() - began)
    return RAYS / min(taken)


@click.command()
@click.option("--json", "path", type=click.Path(path_type=Path), help="Append records here.")
def main(path: Path | None) -> None:
    """Measure rays through a lens."""
    on, rows = device.choose(), []
    for name, lens in CASES.items():
        for lanes in (8, 16):
            speed = rate(on, lens, lanes)
            rows.append(
                {**machine.circumstances(), "what": name, "lanes": lanes, "mrays": speed / 1e6}
            )
            machine.console().print(f"{name}, {lanes} lanes: {speed / 1e6:.1f} Mrays/s a core")
    machine.append(path, "lens", rows)


if __name__ == "__main__":
    main()
