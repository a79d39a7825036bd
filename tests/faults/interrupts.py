"""Errors at every line of what changes a film, and signals at random moments.

`python -m tests.faults.interrupts 1000` interrupts a renderer that often.
"""

from __future__ import annotations

import collections
import dataclasses
import dis
import functools
import random
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

import numpy as np
from numpy.typing import NDArray

import clpt
from clpt import device as dev
from clpt.geometry import shapes as placing
from clpt.render.film import film_file
from clpt.render.film.state import FilmState, Ranges
from tests.pictures.support import with_film

CODE = str(Path(clpt.__file__).parent)
NUMBERS = 8  # samples whose films are known one by one
Sums = NDArray[np.uint64]


class Injected(BaseException):
    """What is raised in the middle."""


@functools.cache
def safe_places(code: CodeType) -> frozenset[int]:
    """Where no signal is raised in a function, though a tracer sees a line begin.

    At the end of a `with`, before what it holds is given back, and at the word `try`.
    """
    found, steps = set(), list(dis.get_instructions(code))
    found.update(one.offset for one in steps if one.opname == "NOP")
    for i in range(len(steps) - 2):
        names = [(one.opname, one.argval) for one in steps[i : i + 3]]
        if names in ([("LOAD_CONST", None)] * 3, [("LOAD_CONST", None), *[("DUP_TOP", None)] * 2]):
            found.add(steps[i].offset)
            while steps[i - 1].opname in ("SWAP", "ROT_TWO", "POP_BLOCK", "NOP"):
                i -= 1
                found.add(steps[i].offset)
    return frozenset(found)


@contextmanager
def raising_at(line: int, error: type[BaseException] = Injected) -> Iterator[list[int]]:
    """Raise an error at so many lines of clpt from now; yield a list of how many there were."""
    count = [0]

    def trace(frame: FrameType, event: str, _: Any) -> Any:
        name = frame.f_code.co_filename
        if not name.startswith(CODE):
            return None
        if event == "line" and frame.f_lasti not in safe_places(frame.f_code):
            count[0] += 1
            if count[0] == line:
                raise error(f"line {frame.f_lineno} of {Path(name).name}")
        return trace

    sys.settrace(trace)
    try:
        yield count
    finally:
        sys.settrace(None)


@contextmanager
def interrupted_after(seconds: float) -> Iterator[None]:
    """Let a signal raise KeyboardInterrupt in so many seconds, inside."""

    def interrupt(*_: Any) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, interrupt)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def sums(state: FilmState) -> Sums:
    """The low 64 bits of a pixel's sums, and its number of samples: (pixels, 4)."""
    words = state.words[0].reshape(state.words.shape[1], -1).astype(np.uint64)
    three = [words[3 * i] | words[3 * i + 1] << np.uint64(32) for i in range(3)]
    return np.stack([*three, words[9]], axis=1)


class Known:
    """Films of single samples of a scene, by which those in another film are told."""

    def __init__(self, renderer: clpt.Renderer):
        renderer.reset()
        empty, films = sums(renderer.film_state()), []
        for _ in range(NUMBERS):
            renderer.run(1)
            films.append(sums(renderer.film_state()))
        self.each = [b - a for a, b in zip([empty, *films], films, strict=False)]

    def explains(self, state: FilmState) -> bool:
        """Whether every pixel has some of the samples that are named, each of them once."""
        numbers = [n for first, end in state.taken for n in range(first, end)]
        found = sums(state)
        totals = np.zeros((1, *found.shape), np.uint64)
        for number in numbers:
            totals = np.concatenate([totals, totals + self.each[number]])
        return bool((totals == found).all(axis=2).any(axis=0).all())

    def whole(self, taken: Ranges) -> Sums:
        """The film of all these samples."""
        numbers = [n for first, end in taken for n in range(first, end)]
        return np.sum([self.each[n] for n in numbers], axis=0, dtype=np.uint64)


class Trial:
    """A renderer that is interrupted and looked at; outcomes: how often each came."""

    def __init__(self, make: Callable[[], clpt.Renderer | clpt.MultiRenderer]):
        self.make, self.renderer = make, make()
        self.known = Known(self.renderer)
        self.outcomes: collections.Counter[str] = collections.Counter()
        self.folder = Path(tempfile.mkdtemp())

    def check(self, what: str) -> None:
        """Look at what an error has left. Raises AssertionError where nobody could trust it."""
        renderer = self.renderer
        try:
            state = renderer.film_state()
        except clpt.DeviceError as error:
            self._check_broken(what, str(error))
            return
        assert self.known.explains(state), f"{what}: the film has not what {state.taken} names"
        path = self.folder / "a.film"
        renderer.save_state(path)
        saved = film_file.read(path).film
        assert saved.taken == state.taken and np.array_equal(saved.words, state.words), what
        if renderer.samples < NUMBERS:
            first, end = renderer.samples, renderer.samples + 1
            assert renderer.run(1) or renderer.run(1), what
            gained = sums(renderer.film_state()) - sums(state)
            wanted = self.known.whole(((first, end),))
            assert np.array_equal(gained, wanted), f"{what}: the next sample is another one"
        self.outcomes["whole"] += 1
        self._check_anew(what)

    def _check_broken(self, what: str, told: str) -> None:
        assert "is broken" in told, f"{what}: {told}"
        uses = [self.renderer.image, lambda: self.renderer.run(1)]
        if isinstance(self.renderer, clpt.Renderer):
            uses.append(self.renderer.step)
        for use in uses:
            try:
                use()
            except clpt.DeviceError as error:
                assert "is broken" in str(error), f"{what}: {error}"
            else:
                raise AssertionError(f"{what}: a broken renderer works")
        if "reset it" in told:
            self.outcomes["broken, reset"] += 1
        else:
            self.outcomes["broken for good"] += 1
            self.renderer.close()
            self.renderer = self.make()
        self._check_anew(what)

    def _check_anew(self, what: str) -> None:
        self.renderer.reset()
        assert self.renderer.run(2) or self.renderer.run(2), what
        found = sums(self.renderer.film_state())
        assert np.array_equal(found, self.known.whole(((0, 2),))), f"{what}: reset heals nothing"
        self.renderer.reset()


