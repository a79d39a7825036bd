"""After an error at any line a film is what its renderer says, or it says that it is broken."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import clpt
from tests.faults.interrupts import Injected, Trial, changes, every_line, raising_at, signals, small


@pytest.fixture(scope="module")
def scene(scenes: Path) -> clpt.Scene:
    return small(clpt.load(scenes / "cornell.xml"))


@pytest.fixture(scope="module")
def trial(scene: clpt.Scene) -> Iterator[Trial]:
    made = Trial(lambda: clpt.Renderer(scene, slots=128))
    yield made
    made.renderer.close()


@pytest.mark.parametrize("most", [8, pytest.param(2000, marks=pytest.mark.slow)])
def test_an_error_at_any_line(trial: Trial, most: int) -> None:
    """Of run, step, merge, reset, update and what reads and writes files."""
    for name, act in changes(trial).items():
        every_line(trial, name, act, min(most, 100) if "scene" in name else most)
    assert trial.outcomes["whole"] > 9 * trial.outcomes["broken, reset"]


@pytest.mark.parametrize("count", [20, pytest.param(1000, marks=pytest.mark.slow)])
@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="this system has no timer signals")
def test_a_signal_at_any_moment(trial: Trial, count: int) -> None:
    assert signals(trial, count) == count


def test_an_interrupted_run_keeps_what_it_has(trial: Trial) -> None:
    """The finding: an interrupt in `run` left samples on the film that `taken` did not name."""
    renderer = trial.renderer
    renderer.reset()
    with raising_at(0) as lines:
        renderer.run(4)
    renderer.reset()
    with raising_at(lines[0] // 2), pytest.raises(Injected):
        renderer.run(4)
    state = renderer.film_state()
    assert state.taken == ((0, 4),) and renderer.samples == 4
    assert state.samples.max() <= 4 and trial.known.explains(state)


def test_a_broken_renderer_says_so_until_it_is_reset(
    trial: Trial, monkeypatch: pytest.MonkeyPatch
) -> None:
    renderer = trial.renderer
    renderer.reset()
    wavefront = renderer._wavefront

    def fail(*_: object) -> None:
        raise clpt.DeviceError("the device is gone")

    with monkeypatch.context() as patch:
        patch.setattr(wavefront, "accumulate_film", fail)
        with pytest.raises(clpt.DeviceError, match="the device is gone"):
            renderer.run(2)
    told = "this Renderer is broken: its run was stopped by DeviceError .the device is gone.; reset"
    for use in (renderer.image, renderer.step, renderer.film_state, lambda: renderer.samples):
        with pytest.raises(clpt.DeviceError, match=told):
            use()
    renderer.reset()
    renderer.run(2)
    assert renderer.film_state().taken == ((0, 2),)


def test_a_callback_changes_no_film(trial: Trial) -> None:
    """What a run calls may look at the picture; it neither adds samples nor saves half of them."""
    renderer, told = trial.renderer, []
    renderer.reset()

    def progress(_: clpt.Progress) -> bool:
        assert np.isfinite(renderer.image()).all() and renderer.samples == 0
        for change in (renderer.step, renderer.reset, renderer.film_state, renderer._hold):
            with pytest.raises(clpt.DeviceError, match="the film changes: run calls this") as error:
                change()
            told.append(error)
        return False

    renderer.run(4, progress)
    assert told and renderer.film_state().taken == ((0, 4),)


def test_a_hold_that_was_stopped_holds_nothing(trial: Trial) -> None:
    """Half of its copies may be of another film than the one before."""
    renderer = trial.renderer
    renderer.reset()
    renderer.run(1)
    renderer._hold()
    renderer.run(1)
    with raising_at(0) as lines:
        renderer._hold()
    with raising_at(lines[0] - 3), pytest.raises(Injected):
        renderer._hold()
    with pytest.raises(clpt.SceneError, match="no film is held"):
        renderer.saved_film(held=True)


def test_a_handler_cancels_whatever_it_interrupts(trial: Trial) -> None:
    """It takes no lock that the interrupted code may have."""
    renderer = trial.renderer
    renderer.reset()
    locks = [one for one in vars(renderer._stop).values() if hasattr(one, "acquire")]
    assert not locks and not isinstance(renderer._stop, threading.Event)
    renderer.cancel()
    assert not renderer.run(1) and renderer.samples == 0
