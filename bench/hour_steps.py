"""The steps of `bench.first_hour`, each part of them in a process of its own.

    python -m bench.hour_steps STEP PART SETTINGS

writes the part's figures as JSON lines. SETTINGS is a JSON object: `device`, `small` (for a dry
run), `scenes` (a folder with scenes of Mitsuba's), `folder` (for programs that go wrong), `failed`
(tests).
"""

from __future__ import annotations

import dataclasses
import json
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from unittest import mock

import numpy as np

Row = dict[str, object]


@dataclasses.dataclass(frozen=True)
class Settings:
    """What all steps share, see the module."""

    device: str
    small: bool = False
    scenes: str = ""
    folder: str = ""
    failed: tuple[str, ...] = ()

    @property
    def size(self) -> int:
        """The side of a picture [pixels]."""
        return 64 if self.small else 1024

    @property
    def samples(self) -> int:
        """The samples of a pixel of a picture."""
        return 2 if self.small else 32


def light(part: str, settings: Settings) -> Iterator[Row]:
    """Whether a check of first light is right."""
    from clpt.bench import first_light

    (check,) = (check for check in first_light.checks() if check.name == part)
    for result in first_light.run(settings.device, 120.0, [check]):
        stages = [figure.name for figure in result.wrong]
        scene = str(check.settings.get("scene", ""))
        yield {"figure": part, "says": result.summary, "wrong": stages, "scene": scene}


def trees(part: str, settings: Settings) -> Iterator[Row]:
    """Million triangles a second; `same`: share of rays with equal hits in both builders' trees."""
    from bench.traversal import Tracer, atrium
    from bench.upward import built, crossing_rays
    from clpt import device as dev

    on = dev.choose(settings.device)
    layout, copies = part.split()[0], int(part.split()[1])
    vertices, faces = atrium()
    shift = np.arange(copies).repeat(len(vertices))[:, None] * np.float32([0, 0, 20])
    faces = np.concatenate([faces + np.uint32(len(vertices) * k) for k in range(copies)])
    vertices = np.float32(np.tile(vertices, (copies, 1)) + shift)
    if settings.small:
        faces = faces[::16]
    rays, hits = crossing_rays(vertices[faces], 4096), []
    for upward in (True, False):
        if copies > 1 and not upward:
            continue  # a quarter of a minute
        seconds = [built(on, vertices, faces, layout, upward).stats["seconds"] for _ in range(3)]
        tree = built(on, vertices, faces, layout, upward)
        hits.append(Tracer(on, tree).run("closest", rays, 1)[0]["t"])
        stats = {name: tree.stats[name] for name in ("cost", "depth") if name in tree.stats}
        figure = f"{part}, {'from the leaves up' if upward else 'by planes'}"
        rate = len(faces) * 1e-6 / min(seconds)
        same = float((hits[0] == hits[-1]).mean())
        yield {"figure": figure, "value": rate, "unit": "Mtri/s", "same": same, **stats}


def measured(part: str, settings: Settings, **more: object) -> Iterator[Row]:
    """Figures of `clpt bench`."""
    from clpt import bench
    from clpt import device as dev

    on = dev.choose(settings.device, profiling=True)
    count = 1024 if settings.small else None
    rounds = 1 if settings.small else 3
    for figure in bench.measure(on, rounds=rounds, count=count, **more):  # type: ignore[arg-type]
        row = {"figure": f"{part}: {figure.name}", "value": figure.value, "unit": figure.unit}
        yield {
            **row,
            "spread": figure.spread,
            **({"refused": figure.refused} if figure.refused else {}),
        }


def rays(part: str, settings: Settings) -> Iterator[Row]:
    """Rays a second by layout, set and query."""
    scene = "cornell" if settings.small else "atrium"
    yield from measured(part, settings, parts=["rays"], scene=scene, layouts=[part])


def stages(part: str, settings: Settings) -> Iterator[Row]:
    """Items a second of the stages of a scene."""
    yield from measured(part, settings, parts=["stages"], scene=part)


def starting(part: str, settings: Settings) -> Iterator[Row]:
    """Whole processes until a first picture."""
    yield from measured(part, settings, parts=["start"], scene=part)


def sorting(part: str, settings: Settings) -> Iterator[Row]:
    """Closest hits of a scene's paths in their slots, and sorted (with the sort); renders too."""
    from clpt import device as dev
    from clpt.bench import opened
    from clpt.bench.launches import Flight
    from clpt.bench.stages import BOUNCES, WARM
    from clpt.render.wavefront.path_buffers import SORTING
    from clpt.render.wavefront.strategy import Tuning

    on = dev.choose(settings.device, profiling=True)
    slots = 1 << 12 if settings.small else None
    for name, sort in (("in their slots", False), ("sorted", True)):
        flight = Flight(on, opened(part), slots, tuning=Tuning(sorted_rays=sort))
        count, seconds = 0, 0.0
        for number in range(WARM + BOUNCES):
            for step in flight.wavefront.stages:
                items, taken = flight.timed(step)
                if number >= WARM and step.name in ("intersect", *SORTING):
                    count += items * (step.name == "intersect")
                    seconds += taken.device
        yield {"figure": f"{part}, {name}", "value": count * 1e-6 / seconds, "unit": "Mrays/s"}
        value = rate(part, settings, sorted_rays=sort)
        yield {"figure": f"{part}, rendered {name}", "value": value, "unit": "Msamples/s"}


