"""The algebra of films, over all who take samples: a device, several devices, and a cluster.

Samples in any split, order and grouping, taken and gone on with by whoever, make the film of one
run: to the bit, and so is every picture of it, and every file.
"""

from __future__ import annotations

import dataclasses
import itertools
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest

import clpt
from clpt import device as dev
from clpt import images
from clpt.cli.files import outputs
from clpt.cli.options.grading import Grading
from clpt.cluster import crew, tasks
from clpt.errors import SceneError
from clpt.render.film import film_file
from clpt.render.film.film_file import SavedFilm
from clpt.render.film.pictures import Pictures
from clpt.render.resumable import ResumableRenderer
from clpt.render.wavefront.wavefront import Counts
from clpt.scene import Scene, shapes
from clpt.scene.integrators import (
    Box,
    Independent,
    Mitchell,
    ParticleTracer,
    Tent,
    Vcm,
    Zsobol,
)
from clpt.scene.integrators import Path as PathTracing
from clpt.scene.materials import Dielectric
from tests.cluster.machines import machines
from tests.pictures.support import with_film

SCENES = Path(__file__).resolve().parents[1] / "scenes"
SPLIT = (5, 8, 3)  # of all samples
RANGES = ((0, 4), (4, 6), (6, 16))
NOISE, MOST = 0.1, 40  # a limit of noise, with which MOST stands in the place of SPLIT[1]
LAYERS = (
    "albedo", "shading_normal", "depth", "position", "shape_id", "direct", "indirect",
    "crypto_object", "samples", "variance",
)  # fmt: skip
FORMATS = (".exr", ".png", ".hdr", ".pfm", ".npy")
WIDE = {"width": 48, "height": 40}  # has several cells of noise


@dataclass(frozen=True, eq=False)
class Plan:
    """A kind of film: of Cornell's box with a ball of glass.

    film: its parameters; changes: of the scene; halves: whether even and odd samples are kept
    apart; noise: the limit, None without.
    """

    film: dict[str, Any] = field(default_factory=dict)
    changes: dict[str, Any] = field(default_factory=dict)
    halves: bool = False
    noise: float | None = None

    @cached_property
    def scene(self) -> Scene:
        given = {"mode": "rgb", "width": 26, "height": 18, **self.film}
        scene = with_film(clpt.load(SCENES / "cornell.xml"), **given)
        ball = shapes.Sphere(center=(0.3, 0.3, 0.2), radius=0.3, material=Dielectric())
        changes = {"integrator": PathTracing(), "noise": self.noise, **self.changes}
        return dataclasses.replace(scene, shapes=[*scene.shapes, ball], **changes)

    @property
    def splits(self) -> tuple[int, ...]:
        """Samples of runs, one after the other."""
        return SPLIT if self.noise is None else (SPLIT[0], MOST, SPLIT[2])


LIGHT_PATHS = {"integrator": PathTracing(light_paths=1)}
QUICK = {
    "everything": Plan(
        {"filter": Mitchell(), "alpha": True, "layers": LAYERS},
        {"integrator": PathTracing(light_paths=0.3)}, halves=True,
    ),
    "bands": Plan({"mode": "spectral", "bands": 5}),
    "noise": Plan({**WIDE, "mode": "spectral", "bands": 5}, noise=NOISE),
}  # fmt: skip
PLANS = {
    **QUICK,
    "rgb": Plan({"filter": Box()}),
    "spectral": Plan({"mode": "spectral"}),
    "weights_alpha": Plan({"filter": Mitchell(), "alpha": True}),
    "importance": Plan({"filter": Mitchell(), "filtering": "importance"}),
    "independent": Plan({}, {"sampler": Independent()}),
    "zsobol": Plan({}, {"sampler": Zsobol(), "spp": sum(SPLIT)}),
    "halves": Plan({"filter": Tent()}, halves=True),
    "halves_bands": Plan({"mode": "spectral", "bands": 3}, halves=True),
    "layers": Plan({"layers": LAYERS[:5]}),
    "light_paths": Plan({}, LIGHT_PATHS),
    "light_share": Plan({"filter": Mitchell()}, {"integrator": PathTracing(light_paths=0.3)}),
    "vcm": Plan({}, {"integrator": Vcm()}),
    "vcm_bands": Plan({"mode": "spectral", "bands": 4}, {"integrator": Vcm()}, halves=True),
    "particle_tracer": Plan({"filter": Tent()}, {"integrator": ParticleTracer()}),
    "noise_rgb": Plan(WIDE, noise=NOISE),
    "noise_layers": Plan({**WIDE, "layers": LAYERS[:5]}, noise=NOISE),
    "noise_lights": Plan(WIDE, LIGHT_PATHS, noise=NOISE),
}
MAKERS = ("device", "devices", "cluster")
Maker = Callable[..., ResumableRenderer]


