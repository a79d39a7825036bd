"""The passes of `clpt render`, with a renderer that only counts."""

from __future__ import annotations

import io
import signal
import sys
import threading
import time
from types import SimpleNamespace

import pytest
from rich.console import Console

from clpt.cli import display
from clpt.cli.display import Bar, Lines, clock, device_name, device_names, figures
from clpt.cli.opening import DEVICE_SECONDS
from clpt.cli.process import ending
from clpt.cli.render import report
from clpt.cli.render.passes import GROWTH, End, pass_size, render_samples
from clpt.render.progress import Progress


class Counting:
    """Takes `seconds` for a sample and asks after each."""

    def __init__(self, seconds: float = 0.0):
        self.first_sample = self.samples = 0
        self.seconds, self.passes = seconds, []
        self.active = 1.0

    def run(self, samples, progress, noise=None):
        self.active = 1.0 if noise is None else noise / (self.samples + samples)
        self.active = 0.0 if self.active < 0.01 else self.active
        self.passes.append(samples)
        for done in range(samples):
            time.sleep(self.seconds)
            if not progress(Progress(self.samples + done + 1, 0, 0, 0, 0.0)):
                return False
        self.samples += samples
        return True


def test_passes_grow_and_end_at_the_last_sample():
    renderer = Counting()
    render_samples(renderer, End(100), lambda progress: None)
    assert renderer.passes == [1, 3, 12, 48, 36]


def test_noise_ends_it():
    renderer = Counting()
    render_samples(renderer, End(noise=1.0), lambda progress: None)
    assert renderer.passes == [1, 3, 12, 48, 192]


def test_the_limit_ends_a_pass():
    renderer = Counting(0.05)
    render_samples(renderer, End(seconds=0.01), lambda progress: None)
    assert renderer.passes == [1] and renderer.samples == 0
    renderer = Counting(0.01)
    began = time.perf_counter()
    render_samples(renderer, End(seconds=0.3), lambda progress: None)
    assert 0.3 <= time.perf_counter() - began < 30.0


@pytest.fixture
def listening():
    """Signals as the command sets them, though a shell ignores Ctrl-C in the background."""
    numbers = (signal.SIGINT, *ending.ENDING)
    before = {number: signal.signal(number, signal.SIG_DFL) for number in numbers}
    ending.raise_at_signals()
    yield
    for number, action in before.items():
        signal.signal(number, action)


@pytest.mark.skipif(
    threading.current_thread() is not threading.main_thread(), reason="signals need it"
)
@pytest.mark.parametrize("number", [signal.SIGINT, *ending.ENDING], ids=lambda n: n.name)
def test_a_signal_ends_the_rendering_and_a_second_one_the_program(listening, number):
    shown = []

    def press(progress):
        shown.append(progress)
        if len(shown) == 9:
            signal.raise_signal(number)

    before = signal.getsignal(number)
    with ending.stops() as stopped:
        render_samples(Counting(), End(1000, stopped=stopped), press)
    assert len(shown) == 9 and stopped == [number]
    assert signal.getsignal(number) is before

    with pytest.raises(KeyboardInterrupt) as raised, ending.stops():
        signal.raise_signal(number)
        signal.raise_signal(number)
    assert ending.ended_by(raised.value) == 128 + number
    assert signal.getsignal(number) is before


def test_a_signal_that_is_ignored_stays_ignored(listening):
    """As of nohup."""
    for number in ending.ENDING:
        signal.signal(number, signal.SIG_IGN)
        ending.raise_at_signals()
        with ending.stops() as stopped:
            signal.raise_signal(number)
        assert not stopped and signal.getsignal(number) is signal.SIG_IGN


def test_size_of_a_pass():
    everything = float("inf")
    assert pass_size(10, 1e9, everything, everything) == 10 * GROWTH
    assert pass_size(1000, 2.0, everything, everything) == int(2 * DEVICE_SECONDS)
    assert pass_size(1000, 2.0, 3, everything) == 3
    assert pass_size(1000, 2.0, everything, 0.9) == 1
    assert pass_size(1, 1e-3, everything, everything) == 1  # slower than a sample in a pass


def test_figures():
    told = figures(Progress(32.4, 64, 2_000_000, 9_000_000, 2.0), 0.5)
    assert list(told.values()) == ["32/64 spp", "", "", "4.5 Mrays/s", "0:02", "0:02 left"]
    noisy = figures(Progress(32.4, 0, 2_000_000, 9_000_000, 2.0, 0.25, 0.0312), 0.5)
    assert (noisy["open"], noisy["noise"]) == ("25% of the pixels left", "noise 3.1 %")
    assert clock(59.6) == "1:00" and clock(3661) == "1:01:01"


