"""`clpt render --cluster` that ends early, and goes on: the picture of one process."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("distributed")
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")

sys.path.insert(0, str(Path(__file__).parent))
from machines import ENVIRONMENT, LONGEST, ROOT, machines, wait_until  # noqa: E402
from machines import scene as box  # noqa: E402

from clpt.__main__ import run  # noqa: E402
from clpt.cli.files import outputs  # noqa: E402
from clpt.cluster import processes  # noqa: E402
from clpt.cluster.cluster_renderer import ClusterRenderer  # noqa: E402
from clpt.cluster.tasks import film_digest  # noqa: E402
from clpt.render.film import film_file  # noqa: E402
from clpt.render.renderer import Renderer  # noqa: E402

BOX = str(ROOT / "scenes/cornell_box")
COMMON = ["--size", "32x24", "-o", "a.npy"]
SAVED = "a.resume.exr"


@pytest.fixture(scope="module")
def hub():
    """Two workers."""
    with machines(2) as found:
        yield found


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def render(*more: str) -> int:
    return run(["render", BOX, *COMMON, *more])


def whole(spp: int) -> np.ndarray:
    """The picture of one process."""
    assert run(["render", BOX, *COMMON[:2], "-o", "whole.npy", "--spp", str(spp), "--quiet"]) == 0
    return np.load("whole.npy")


def test_the_picture_so_far_and_a_part_of_it(hub, folder, monkeypatch):
    """--every writes it while workers render; spp is the mean over the pixels of the crop."""
    written: list[float] = []
    write = outputs.write

    def count(path, source, stats, grading):
        write(path, source, stats, grading)
        written.append(stats["spp"])

    monkeypatch.setattr(outputs, "write", count)
    more = ["--every", "0.01s", "--crop", "25%:75%,4:"]
    assert render("--spp", "20", *hub.on, *more) == 0
    assert len(written) > 1 and written == sorted(written) and written[-1] == 20.0
    np.testing.assert_array_equal(np.load("a.npy"), whole(20)[4:, 8:24])


def test_a_cluster_goes_on_where_it_was_saved(hub, folder, capsys):
    """With more samples, with none, by one process: to the bit."""
    on = [*hub.on]
    assert render("--spp", "20", *on, "--checkpoint", "1h") == 0
    saved = film_file.read(SAVED)
    assert saved.film.taken == ((0, 20),)
    assert saved.counts["samples"] == 20 * 32 * 24
    with Renderer(box(), threads=1) as one:
        assert [session.device for session in saved.sessions] == [one._device_class()]
    assert render("--spp", "50", *on, "--resume") == 0
    told = capsys.readouterr().err
    assert f"goes on from {SAVED}: samples 0 to 19" in told and "warning" not in told
    np.testing.assert_array_equal(np.load("a.npy"), whole(50))
    assert film_file.read(f"{SAVED}.1").film.taken == ((0, 20),)
    os.remove("a.npy")
    assert render("--spp", "50", *on) == 0  # nothing is left to do, but the picture is written
    np.testing.assert_array_equal(np.load("a.npy"), whole(50))
    capsys.readouterr()
    assert render("--spp", "60") == 0
    assert "% of the pixels" not in capsys.readouterr().err
    np.testing.assert_array_equal(np.load("a.npy"), whole(60))
    assert render("--spp", "60", "--seed", "3", *on) == 2
    assert f"{SAVED}: is of something else: seed: 0 -> 3" in capsys.readouterr().err


def test_ranges_of_a_cluster_are_merged(hub, folder, capsys):
    on = [*hub.on, "--size", "32x24"]
    assert run(["render", BOX, *on, "--samples", "0:7", "-o", "a.film"]) == 0
    assert run(["render", BOX, *on, "--samples", "7:30", "-o", "b.film"]) == 0
    assert film_file.read("b.film").film.taken == ((7, 30),)
    assert run(["merge", "a.film", "b.film", "-o", "a.npy", "-o", "all.film"]) == 0
    with Renderer(box(), threads=1) as one:
        one.run(30)
        assert film_digest(film_file.read("all.film").film) == film_digest(one.film_state())


def test_gaps_are_filled(hub, folder, capsys):
    """As blocks leave them that were under way when a render ended."""
    with Renderer(box(), threads=1) as one:
        one.run(5)
        one.reset(first_sample=0)
        one.run(3)
        first = one.saved_film()
        one.reset(first_sample=8)
        one.run(4)
        film_file.write(Path(SAVED), first.merged(one.saved_film()))
    assert render("--spp", "20") == 2
    told = capsys.readouterr().err
    assert "samples 0 to 2, 8 to 11, not those from 0 on" in told and "--cluster local:1" in told
    on = [*hub.on]
    assert render("--spp", "4", *on, "--samples", "9:12") == 2
    assert render("--samples", "1:30", *on) == 2
    assert "not those from 1 on" in capsys.readouterr().err
    assert render("--spp", "9", *on) == 0  # no sample before the last one is missing
    assert film_file.read(SAVED).film.taken == ((0, 12),)
    np.testing.assert_array_equal(np.load("a.npy"), whole(12))


def test_what_a_stop_cuts_is_not_in_what_is_held(hub, folder):
    with ClusterRenderer(box(), hub.client) as renderer:
        assert renderer.run(10)
        stopped = []

        def stop(progress):
            stopped.append(progress.samples)
            return len(stopped) < 3

        assert not renderer.run(10**6, stop)
        renderer._hold()
        held, every = renderer.saved_film(held=True).film, renderer.film_state()
        assert every.samples.sum() >= held.samples.sum() == 32 * 24 * held.samples[0, 0]
        assert held.samples[0, 0] == sum(end - first for first, end in held.taken)
        film_file.write(Path(SAVED), renderer.saved_film(held=True))
    with ClusterRenderer(box(), hub.client) as renderer:
        renderer.load_state(SAVED)
        last = held.taken[-1][1]
        if renderer.samples < last:
            assert renderer.run(last - renderer.samples)
        assert renderer.film_state().taken == ((0, last),)
        assert np.all(renderer.film_state().samples == last)


def started(folder: Path, *more: str) -> subprocess.Popen:
    """A command that renders for long, once it has told of samples and a checkpoint is there."""
    command = [sys.executable, "-m", "clpt", "render", BOX, *COMMON, "--spp", "1000000", *more]
    process = subprocess.Popen(
        [*command, "--checkpoint", "1s"], env=ENVIRONMENT, cwd=folder, stderr=subprocess.PIPE,
        text=True,
    )  # fmt: skip
    try:
        wait_until((folder / SAVED).exists, "a checkpoint")
    except BaseException:
        process.kill()
        raise
    return process


@pytest.mark.slow
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGINT, signal.SIGTERM])
def test_a_client_that_ends_goes_on(how, hub, folder, capsys):
    """Killed, or told to stop: what was saved is whole, and the rest is that of one process."""
    process = started(folder, *hub.on)
    time.sleep(1.5)
    process.send_signal(how)
    told = process.communicate(timeout=LONGEST)[1]
    assert process.returncode == (-how if how == signal.SIGKILL else 128 + how), told
    assert "Traceback" not in told
    saved = film_file.read(SAVED).film
    done = sum(end - first for first, end in saved.taken)
    assert done > 0 and np.all(saved.samples == done)
    last = saved.taken[-1][1]
    assert render("--spp", str(last + 10), *hub.on, "--resume") == 0
    assert "of the pixels have a sample" not in capsys.readouterr().err
    assert film_file.read(SAVED).film.taken == ((0, last + 10),)
    np.testing.assert_array_equal(np.load("a.npy"), whole(last + 10))


@pytest.mark.slow
def test_a_lost_scheduler(hub, folder, capsys):
    """The command ends with a message and the film, also without checkpoints; it goes on."""
    keyed = ["--keys", str(folder / "keys")]
    command = [sys.executable, "-m", "clpt", "cluster", "start", "--port", "0", *keyed]
    more = {"env": ENVIRONMENT, "stderr": subprocess.DEVNULL, "text": True}
    scheduler = subprocess.Popen(command, stdout=subprocess.PIPE, **more)
    ended = [scheduler]
    try:
        address = scheduler.stdout.readline().strip()
        ended.append(processes.start_worker(address, folder / "keys", "--threads", "1"))
        command = [sys.executable, "-m", "clpt", "render", BOX, *COMMON, "--spp", "1000000"]
        client = subprocess.Popen(
            [*command, "--cluster", address, *keyed, "--checkpoint", "0"], cwd=folder,
            **more | {"stderr": subprocess.PIPE},
        )  # fmt: skip
        ended.append(client)
        lines = [client.stderr.readline()]
        while "rays/s" not in lines[-1] or lines[-1].startswith("0/"):
            lines.append(client.stderr.readline())
            assert lines[-1], lines
        scheduler.kill()
        told = client.communicate(timeout=LONGEST)[1]
    finally:
        processes.end(ended)
    assert client.returncode == 2, told
    assert "scheduler is gone" in told and f"{SAVED}  --resume goes on from it" in told
    last = film_file.read(SAVED).film.taken[-1][1]
    assert render("--spp", str(last + 5), *hub.on, "--resume") == 0
    assert "of the pixels have a sample" not in capsys.readouterr().err
    np.testing.assert_array_equal(np.load("a.npy"), whole(last + 5))