def of_plans(which: Callable[[Plan], bool] = lambda plan: True) -> pytest.MarkDecorator:
    """Parametrize a test over films."""
    cases = [
        pytest.param(plan, marks=() if name in QUICK else pytest.mark.slow, id=name)
        for name, plan in PLANS.items()
        if which(plan)
    ]
    return pytest.mark.parametrize("plan", cases)


def pairs() -> Iterator[Any]:
    """Yield films, who saves them and who goes on: of quick films all pairs, of others three.

    Of bands three pairs are quick, in which each is once.
    """
    for number, (name, plan) in enumerate(PLANS.items()):
        for (i, saving), (k, loading) in itertools.product(enumerate(MAKERS), repeat=2):
            turn = (i + k + number) % len(MAKERS) == 0
            if name in QUICK or turn:
                marks = () if name in QUICK and (turn or name != "bands") else pytest.mark.slow
                yield pytest.param(
                    plan, saving, loading, marks=marks, id=f"{name}-{saving}-{loading}"
                )


@pytest.fixture(scope="module")
def client() -> Iterator[Any]:
    """A cluster of two workers, of which all tests have the one."""
    pytest.importorskip("distributed")
    if sys.platform == "win32":
        pytest.skip("workers are told to stop by signals of POSIX")
    with machines(2) as found:
        yield found.client


@pytest.fixture(scope="module", autouse=True)
def _shared(one_context: None) -> None:
    """Let renderers share what is compiled."""