def test_what_is_left_does_not_count_how_long_the_first_sample_took(monkeypatch, capsys):
    now = [0.0]
    monkeypatch.setattr(time, "perf_counter", lambda: now[0])
    lines = Lines()
    for samples, second in ((1, 20.0), (5, 21.0), (11, 26.0)):
        now[0] = second
        lines.show(Progress(samples, 101, 10**6, 10**6, second))
    first, last = capsys.readouterr().err.splitlines()
    assert first.endswith("0:20")  # nothing is known yet
    assert "0:54 left" in last  # 90 samples, at ten in six seconds


def test_lines_come_now_and_then(monkeypatch, capsys):
    now = [100.0]
    monkeypatch.setattr(time, "perf_counter", lambda: now[0])
    lines = Lines(limit=100.0)
    for second in range(12):
        now[0] = 100.0 + second
        lines.show(Progress(second, 0, 10**6, 10**6, float(second)))
    told = capsys.readouterr().err.splitlines()
    assert [line.split()[0] for line in told] == ["5", "10"]
    assert "0:05" in told[0] and "1:35 left" in told[0]


def test_a_terminal_gets_a_bar():
    bar = Bar(None, "a_{box}")
    bar.console = Console(file=io.StringIO(), force_terminal=True, width=80, highlight=False)
    with bar.compiling("compiling") as programs:
        programs.begin("a"), programs.begin("b"), programs.begin("a"), programs.end("a")
    with bar.rendering():
        bar.show(Progress(1.0, 64, 31_250, 100_000, 1.5))
        bar.show(Progress(64.0, 64, 2_000_000, 9_000_000, 2.0))
    bar.note("a warning with [brackets]")
    told = bar.console.file.getvalue()
    assert "1 of 2, once for this kind of scene" in told
    for words in ("64/64 spp", "a_{box}", "4.5 Mrays/s", "0:00 left", "[brackets]"):
        assert words in told


def test_compilers_are_told_of_where_they_take_long(monkeypatch, capsys):
    """What a cache has, of clpt or of the driver, is there within the patience."""
    lines = Lines()
    with lines.compiling("compiling") as programs:
        programs.begin("a")
    with lines.compiling("compiling"):
        pass
    assert not capsys.readouterr().err
    told = threading.Event()
    monkeypatch.setattr(display, "PATIENCE", 0.001)
    monkeypatch.setattr(lines, "note", lambda text: (print(text), told.set()))
    with lines.compiling("compiling") as programs:
        programs.begin("a"), programs.begin("b")
        assert told.wait(60)
    line = capsys.readouterr().out
    assert line.startswith("compiling: 0 of ") and "once for this kind of scene ..." in line


def test_a_text_stands_at_once_and_goes(monkeypatch, capsys):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    bar = Bar(None, "a_box")
    bar.begin("a_box ...")
    assert capsys.readouterr().err == "a_box ..."
    bar.note("a_box  8x8")
    assert capsys.readouterr().err.startswith("\r\x1b[2K")


@pytest.mark.parametrize(
    "info, name",
    [
        (("Portable Computing Language", "pthread-skylake-avx512-AMD EPYC"), "PoCL AMD EPYC"),
        (("Portable Computing Language", "cpu-haswell-Intel(R) Xeon(R) CPU @ 2.20GHz"),
         "PoCL Intel Xeon"),
        (("NVIDIA CUDA", "NVIDIA H100 80GB HBM3"), "NVIDIA H100 80GB HBM3"),
        (("rusticl", "llvmpipe"), "rusticl llvmpipe"),
    ],
)  # fmt: skip
def test_short_names_of_devices(info, name):
    one = SimpleNamespace(platform=info[0], name=info[1])
    assert device_name(one) == name
    assert device_names([one, one]) == f"2 x {name}"


SO_FAR = ", with the picture so far; 4.2 s in all"


@pytest.mark.parametrize(
    "mean, end, line",
    [
        (64.0, End(64), "64 spp, 4.2 s in all"),
        (28.44, End(64, stopped=[2]), f"stopped at 28 of 64 spp{SO_FAR}"),
        (0.25, End(stopped=[2]), f"stopped at 0.25 spp{SO_FAR}"),
    ],
)  # fmt: skip
def test_the_last_line(mean, end, line):
    paths = SimpleNamespace(paths=SimpleNamespace(pixels=100))
    counts = SimpleNamespace(samples=100 * mean)
    renderer = SimpleNamespace(counts=counts, _wavefront=paths, first_sample=0)
    assert report.ending(renderer, end, 4.2) == line