def rate(scene: str, settings: Settings, **options: object) -> float:
    """Return the Msamples/s of a render."""
    from clpt import Renderer
    from clpt.bench import opened

    plan = opened(scene)
    film = dataclasses.replace(plan.film, width=settings.size, height=settings.size)
    plan = dataclasses.replace(plan, film=film, spp=1 << 16)
    with Renderer(plan, settings.device, **options) as renderer:  # type: ignore[arg-type]
        renderer.run(settings.samples)
        start = time.perf_counter()
        renderer.run(settings.samples)
        return settings.size**2 * settings.samples * 1e-6 / (time.perf_counter() - start)


def layouts(part: str, settings: Settings) -> Iterator[Row]:
    """Renders of a scene through each layout of trees."""
    from clpt import bvh

    for layout in bvh.TREES:
        value = rate(part, settings, layout=layout)
        yield {"figure": f"{part}, {layout}", "value": value, "unit": "Msamples/s"}


def registers(part: str, settings: Settings) -> Iterator[Row]:
    """Renders of a scene with limits of registers, and without."""
    from clpt.render.flow import programs

    scene, _, how = part.partition(", ")
    limits = programs._REGISTERS if how == "limited" else {}
    with mock.patch.object(programs, "_REGISTERS", limits):
        yield {"figure": part, "value": rate(scene, settings), "unit": "Msamples/s"}


def host(part: str, settings: Settings) -> Iterator[Row]:
    """The host's time for a step of a sample, and the device's."""
    from clpt import Renderer
    from clpt.bench import opened

    plan = opened(part)
    width, height = (64, 36) if settings.small else (1280, 720)
    film = dataclasses.replace(plan.film, width=width, height=height)
    with Renderer(dataclasses.replace(plan, film=film, spp=1 << 16), settings.device) as renderer:
        renderer.step().wait()
        times = []
        for _ in range(5):
            start = time.perf_counter()
            event = renderer.step()
            enqueued = time.perf_counter() - start
            event.wait()
            times.append((enqueued * 1e3, (time.perf_counter() - start) * 1e3))
    for name, value in zip(("enqueued", "done"), np.median(times, axis=0), strict=True):
        yield {"figure": f"{part}, {name}", "value": float(value), "unit": "ms"}


def repro(part: str, settings: Settings) -> Iterator[Row]:
    """A program of its own for a stage that is wrong."""
    scene, _, stage = part.partition(": ")
    folder = Path(settings.folder) / f"{scene}-{stage}"
    command = ["-m", "clpt", "kernels", scene, "-o", str(folder), "--repro", stage]
    command += ["--device", settings.device]
    done = subprocess.run([sys.executable, *command], capture_output=True, text=True, check=False)
    lines = (done.stdout + done.stderr).strip().splitlines()
    yield {"figure": part, "says": lines[-1] if lines else "", "wrong": [], "folder": str(folder)}


def mitsuba(part: str, settings: Settings) -> Iterator[Row]:
    """Pictures by Mitsuba and by clpt in turns, from the same file."""
    path, variant = part.rsplit(" ", 1)
    variant = variant.replace("cuda_ad", "scalar") if settings.small else variant
    file = str(Path(settings.scenes) / path)
    mode = "spectral" if variant.endswith("spectral") else "rgb"
    samples, size = settings.samples, settings.size // 2
    for name, value in (("Mitsuba", _mitsuba(file, variant, samples, size)),
                        ("clpt", _clpt(file, mode, samples, size, settings))):  # fmt: skip
        yield {"figure": f"{path}, {mode}, {name}", "value": value, "unit": "Msamples/s"}


def _mitsuba(file: str, variant: str, samples: int, size: int) -> float:
    import mitsuba

    mitsuba.set_variant(variant)
    scene = mitsuba.load_file(file)
    film = mitsuba.traverse(scene)
    (name,) = (key for key in film.keys() if key.endswith("film.size"))  # noqa: SIM118
    film[name] = [size, size]
    film.update()
    seconds = []
    for seed in range(3):
        start = time.perf_counter()
        np.array(mitsuba.render(scene, spp=samples, seed=seed))
        seconds.append(time.perf_counter() - start)
    return size**2 * samples * 1e-6 / min(seconds[1:])


def _clpt(file: str, mode: str, samples: int, size: int, settings: Settings) -> float:
    from clpt import Renderer
    from clpt.bench import opened

    plan = opened(file, mode)
    film = dataclasses.replace(plan.film, width=size, height=size, crop=None)
    plan = dataclasses.replace(plan, film=film, spp=1 << 16)
    with Renderer(plan, settings.device) as renderer:
        seconds = []
        for _ in range(3):
            start = time.perf_counter()
            renderer.run(samples)
            renderer.image()
            seconds.append(time.perf_counter() - start)
    return size**2 * samples * 1e-6 / min(seconds[1:])


def tests(part: str, settings: Settings) -> Iterator[Row]:
    """Tests of a folder, or those that failed before."""
    chosen = settings.failed if part == "failed before" else (part,)
    command = [sys.executable, "-m", "pytest", "-q", "-n", "0", "--no-header", "--tb=line", *chosen]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    failed = re.findall(r"^(?:FAILED|ERROR) (\S+)", done.stdout, re.MULTILINE)
    lines = done.stdout.strip().splitlines()
    yield {"figure": part, "says": lines[-1] if lines else done.stderr[-200:], "wrong": failed}


STEPS: dict[str, Callable[[str, Settings], Iterator[Row]]] = {
    f.__name__: f
    for f in (
        *(light, trees, rays, stages, sorting, layouts, registers, host, starting, repro),
        *(mitsuba, tests),
    )
}


def main(step: str, part: str, text: str) -> None:
    values = json.loads(text)
    settings = Settings(**{**values, "failed": tuple(values.get("failed", ()))})
    for row in STEPS[step](part, settings):
        print(json.dumps(row), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