@pytest.fixture(autouse=True)
def _small_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let devices have blocks of few samples, so that small pictures have many."""
    monkeypatch.setattr(crew, "BLOCK_SECONDS", 0.005)


@pytest.fixture
def make(request: pytest.FixtureRequest, plan: Plan) -> Iterator[Maker]:
    """Make a renderer of the film, whose samples are taken by one of MAKERS."""
    with ExitStack() as opened:

        def made(name: str, first_sample: int = 0, **more: int) -> ResumableRenderer:
            given = {"halves": plan.halves, "first_sample": first_sample, **more}
            renderer: ResumableRenderer
            if name == "device":
                renderer = clpt.Renderer(plan.scene, **given)
            elif name == "devices":
                renderer = clpt.MultiRenderer(plan.scene, [dev.choose(), dev.choose()], **given)
            else:
                from clpt.cluster.cluster_renderer import ClusterRenderer

                client = request.getfixturevalue("client")
                renderer = ClusterRenderer(plan.scene, client, **given)
            return opened.enter_context(renderer)

        yield made


@dataclass
class Whole:
    """What one run on one device makes: its film, pictures, figures, and files by suffix."""

    saved: SavedFilm
    pictures: dict[str, np.ndarray]
    shown: np.ndarray
    active: float
    files: dict[str, dict[str, np.ndarray]]


@pytest.fixture(scope="module")
def wholes() -> dict[Plan, Whole]:
    """What was made by one run, for all tests of a film."""
    return {}


@pytest.fixture
def whole(plan: Plan, wholes: dict[Plan, Whole], tmp_path: Path) -> Whole:
    if plan not in wholes:
        with clpt.Renderer(plan.scene, halves=plan.halves) as one:
            assert one.run(sum(plan.splits), noise=plan.noise)
            films = one.saved_film(), pictures(one), one.film.get(), one.active
            wholes[plan] = Whole(*films, files(one, tmp_path))
    return wholes[plan]


def pictures(source: Pictures) -> dict[str, np.ndarray]:
    """All pictures of a film, by name."""
    found = {"image": source.image(), "colours": source.colours(), **source.layers()}
    found["per pixel"] = source.samples_per_pixel()
    if source.form.bands:
        bands = source.spectral_image()
        found["bands"], found["centres"] = bands.values, np.array(bands.lambdas)
    try:
        found["even"], found["odd"] = source.halves()
    except SceneError as error:
        assert "halves=True" in str(error)
    found["light paths"] = np.array(source.light_paths_per_pixel())
    return found


def files(source: ResumableRenderer | SavedFilm, folder: Path) -> dict[str, dict[str, np.ndarray]]:
    """What files of a film hold, by suffix and the names of channels."""
    found = {}
    for suffix in FORMATS:
        path = folder / f"a{suffix}"
        outputs.write(path, source, {}, Grading())
        if suffix == ".exr":
            with OpenEXR.File(str(path), separate_channels=True) as file:
                found[suffix] = {name: one.pixels for name, one in file.channels().items()}
        else:
            found[suffix] = {suffix: np.load(path) if suffix == ".npy" else images.read(path)}
    return found


def check_arrays(found: dict[str, np.ndarray], wanted: dict[str, np.ndarray]) -> None:
    assert found.keys() == wanted.keys()
    for name, values in wanted.items():
        np.testing.assert_array_equal(found[name], values, name)


def check_film(found: clpt.FilmState, wanted: clpt.FilmState) -> None:
    check_arrays(found.arrays, wanted.arrays)
    assert (found.taken, found.scale) == (wanted.taken, wanted.scale)


def check(source: ResumableRenderer | SavedFilm, whole: Whole) -> None:
    """Check that a film, its pictures and its figures are those of one run."""
    saved = source.saved_film()
    check_film(saved.film, whole.saved.film)
    assert saved.form == whole.saved.form and saved.origin == whole.saved.origin
    check_arrays(pictures(source), whole.pictures)


def check_counts(renderer: ResumableRenderer, whole: Whole) -> None:
    counts, wanted = renderer.counts, Counts(**whole.saved.counts)
    for name in ("samples", "rays", "rejected", "full"):  # a cluster does not tell rays apart
        assert getattr(counts, name) == getattr(wanted, name), name


@of_plans()
@pytest.mark.parametrize("maker", MAKERS)
def test_any_split_is_one_run(maker, make, plan, whole):
    """What is told meanwhile only grows; the picture for screens is on the device too."""
    renderer, told = make(maker), []
    for samples in plan.splits:
        assert renderer.run(samples, lambda p: told.append(p.samples), noise=plan.noise)
    check(renderer, whole)
    assert renderer.samples == sum(plan.splits) and renderer.active == whole.active
    assert (renderer.active < 1.0) == (plan.noise is not None)
    check_counts(renderer, whole)
    assert told and told == sorted(told)
    shown = renderer.film.get()
    np.testing.assert_array_equal(shown, whole.shown)
    colours, samples = whole.pictures["colours"], whole.pictures["per pixel"]
    np.testing.assert_array_equal(samples, shown[..., 3])
    if "Portable Computing Language" in renderer.device.queue.device.platform.name:
        np.testing.assert_array_equal(colours, shown[..., :3])  # it divides as the host does
    top = np.abs(colours).max()
    np.testing.assert_allclose(colours, shown[..., :3], rtol=1e-6, atol=1e-6 * top)


@of_plans(lambda plan: plan.noise is None)  # with noise, pixels hang on all samples before
@pytest.mark.parametrize("maker", MAKERS)
def test_films_add_in_any_order_and_grouping(maker, make, plan, whole, tmp_path):
    """Some of the samples are taken elsewhere; what cannot be added changes nothing."""
    films = []
    for (first, end), who in zip(RANGES, (maker, "device", maker), strict=True):
        renderer = make(who, first)
        assert renderer.run(end - first) and renderer.first_sample == first
        renderer.save_state(tmp_path / "a.film")
        films.append(film_file.read(tmp_path / "a.film"))
        assert films[-1].film.taken == ((first, end),)
    for a, b, c in itertools.permutations(films):
        for total in (a.merged(b).merged(c), a.merged(b.merged(c))):
            check_film(total.film, whole.saved.film)
            assert len(total.sessions) >= 3 and total.adaptive == {}
            assert total.counts["samples"] == whole.saved.counts["samples"]
    check(total, whole)
    check_files(total, whole, tmp_path)
    renderer = make(maker)
    assert renderer.run(RANGES[0][1])
    for again in (films[2], films[1]):  # with a gap between
        renderer.merge(again.film)
        before = renderer.film_state()
        with pytest.raises(SceneError, match="would be taken twice"):
            renderer.merge(again.film)
        narrow = dataclasses.replace(again.film, words=again.film.words[..., :-1])
        with pytest.raises(SceneError, match="another form"):
            renderer.merge(narrow)
        check_film(renderer.film_state(), before)
    check(renderer, whole)
    renderer = make(maker)  # which goes on from the films of others
    renderer.merge(films[0].film.merged(films[1].film))
    assert renderer.samples == RANGES[2][0] and renderer.run(RANGES[2][1] - RANGES[2][0])
    check(renderer, whole)


def check_files(source: ResumableRenderer | SavedFilm, whole: Whole, folder: Path) -> None:
    found = files(source, folder)
    for suffix, wanted in whole.files.items():
        check_arrays(found[suffix], wanted)


@pytest.mark.parametrize(("plan", "saving", "loading"), list(pairs()))
def test_a_saved_film_is_gone_on_with(saving, loading, make, plan, whole, tmp_path):
    """A stopped run leaves no trace in what was held before; the loader's own film is gone."""
    path, (first, second, third) = tmp_path / "a.film", plan.splits
    renderer = make(saving)
    assert renderer.run(first, noise=plan.noise)
    renderer._hold()
    little = plan.noise and 1e-4
    assert not renderer.run(10**6, lambda progress: False, noise=little)
    film_file.write(path, renderer.saved_film(held=True))
    assert film_file.read(path).film.taken == ((0, first),)
    for who, samples, slots in ((loading, second, 128), (saving, third, 64)):
        renderer = make(who, slots=slots)
        assert renderer.run(3)
        renderer.load_state(path)
        assert renderer.samples == film_file.read(path).film.taken[-1][1]
        assert renderer._former_seconds > 0.0
        assert renderer.run(samples, noise=plan.noise)
        renderer.save_state(path)
        assert not renderer.warnings
    check(renderer, whole)
    check_files(film_file.read(path), whole, tmp_path)
    renderer = make(loading)
    renderer.load_state(path)
    check(renderer, whole)
    check_files(renderer, whole, tmp_path)
    check_counts(renderer, whole)
    assert len(film_file.read(path).sessions) >= 3


