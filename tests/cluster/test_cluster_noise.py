"""Adaptive sampling by several workers: the film of one process, whatever they do."""

from __future__ import annotations

import dataclasses
import os
import signal
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("distributed")
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")

sys.path.insert(0, str(Path(__file__).parent))
from machines import LONGEST, ROOT, client_of, machines, scene, wait_until  # noqa: E402

import clpt  # noqa: E402
from clpt import images  # noqa: E402
from clpt.__main__ import run  # noqa: E402
from clpt.cluster import tasks  # noqa: E402
from clpt.cluster.cluster_renderer import ClusterRenderer  # noqa: E402
from clpt.errors import ClusterError, SceneError  # noqa: E402
from clpt.render.film import film_file  # noqa: E402
from clpt.scene.integrators import Path as PathIntegrator  # noqa: E402

NOISE, MOST = 0.1, 300
KINDS = ("path", "light_paths")
TWO_DEVICES = (
    "from clpt import device as dev\nfrom clpt.cluster import tasks\n"
    "tasks._devices = lambda: [dev.choose(threads=1), dev.choose(threads=1)]"
)


def plan(kind="path"):
    """A box, of which some cells are calm long before others."""
    light_paths = 0.5 if kind == "light_paths" else 0
    return dataclasses.replace(
        scene(), integrator=PathIntegrator(light_paths=light_paths, max_depth=4)
    )


@pytest.fixture(scope="module")
def two():
    """Two workers."""
    with machines(2) as found:
        yield found


@pytest.fixture(scope="module")
def expected():
    """The digests of films of one process, by the kind of scene."""
    found: dict[str, str] = {}
    for kind in KINDS:
        with clpt.Renderer(plan(kind), threads=1) as one:
            one.run(MOST, noise=NOISE)
            found[kind] = tasks.film_digest(one.film_state())
    return found


def digest(renderer):
    return tasks.film_digest(renderer.film_state())


@pytest.mark.parametrize("kind", ["path", pytest.param("light_paths", marks=pytest.mark.slow)])
def test_a_worker_with_two_devices(kind, expected):
    """Alone: beside others it may come too late for a block of so small a picture."""
    with machines() as alone:
        alone.start(TWO_DEVICES)
        alone.wait(1)
        with ClusterRenderer(plan(kind), alone.client) as renderer:
            assert renderer.run(MOST, noise=NOISE)
            assert digest(renderer) == expected[kind]
            assert not renderer.refused
            [record] = renderer.workers.values()
            assert record.samples > 0


def test_what_makes_no_sense(two):
    with ClusterRenderer(plan(), two.client) as renderer:
        with pytest.raises(SceneError, match="noise"):
            renderer.run(4, noise=-1.0)
        renderer.run(2)
        with clpt.Renderer(plan(), first_sample=5, threads=1) as later:
            later.run(2)
            renderer.merge(later.film_state())
        with pytest.raises(SceneError, match="samples are missing"):
            renderer.run(4, noise=NOISE)
        assert renderer.run(3)
        assert renderer.run(4, noise=NOISE)

        def fail(progress):
            raise KeyError("here")

        with pytest.raises(KeyError, match="here"):
            renderer.run(4, fail, noise=NOISE)
        assert renderer.run(4, noise=NOISE)


def test_selections_that_are_none(two):
    for wrong in ({"paths": "all", "ends": b""}, {"paths": "x", "pixels": 1, "ends": b""}, {}):
        with pytest.raises(ClusterError, match="no selection"):
            tasks.unpack_selection(wrong)
    assert tasks.unpack_selection({"paths": "lights", "pixels": 3, "ends": b""}).ends is None


LONG = {"samples": 8000, "noise": 0.005}


@pytest.fixture(scope="module")
def of_long():
    """The digest of a film that takes some seconds."""
    with clpt.Renderer(plan(), threads=1) as one:
        one.run(LONG["samples"], noise=LONG["noise"])
        return tasks.film_digest(one.film_state())


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP], ids=["killed", "stopped"])
def test_workers_that_end_or_hang(number, two, of_long):
    """In the middle of a round: others take its blocks, and the film is the same."""
    others = [two.start(), two.start()]
    two.wait(4)
    left = list(others)
    try:
        with ClusterRenderer(plan(), two.client) as renderer:
            while len(renderer.workers) < 4:
                assert renderer.run(50)
            renderer.update(scene=plan())
            looks = iter(range(10**9))

            def disturb(progress):
                if left and next(looks) % 2:
                    os.kill(left.pop().pid, number)

            assert renderer.run(LONG["samples"], disturb, noise=LONG["noise"])
            assert not left
            assert digest(renderer) == of_long
    finally:
        for process in others:
            two.end(process)