def small(scene: clpt.Scene) -> clpt.Scene:
    """A scene with a small film, whose pixels may differ in their numbers of samples."""
    return dataclasses.replace(with_film(scene, mode="rgb", width=16, height=12), noise=0.2)


def changes(trial: Trial) -> dict[str, Callable[[], Any]]:
    """What changes a film, by name; each begins after two samples."""
    renderer, scene = trial.renderer, trial.renderer.scene
    with trial.make() as other:
        other.reset(first_sample=2)
        other.run(2)
        state = other.film_state()
    path = trial.folder / "other.film"
    renderer.reset()
    renderer.run(3)
    renderer.save_state(path)
    same = dataclasses.replace(scene.camera)
    shape = next(shape for shape in scene.shapes if shape.name == "floor")
    place = placing.placement(shape)
    found = {
        "run": lambda: trial.renderer.run(4),
        "run by noise": lambda: trial.renderer.run(NUMBERS - 2, noise=0.2),
        "step": lambda: trial.renderer.step(4),
        "merge": lambda: trial.renderer.merge(state),
        "reset": lambda: trial.renderer.reset(),
        "prepare": lambda: trial.renderer.prepare(),
        "load_state": lambda: trial.renderer.load_state(path),
        "save_state": lambda: trial.renderer.save_state(trial.folder / "b.film"),
        "update of the camera": lambda: trial.renderer.update(camera=same),
        "update of the scene": lambda: trial.renderer.update(scene=scene),
        "update of a place": lambda: trial.renderer.update(transforms={shape.name: place}),
    }
    if isinstance(renderer, clpt.MultiRenderer):  # whose films come together for a picture
        del found["step"]
        found["image"] = lambda: trial.renderer.image()
    return found


def every_line(trial: Trial, name: str, act: Callable[[], Any], most: int) -> int:
    """Raise an error at every line of an act, or at so many of them, and check each.

    Returns how many lines there are.
    """
    trial.renderer.run(2)
    with raising_at(0) as count:
        act()
    trial.renderer.reset()
    for line in range(1, count[0] + 1, max(1, count[0] // most)):
        what = f"{name}, whole"
        trial.renderer.run(2)
        with raising_at(line):
            try:
                act()
            except Injected as error:
                what = f"{name}, {error}"
        trial.check(what)
    return count[0]


def signals(trial: Trial, count: int, seed: int = 0) -> int:
    """Interrupt acts at random moments, and check; return how many were interrupted."""
    rng, acts = random.Random(seed), changes(trial)
    spans: dict[str, float] = {}
    for name, act in acts.items():
        trial.renderer.run(2)
        start = time.perf_counter()
        act()
        spans[name] = time.perf_counter() - start
        trial.renderer.reset()
    caught = 0
    while caught < count:
        name = rng.choice([*acts, "run", "run"])
        trial.renderer.run(2)
        try:
            with interrupted_after(max(1e-5, rng.uniform(0.0, 1.1 * spans[name]))):
                acts[name]()
        except KeyboardInterrupt:
            caught += 1
        trial.check(f"{name}, a signal")
    return caught


def main() -> None:
    """Interrupt a Cornell box."""
    scene = small(clpt.load(Path(__file__).parents[1] / "scenes" / "cornell.xml"))
    device = dev.choose()
    for options in ({}, {"looped": True}, {"looped": False}, "two queues"):
        if isinstance(options, str):
            pair = [device, dev.choose()]
            trial = Trial(lambda pair=pair: clpt.MultiRenderer(scene, pair, slots=128))
        else:
            trial = Trial(lambda options=options: clpt.Renderer(scene, slots=128, **options))
        start = time.perf_counter()
        for name, act in changes(trial).items():
            lines = every_line(trial, name, act, 200 if "scene" in name else 2000)
            print(options, name, lines, "lines", dict(trial.outcomes), flush=True)
            trial.outcomes.clear()
        caught = signals(trial, int(sys.argv[1]))
        seconds = time.perf_counter() - start
        print(options, caught, "signals", dict(trial.outcomes), f"{seconds:.0f} s", flush=True)


if __name__ == "__main__":
    main()