@of_plans(lambda plan: plan.noise is not None)
@pytest.mark.parametrize("maker", MAKERS)
def test_noise_is_decided_as_by_one_device(maker, make, plan):
    """Also after samples of every pixel, and between them."""
    films = []
    for who in ("device", maker):
        renderer = make(who)
        for samples, noise in ((3, None), (60, NOISE), (1, None), (200, NOISE)):
            assert renderer.run(samples, noise=noise)
        films.append(renderer.saved_film())
    check_film(films[1].film, films[0].film)
    assert len(np.unique(films[0].film.samples)) > 1
    assert films[1].counts["samples"] == films[0].counts["samples"]
    check_arrays(pictures(films[1]), pictures(films[0]))


@pytest.mark.parametrize("plan", [pytest.param(QUICK["noise"], id="noise")])
@pytest.mark.parametrize("maker", MAKERS)
def test_a_film_that_does_not_fit_changes_nothing(maker, make, plan):
    renderer = make("device")
    assert renderer.run(SPLIT[0], noise=plan.noise)
    saved = renderer.saved_film()
    torn = {name: array for name, array in saved.adaptive.items() if name != "next"}
    narrow = dataclasses.replace(saved.film, words=saved.film.words[..., :-1])
    other = dataclasses.replace(saved.origin, kernels="0")
    way = {**saved.origin.settings, "chosen.guide_paths": 1 << 20}
    renderer = make(maker)
    assert renderer.run(3)
    before = renderer.film_state()
    for changes, told in (
        ({"adaptive": torn}, "adaptive sampling does not fit"),
        ({"film": narrow}, "another form"),
        ({"origin": other}, "kernels: of clpt"),
        ({"origin": dataclasses.replace(other, settings=way)}, "kernels: of clpt"),
    ):
        with pytest.raises(SceneError, match=told):
            renderer._restore(dataclasses.replace(saved, **changes))
        check_film(renderer.film_state(), before)
    assert renderer.run(2) and renderer.samples == 5


@pytest.mark.parametrize("plan", [pytest.param(QUICK["noise"], id="noise")])
@pytest.mark.parametrize("maker", MAKERS)
def test_a_stop_before_a_film_is_put_leaves_all_as_it_was(maker, make, plan, monkeypatch):
    """Also the state of adaptive sampling, and where it is saved."""
    renderer = make("device")
    assert renderer.run(MOST, noise=plan.noise)
    other = renderer.saved_film()
    renderer = make(maker)
    assert renderer.run(SPLIT[0], noise=plan.noise)
    before = renderer.saved_film()

    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(type(renderer), "_put", stop)
        with pytest.raises(KeyboardInterrupt):
            renderer._restore(other)
    after = renderer.saved_film()
    check_film(after.film, before.film)
    check_arrays(dict(after.adaptive), dict(before.adaptive))
    assert not np.array_equal(after.adaptive["next"], other.adaptive["next"])
    assert renderer.run(MOST - SPLIT[0], noise=plan.noise)
    check_film(renderer.film_state(), other.film)


def test_a_worker_s_renderer_keeps_no_choice_of_another_scene():
    """Light paths suit the ball of glass, not the box without it: "auto" is asked for each."""
    with_ball = PLANS["rgb"].scene
    without = dataclasses.replace(with_ball, shapes=with_ball.shapes[:-1])
    job = tasks._Job(without, [dev.choose()], {})
    for scene in (with_ball, without):
        job.block(0, 1, None, lambda: True)
        assert job.try_scene(scene)
        assert job.renderer.form.weighed == (scene is with_ball)
        made = tasks._Job(scene, [dev.choose()], {})
        blocks = [
            tasks.state_from_arrays(one.block(2, 4, None, lambda: True)) for one in (job, made)
        ]
        check_film(*blocks)
