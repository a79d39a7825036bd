"""After an error at any line the films of several devices are what is said of them, or broken."""

from __future__ import annotations

import _thread
import signal
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

import clpt
from clpt import device as dev
from clpt.cluster.device_worker import Threads, on_all
from clpt.render.wavefront.noise import NoiseMeter
from tests.faults.interrupts import (
    Injected,
    Trial,
    changes,
    every_line,
    raising_at,
    signals,
    small,
    sums,
)


@pytest.fixture(scope="module")
def trial(scenes: Path) -> Iterator[Trial]:
    """Of two queues on one device, in one context, so that programs are built once."""
    scene, pair = small(clpt.load(scenes / "cornell.xml")), [dev.choose(), dev.choose()]
    made = Trial(lambda: clpt.MultiRenderer(scene, pair, slots=128))
    yield made
    made.renderer.close()


@pytest.mark.parametrize("most", [8, pytest.param(400, marks=pytest.mark.slow)])
def test_an_error_at_any_line(trial: Trial, most: int) -> None:
    """Of all that changes the film, and of what brings films together."""
    for name, act in changes(trial).items():
        every_line(trial, name, act, min(most, 100) if "update" in name else most)
    assert trial.outcomes["whole"] > 0


@pytest.mark.parametrize("count", [20, pytest.param(1000, marks=pytest.mark.slow)])
@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="this system has no timer signals")
def test_a_signal_at_any_moment(trial: Trial, count: int) -> None:
    assert signals(trial, count) == count


def test_films_that_were_being_gathered_are_broken_until_a_reset(trial: Trial) -> None:
    renderer = trial.renderer
    renderer.reset()
    renderer.run(2)
    with raising_at(0) as lines:
        renderer.film_state()
    renderer.reset()
    renderer.run(2)
    with raising_at(lines[0] // 2), pytest.raises(Injected):
        renderer.film_state()
    with pytest.raises(clpt.DeviceError, match="broken: its gathering of films was stopped by Inj"):
        renderer.image()
    renderer.reset()
    renderer.run(2)
    found = renderer.film_state()
    assert found.taken == ((0, 2),)
    assert np.array_equal(sums(found), trial.known.whole(found.taken))


def test_an_interrupted_run_with_noise_leaves_the_film_as_it_was(
    trial: Trial, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Samples may have been in two films, or in none: such a renderer used to be broken."""
    renderer = trial.renderer
    renderer.reset()
    renderer.run(2)
    before = renderer.film_state()

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(NoiseMeter, "measure", interrupt)
        with pytest.raises(KeyboardInterrupt):
            renderer.run(30, noise=1e-3)
    found = renderer.film_state()
    assert found.taken == before.taken == ((0, 2),)
    assert np.array_equal(sums(found), sums(before))
    assert renderer.run(1) and renderer.film_state().taken == ((0, 3),)


def test_a_thread_that_begins_too_late_adds_nothing(
    trial: Trial, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Who started it was interrupted; it used to take the samples of the interrupted run."""
    renderer, late = trial.renderer, list[Callable[[], None]]()
    renderer.reset()

    def start(work: Callable[[], None], _: tuple[()]) -> None:
        late.append(work)
        raise Injected

    with monkeypatch.context() as patch:
        patch.setattr(_thread, "start_new_thread", start)
        with pytest.raises(Injected):
            renderer.run(3)
    assert renderer.film_state().taken == ()

    def begin(_: clpt.Progress) -> None:
        while late:
            thread = threading.Thread(target=late.pop())
            thread.start()
            thread.join()

    renderer.run(2, begin)
    found = renderer.film_state()
    assert not late and found.taken == ((0, 2),)
    assert np.array_equal(sums(found), trial.known.whole(found.taken))


def test_who_is_interrupted_waits_for_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    began, go_on, ended = threading.Event(), threading.Event(), list[int]()

    def act(item: int) -> None:
        began.set()
        go_on.wait(10)
        ended.append(item)

    def interrupted(_: Threads) -> None:
        monkeypatch.undo()
        began.wait(10)
        threading.Timer(0.05, go_on.set).start()
        raise Injected

    monkeypatch.setattr(Threads, "wait", interrupted)
    with pytest.raises(Injected):
        on_all(act, [1])
    assert ended == [1]


def test_what_is_raised_for_one_item_is_its_result() -> None:
    def act(item: int) -> int:
        return 6 // item

    zero, three = on_all(act, [0, 2])
    assert isinstance(zero, ZeroDivisionError) and three == 3