def render(*more: str) -> int:
    return run(["render", str(ROOT / "scenes/cornell_box"), "--size", "32x24", *more])


@pytest.mark.slow
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGINT])
def test_a_client_that_ends_goes_on(how, two, tmp_path, monkeypatch):
    """To the film of `clpt render --noise` in one process; and a worker dies meanwhile."""
    monkeypatch.chdir(tmp_path)
    third = two.start()
    two.wait(3)
    noisy = ["--noise", "0.01", "--spp", "6000", "-o", "a.film", "--checkpoint", "1s"]
    command = ["render", str(ROOT / "scenes/cornell_box"), "--size", "32x24", *noisy]
    command += [*two.on]
    with client_of(command, tmp_path) as client:
        wait_until((tmp_path / "a.resume.exr").exists, "a checkpoint")
        two.end(third)
        client.send_signal(how)
        told = client.communicate(timeout=LONGEST)[1]
    assert client.returncode == (-how if how == signal.SIGKILL else 128 + how), told
    assert "Traceback" not in told
    saved = film_file.read("a.resume.exr")
    assert saved.adaptive and saved.film.samples.max() < 6000
    assert run([*command, "--resume"]) == 0
    assert render(*noisy[:4], "-o", "whole.film") == 0
    digests = [tasks.film_digest(film_file.read(name).film) for name in ("a.film", "whole.film")]
    assert digests[0] == digests[1]


@pytest.mark.slow
@pytest.mark.parametrize("method", ["oidn", "statistical"])
def test_a_limit_after_denoising_is_that_of_one_process(method, two, tmp_path, monkeypatch):
    """The client denoises both halves of the merged film and decides: to the film of one process,
    also from the command line. Without a denoiser it decides otherwise."""
    if method == "oidn":
        pytest.importorskip("pyoidn", reason="Open Image Denoise is not installed")
    given = dataclasses.replace(plan(), noise=NOISE)
    with clpt.Renderer(given, threads=1, denoise=method) as one:
        one.run(MOST, noise=NOISE)
        wanted, picture = tasks.film_digest(one.film_state()), one.denoised()
        samples = one.film_state().samples
        assert samples.max() > 16 and samples.min() < MOST
    with ClusterRenderer(given, two.client, denoise=method) as renderer:
        assert renderer.run(MOST, noise=NOISE)
        assert digest(renderer) == wanted
        made = clpt.DenoisedPicture(renderer)
        np.testing.assert_allclose(made.image(), picture, rtol=1e-3, atol=1e-5)
    with clpt.Renderer(given, threads=1, halves=True) as one:
        one.run(MOST, noise=NOISE)
        assert (one.film_state().samples != samples).any()
    monkeypatch.chdir(tmp_path)
    noisy = ["--noise", "0.1", "--spp", "200", "--denoise", method]
    assert render(*noisy, *two.on, "-o", "a.film") == 0
    assert render(*noisy, "-o", "b.film") == 0
    films = [film_file.read(name).film for name in ("a.film", "b.film")]
    assert tasks.film_digest(films[0]) == tasks.film_digest(films[1])


def test_the_command_line(two, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    on = [*two.on]
    noisy = ["--noise", "0.05", "--spp", "200"]
    assert render(*noisy, *on, "-o", "a.exr", "-o", "a.film", "--checkpoint", "1h") == 0
    told = capsys.readouterr().err
    assert "2 workers, 0 lost" in told
    assert render(*noisy, "-o", "b.exr", "-o", "b.film") == 0
    films = [film_file.read(name).film for name in ("a.film", "b.film", "a.resume.exr")]
    assert len({tasks.film_digest(film) for film in films}) == 1
    assert len(np.unique(films[0].samples)) > 1
    for name in ("spp", "seed"):
        found = [images.attributes(Path(f"{which}.exr"))[name] for which in "ab"]
        assert found[0] == found[1]
    np.testing.assert_array_equal(images.read("a.exr"), images.read("b.exr"))
    assert render("--noise", "0.05", "--samples", "0:4", *on, "-o", "a.film") == 2
    assert render("--noise", "0.05", *on, "-o", "c.exr", "--time", "10s") == 0
