"""Several threads that call what one renderer offers, at random.

`python -m tests.faults.threads 600` does so for as many seconds.
"""

from __future__ import annotations

import collections
import dataclasses
import random
import sys
import threading
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import clpt
from tests.faults.interrupts import small

THREADS = 6


def calls(renderer: clpt.Renderer, rng: random.Random, folder: Path) -> list[Callable[[], Any]]:
    """What a thread may call."""
    camera, film = renderer.scene.camera, renderer.film
    path = folder / f"{threading.get_ident()}.film"

    def add_event() -> None:
        film.add_event(renderer.step(1))

    return [
        lambda: renderer.run(rng.randrange(1, 6)),
        lambda: renderer.step(rng.randrange(1, 3)),
        lambda: renderer.image(),
        lambda: renderer.update(camera=dataclasses.replace(camera, fov=rng.uniform(20, 60))),
        lambda: renderer.cancel(discard=rng.random() < 0.5),
        lambda: renderer.stats,
        lambda: renderer.film_state(),
        lambda: renderer.reset(seed=rng.randrange(100)),
        lambda: film.get(),
        lambda: np.asarray(renderer.film),
        lambda: film.copy().get(),
        lambda: film[:, :, :3].events,
        add_event,
        lambda: renderer.resolve().get(),
        lambda: (renderer.counts, renderer.samples, renderer.active, renderer.first_sample),
        lambda: renderer._hold(),
        lambda: renderer.saved_film(held=True),
        lambda: renderer.save_state(path),
        lambda: renderer.prepare(),
        lambda: renderer.samples_per_pixel(),
        lambda: renderer.merge(dataclasses.replace(renderer.film_state(), taken=())),
    ]


def together(
    renderer: clpt.Renderer, folder: Path, *, seconds: float | None = None, each: int = 0
) -> tuple[int, collections.Counter[str]]:
    """Call at random for so many seconds, or so often each; return how often, and other errors.

    Errors of clpt are answers: a film may be reset between a `hold` and what asks for it.
    """
    end = None if seconds is None else time.monotonic() + seconds
    done, faults = [0] * THREADS, collections.Counter[str]()

    def work(number: int) -> None:
        rng = random.Random(number)
        offered = calls(renderer, rng, folder)
        while time.monotonic() < end if end is not None else done[number] < each:
            done[number] += 1
            try:
                rng.choice(offered)()
            except clpt.SceneError:
                pass
            except Exception as error:
                place = traceback.extract_tb(error.__traceback__)[-1]
                faults[f"{type(error).__name__}: {error} ({place.name}, {place.lineno})"] += 1

    threads = [threading.Thread(target=work, args=(i,), daemon=True) for i in range(THREADS)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join((seconds or 0.0) + 120.0)
    faults["a thread hangs"] += sum(thread.is_alive() for thread in threads)
    return sum(done), +faults


def is_as_new(renderer: clpt.Renderer) -> bool:
    """Whether its film is that of a new renderer of its scene."""
    renderer.reset()
    renderer.run(4) or renderer.run(4)  # a `cancel` may be left
    with clpt.Renderer(renderer.scene) as other:
        other.run(4)
        return np.array_equal(renderer.film_state().words, other.film_state().words)


def main() -> None:
    """Call at random for some seconds."""
    import tempfile

    scene = small(clpt.load(Path(__file__).parents[1] / "scenes" / "cornell.xml"))
    renderer = clpt.Renderer(scene, slots=128)
    with tempfile.TemporaryDirectory() as folder:
        count, faults = together(renderer, Path(folder), seconds=float(sys.argv[1]))
    print(f"{count} calls of {THREADS} threads; faults: {dict(faults)}")
    print("the film is then that of a new renderer:", is_as_new(renderer))


if __name__ == "__main__":
    main()
