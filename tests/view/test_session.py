"""The session behind the page: its pictures, its numbers, and what it makes of requests."""

from __future__ import annotations

import dataclasses
import io
import json
import random
import sys
import threading
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from PIL import Image

from clpt import device, images, load, spectra, transforms
from clpt.cli.files import outputs
from clpt.cli.options.grading import Grading
from clpt.cluster.multi_renderer import MultiRenderer
from clpt.errors import SceneError
from clpt.render.renderer import Renderer
from clpt.scene import Scene, cameras, integrators, lights, shapes
from clpt.scene.params import fields_of
from clpt.view import panels, probe, saving
from clpt.view.look import Look
from clpt.view.messages import COMMANDS, CommandError, Request, parse
from clpt.view.saving import Folder
from clpt.view.session import Session, merged
from clpt.view.target import Change
from tests.view.test_commands import message, valid

CORNELL = Path(__file__).resolve().parents[2] / "scenes" / "cornell_box"
WAIT = 120.0  # [s] at most, for kernels that are compiled on a busy machine


class Audience:
    """An outlet that keeps what it is given."""

    def __init__(self) -> None:
        self.frames: list[tuple[dict[str, Any], bytes]] = []
        self.messages: list[dict[str, Any]] = []
        self._news = threading.Condition()

    def picture(self, header: dict[str, Any], data: bytes) -> None:
        with self._news:
            self.frames.append((header, data))
            self._news.notify_all()

    def message(self, message: dict[str, Any]) -> None:
        with self._news:
            self.messages.append(message)
            self._news.notify_all()

    def wait(self, true: Callable[[], Any]) -> Any:
        """Return what a function returns, once that is true."""
        with self._news:
            end = time.monotonic() + WAIT
            while not (found := true()):
                assert self._news.wait(end - time.monotonic()), "nothing came"
            return found

    def rest(self) -> tuple[dict[str, Any], np.ndarray]:
        """Return the next final picture (h, w, 3) uint8 from now on."""
        seen = len(self.frames)
        header, data = self.wait(
            lambda: next((one for one in self.frames[seen:] if one[0]["rest"]), None)
        )
        return header, np.asarray(Image.open(io.BytesIO(data)))

    def answer(self, kind: str, **wanted: Any) -> dict[str, Any]:
        """Return the first message of a type with these values, and forget those before it."""

        def found() -> Any:
            for at, one in enumerate(self.messages):
                if one["type"] == kind and wanted.items() <= one.items():
                    del self.messages[: at + 1]
                    return one
            return None

        return self.wait(found)


def small(mode: str = "rgb", spp: int = 4) -> Scene:
    scene = load(CORNELL)
    film = dataclasses.replace(scene.film, width=32, height=24, mode=mode)
    return dataclasses.replace(scene, film=film, spp=spp)


@pytest.fixture(scope="module")
def on() -> device.Device:
    return device.choose()


@pytest.fixture
def audience() -> Audience:
    return Audience()


Open = Callable[..., Session]


@pytest.fixture
def opened(on: device.Device, audience: Audience) -> Iterator[Open]:
    """Open a session of a scene, which one viewer watches."""
    made: list[Session] = []

    def open_session(scene: Scene, **options: Any) -> Session:
        session = Session(scene, on, audience, **options)
        session.watched(1)
        session.start()
        made.append(session)
        return session

    yield open_session
    for session in made:
        session.close()


def ask(session: Session, audience: Audience, name: str, /, **values: Any) -> None:
    """Ask as a page does; what is left out is null."""
    request = parse(json.dumps({"do": name, **values}))
    session.post(request, audience.message)


def expected(scene: Scene, on: device.Device, **how: Any) -> np.ndarray:
    """Return the picture of a new renderer, (h, w, 3) uint8."""
    with Renderer(scene, on) as renderer:
        renderer.run(scene.spp)
        return renderer.resolve(**how).get()[..., :3]


def test_the_picture_at_rest_is_resolve_to_the_byte(opened, audience, on) -> None:
    """At first, in another display, after a drag, and of a region."""
    session = opened(small())
    header, pixels = audience.rest()
    assert header["samples"] == 4 and header["size"] == [32, 24]
    assert np.array_equal(pixels, expected(small(), on))
    ask(session, audience, "display", exposure=1.5, tone="aces")
    assert np.array_equal(audience.rest()[1], expected(small(), on, exposure=1.5, tone="aces"))
    ask(session, audience, "orbit", dx=0.1, dy=0.0)
    _, turned = audience.rest()
    how = {"exposure": 1.5, "tone": "aces"}
    assert not np.array_equal(turned, pixels)
    assert np.array_equal(turned, expected(session.scene, on, **how))
    ask(session, audience, "region", x=4, y=6, width=10, height=8)
    header, part = audience.rest()
    assert header["crop"] == (4, 6, 10, 8) and np.array_equal(part, turned[6:14, 4:14])


def test_coarse_pictures_come_first(opened, audience, monkeypatch) -> None:
    monkeypatch.setattr("clpt.view.render_loop.PREVIEW_PIXELS", 200)
    session = opened(small())
    audience.rest()
    first, _ = audience.frames[0]
    assert first["divider"] == 2 and first["size"] == [16, 12] and first["film"] == [32, 24]
    seen = len(audience.frames)
    ask(session, audience, "dolly", by=0.1)
    audience.rest()
    assert [one["divider"] for one, _ in audience.frames[seen:]][:2] == [2, 2]
    assert audience.frames[-1][0]["divider"] == 1


def test_values_are_those_of_image(opened, audience, on) -> None:
    session = opened(small("spectral", 16))
    audience.rest()
    with Renderer(small("spectral", 16), on) as renderer:
        renderer.run(16)
        image = renderer.image()
    ask(session, audience, "inspect", x=20, y=15)
    value = audience.answer("value")
    assert value["rgb"] == image[15, 20].tolist() and value["samples"] == 16
    hit = audience.answer("hit")
    shape = session.scene.shapes[hit["shape"]]
    assert hit["object"]["name"] == shape.name and hit["depth"] > 0
    told = audience.answer("spectrum", last=True)
    assert len(told["lambdas"]) == len(told["mean"]) == len(told["error"]) == probe.BANDS
    ask(session, audience, "inspect", x=32, y=0)
    assert "32x24" in audience.answer("error")["text"]


@pytest.mark.parametrize(
    ("given", "remark"),
    [
        (integrators.Auto(max_depth=3, hide_lights=True), "by paths from the camera alone"),
        (
            integrators.Path(max_depth=3, hide_lights=True, light_paths=1),
            "by paths from the camera alone",
        ),
        (integrators.Path(max_depth=3, hide_lights=True, light_paths=0), ""),
        (integrators.Vcm(max_depth=3), "by paths from the camera alone"),
        (integrators.ParticleTracer(max_depth=3), "by paths from the camera alone"),
    ],
)
def test_a_pixel_is_rendered_by_paths_as_long_as_the_picture_s(
    given: integrators.Integrator, remark: str
) -> None:
    integrator, said = probe.plain(given)
    assert isinstance(integrator, integrators.Path) and said == remark
    assert (integrator.max_depth, integrator.light_paths) == (3, 0)
    assert integrator.hide_lights == fields_of(given).get("hide_lights", False)


@pytest.mark.slow
def test_error_bars_hold_what_they_say(on) -> None:
    """Of 47 bands, at 16 pixels: |mean - truth| / error is at most 6, and below 2 for 90 %.

    With 64 batches it has a t distribution of 63 degrees: P(> 6) is 1e-7 each, 1e-4 for all; of
    700 bands 95.0 % are below 2, and 90 % would be 6 standard deviations away (bands of a batch
    are almost independent).
    """
    scene = small("spectral")
    film = dataclasses.replace(scene.film, bands=probe.BANDS)
    integrator, _ = probe.plain(scene.integrator)
    whole = dataclasses.replace(scene, film=film, integrator=integrator)
    with Renderer(whole, on) as renderer:
        renderer.run(65536)
        truth = renderer.image()
    asked = probe.Probe(on)
    answers: list[dict[str, Any]] = []
    for x, y in [(3 + 7 * i, 2 + 6 * j) for i in range(4) for j in range(4)]:
        done = threading.Event()

        def reply(message: dict[str, Any], done: threading.Event = done) -> None:
            if message.get("last"):
                answers.append(message)
                done.set()

        asked.ask(probe.Question(scene, x, y, reply))
        assert done.wait(WAIT)
    asked.close()
    z = np.concatenate(
        [
            (np.array(one["mean"]) - truth[one["y"], one["x"]]) / np.maximum(one["error"], 1e-12)
            for one in answers
            if max(one["mean"]) > 0
        ]
    )
    assert len(z) > 400 and np.abs(z).max() < 6.0 and (np.abs(z) < 2.0).mean() > 0.9


CAMERAS = [
    cameras.Perspective(fov=50.0, fov_axis="smaller", offset_x=0.1, offset_y=-0.2),
    cameras.ThinLens(fov=40.0, fov_axis="y", aperture_radius=0.0, focus_distance=3.0),
    cameras.Orthographic(),
    cameras.Spherical(),
    cameras.Matrix(
        projection=[[1.2, 0, 0.1, 0], [0, 1.6, -0.2, 0], [0, 0, -1.1, -1], [0, 0, -1, 0]]
    ),
]  # fmt: skip


QUICK = ("perspective",)


@pytest.mark.parametrize(
    "camera",
    [
        pytest.param(camera, marks=() if camera.kind in QUICK else pytest.mark.slow, id=camera.kind)
        for camera in CAMERAS
    ],
)
def test_a_pixel_alone_is_that_pixel(camera, on) -> None:
    """The position that the window of one pixel sees is the one in the whole film."""
    if not isinstance(camera, cameras.Matrix):
        camera = dataclasses.replace(camera, to_world=np.diag([-1.0, 1.0, -1.0, 1.0]))
    wall = shapes.Cube(to_world=np.diag([20.0, 20.0, 4.0, 1.0]), flip_normals=True)
    scene = small()
    film = dataclasses.replace(scene.film, width=12, height=9)
    scene = dataclasses.replace(scene, camera=camera, shapes=[wall], film=film)
    follower = probe.Follower(on)
    film = dataclasses.replace(scene.film, layers=("position",))
    whole = dataclasses.replace(scene, film=film)
    with Renderer(whole, on) as renderer:
        renderer.run(64)
        positions = renderer.layers()["position"]
    for x, y in ((0, 0), (11, 8), (5, 3), (9, 1)):
        found = probe.first_hit(follower, scene, x, y)["position"]
        pixel = np.ptp(positions[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2], axis=(0, 1))
        away = np.abs(np.array(found) - positions[y, x])
        assert (away <= 0.6 * pixel.max() + 1e-3).all()
    follower.close()


def test_a_material_is_edited(opened, audience, on) -> None:
    session = opened(small())
    _, before = audience.rest()
    described = session.state()["panels"]
    red = next(one for one in described if one["title"] == "red")
    which = {"target": "material", "index": red["index"], "key": "reflectance"}
    ask(session, audience, "edit", **which, value=[0.1, 0.2, 0.8])
    _, after = audience.rest()
    assert not np.array_equal(before, after)
    assert np.array_equal(after, expected(session.scene, on))
    ask(session, audience, "restore")
    assert np.array_equal(audience.rest()[1], before)


def test_changes_are_undone_and_redone(opened, audience) -> None:
    """What a slider sends is one step; the camera and the end of the render stay."""
    session = opened(small())
    _, first = audience.rest()
    red = next(one for one in session.state()["panels"] if one["title"] == "red")
    which = {"target": "material", "index": red["index"], "key": "reflectance"}
    for blue in (0.2, 0.4, 0.8):
        ask(session, audience, "edit", **which, value=[0.1, 0.2, blue])
    _, edited = audience.rest()
    ask(session, audience, "hide", shape=7, hidden=True)
    audience.rest()
    ask(session, audience, "orbit", dx=0.1, dy=0.0)
    audience.rest()
    ask(session, audience, "home")
    audience.rest()
    ask(session, audience, "undo")
    assert np.array_equal(audience.rest()[1], edited)
    ask(session, audience, "undo")
    assert np.array_equal(audience.rest()[1], first)
    assert session.state()["edited"] is False
    ask(session, audience, "undo")
    assert audience.answer("error")["text"] == "there is nothing to undo"
    ask(session, audience, "redo")
    assert np.array_equal(audience.rest()[1], edited)
    ask(session, audience, "edit", **which, value=[0.5, 0.5, 0.5])
    audience.rest()
    ask(session, audience, "redo")
    assert audience.answer("error")["text"] == "there is nothing to redo"


FAIL = (  # whatever restarts the picture, but cannot be done
    ("undo", {}),
    ("redo", {}),
    ("hide", {"shape": 999, "hidden": True}),
    ("wavelength", {"nm": 500.0, "width": 10.0}),
    ("region", {"x": 0, "y": 0, "width": 500, "height": 500}),
    ("open_view", {"camera": {"type": "nothing"}, "exposure": 0.0, "tone": "none"}),
    ("edit", {"target": "material", "index": 999, "key": "reflectance", "value": 0.5}),
    ("edit", {"target": "material", "index": 0, "key": "reflectance", "value": [2, -1, 0]}),
    ("edit", {"target": "material", "index": 0, "key": "type", "value": "nothing"}),
)
IN_VAIN = (  # what changes nothing
    ("show_all", {}),
    ("lamp", {"name": None}),
    ("size", {"width": 32, "height": 24}),
    ("region", {}),
)


def test_the_picture_stays_where_a_command_changes_nothing(opened, audience) -> None:
    session = opened(small(spp=10**6))
    restarting = {name for name, command in COMMANDS.items() if command.restarts}
    tried = {name for name, _ in (*FAIL, *IN_VAIN)}
    certain = {name for name, command in COMMANDS.items() if command.certain}
    assert restarting - tried - certain == {"field_of_view", "restore"}  # which succeed here
    audience.wait(lambda: session.status().get("samples", 0) >= 3)
    for name, values in (*FAIL, *IN_VAIN):
        changes, samples = session._loop._changes, session.status()["samples"]
        ask(session, audience, name, **values)
        if (name, values) in FAIL:
            audience.answer("error")
        audience.wait(lambda samples=samples: session.status()["samples"] > samples)
        assert session._loop._changes == changes and samples >= 3, name


@pytest.mark.parametrize("kind", panels._material_kinds())
def test_a_material_becomes_one_of_another_kind(kind: str) -> None:
    """With the name and the parameters that both kinds have; and it is a change like others."""
    scene = small()
    red = next(one for one in panels.panels(scene) if one["title"] == "red")
    assert kind in red["kinds"]
    changed, change = panels.edited(scene, "material", red["index"], "type", kind)
    new = next(one for one in panels.panels(changed) if one["index"] == red["index"]
               and one["target"] == "material")  # fmt: skip
    assert new["kind"] == kind and new["title"] == "red"
    assert change.whole or kind == red["kind"]
    values = {one["key"]: one["value"] for one in new["parameters"]}
    if "reflectance" in values:
        assert values["reflectance"] == red["parameters"][0]["value"]


def test_a_red_wall_becomes_gold(opened, audience, on) -> None:
    session = opened(dataclasses.replace(small(), integrator=integrators.Path(light_paths=0)))
    _, first = audience.rest()
    red = next(one for one in session.state()["panels"] if one["title"] == "red")
    which = {"target": "material", "index": red["index"]}
    ask(session, audience, "edit", **which, key="type", value="rough_conductor")
    _, gold = audience.rest()
    assert not np.array_equal(gold, first)
    assert np.array_equal(gold, expected(session.scene, on))
    ask(session, audience, "edit", **which, key="metal", value="gold")
    audience.rest()
    metal = session.state()["panels"]
    wall = next(one for one in metal if one["title"] == "red")
    eta = next(one for one in wall["parameters"] if one["key"] == "eta")
    assert eta["curve"][0] > 1.2 > 0.4 > eta["curve"][15]  # gold: 1.6 in blue, 0.2 in red
    for name in ("nothing", 7):
        ask(session, audience, "edit", **which, key="metal", value=name)
        audience.answer("error")
    ask(session, audience, "undo")
    audience.rest()
    ask(session, audience, "undo")
    assert np.array_equal(audience.rest()[1], first)


def test_the_film_gets_another_size(opened, audience, on) -> None:
    session = opened(small())
    audience.rest()
    ask(session, audience, "region", x=2, y=2, width=8, height=8)
    audience.rest()
    ask(session, audience, "size", width=40, height=20)
    header, shown = audience.rest()
    assert header["film"] == [40, 20] and header["crop"] is None
    assert np.array_equal(shown, expected(session.scene, on))
    assert session.state()["look"]["region"] is None


def test_where_the_camera_is_is_told_as_people_write_it(opened, audience) -> None:
    session = opened(small())
    ask(session, audience, "look_at")
    told = audience.answer("look_at")
    made = transforms.look_at(told["origin"], told["target"], told["up"])
    np.testing.assert_allclose(made, small().camera.to_world, atol=1e-5)


def test_without_a_denoiser_none_is_offered(opened, audience, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "pyoidn", None)
    offered = opened(small()).state()["names"]["maps"]
    assert "denoised" not in offered and {"picture", "samples", "error"} <= set(offered)


def test_objects_are_hidden_and_come_back(opened, audience) -> None:
    session = opened(small())
    _, before = audience.rest()
    ask(session, audience, "hide", shape=7, hidden=True)
    assert not np.array_equal(audience.rest()[1], before)
    assert session.state()["look"]["hidden"] == [7]
    ask(session, audience, "show_all")
    assert np.array_equal(audience.rest()[1], before)


def test_a_scene_that_cannot_be_rendered_is_given_up(opened, audience) -> None:
    """All shapes are hidden, and no light is left: whatever happens, the next request works."""
    session = opened(small())
    audience.rest()
    for i in range(len(session.scene.shapes)):
        ask(session, audience, "hide", shape=i, hidden=True)
    audience.rest()
    ask(session, audience, "show_all")
    audience.rest()
    assert session.error is None


def test_without_viewers_it_waits(opened, audience) -> None:
    session = opened(small(spp=1 << 20))
    audience.wait(lambda: any(one["divider"] == 1 for one, _ in audience.frames))
    session.watched(0)
    time.sleep(0.5)
    seen = len(audience.frames)
    cpu = time.process_time()
    time.sleep(1.0)
    assert time.process_time() - cpu < 0.5 and len(audience.frames) <= seen + 1
    session.watched(1)
    audience.wait(lambda: len(audience.frames) > seen + 1)


def test_pause_and_where_it_stops(opened, audience) -> None:
    session = opened(small(spp=1 << 20))
    ask(session, audience, "pause", paused=True)
    header, _ = audience.rest()
    assert 0 < header["samples"] < 1 << 20
    ask(session, audience, "stop_at", spp=header["samples"] + 3, noise=None)
    ask(session, audience, "pause", paused=False)
    assert audience.rest()[0]["samples"] == header["samples"] + 3
    ask(session, audience, "stop_at", spp=4096, noise=0.5)
    assert audience.answer("status", phase="done")["active"] <= 1.0


def test_the_file_is_watched(opened, audience) -> None:
    """The viewer's camera stays, unless the file's is another."""
    current, stamp = [small()], [1]
    source = SimpleNamespace(stamp=lambda: stamp[0], load=lambda: current[0])
    session = opened(small(), source=source)
    audience.rest()
    ask(session, audience, "orbit", dx=0.1, dy=0.0)
    audience.rest()
    turned = session.scene.camera
    current[0], stamp[0] = dataclasses.replace(small(), seed=5), 2
    audience.rest()
    assert session.scene.seed == 5 and session.scene.camera is turned
    moved = dataclasses.replace(small().camera, fov=60.0)
    current[0], stamp[0] = dataclasses.replace(small(), camera=moved), 3
    audience.rest()
    assert session.scene.camera.fov == 60.0


def test_files_are_saved_in_the_folder(opened, audience, tmp_path, on) -> None:
    def write_exr(path: Path, renderer: Renderer, seconds: float) -> None:
        outputs.write(path, renderer, outputs.metadata(renderer, path, seconds), Grading())

    session = opened(small(), folder=Folder(tmp_path, "../a b/c", write_exr))
    _, pixels = audience.rest()
    names = []
    for what in ("png", "exr", "scene", "view", "png"):
        ask(session, audience, "save", what=what)
        names.append(audience.answer("saved")["name"])
    ends = ["-001.png", "-001.exr", "-001/scene.json", "-001.view.json", "-002.png"]
    assert names == [f"a_b_c{end}" for end in ends]
    assert np.array_equal(np.asarray(Image.open(tmp_path / names[0])), pixels)
    assert images.read(tmp_path / names[1]).shape == (24, 32, 3)
    again = load(tmp_path / names[2])
    again = dataclasses.replace(again, spp=4)
    assert np.array_equal(expected(again, on), pixels)
    assert json.loads((tmp_path / names[3]).read_text())["camera"]["type"] == "perspective"
    assert {path.parent for path in tmp_path.parent.rglob("a_b_c*")} == {tmp_path}


def test_a_view_of_opencolorio_has_to_be_given_at_the_start(opened, audience) -> None:
    session = opened(small())
    ask(session, audience, "display", exposure=0.0, tone="view")
    assert "no view" in audience.answer("error")["text"]
    assert "view" not in session.state()["names"]["tones"]


def test_the_picture_can_be_denoised(opened, audience, on) -> None:
    """It is that of `Renderer.denoised` on the display; the picture itself stays noisy."""
    pytest.importorskip("pyoidn", reason="Open Image Denoise is not installed")
    session = opened(small())
    audience.rest()
    ask(session, audience, "shows", name="denoised")
    header, shown = audience.rest()
    assert header["shows"] == "denoised" and session.scene.film.layers == ()
    with Renderer(small(), on, denoise="oidn") as renderer:
        renderer.run(4)
        expected = images.to_srgb8(renderer.denoised())
        noisy = renderer.resolve().get()[..., :3]
    assert np.array_equal(shown, expected) and not np.array_equal(shown, noisy)
    ask(session, audience, "shows", name="picture")
    assert np.array_equal(audience.rest()[1], noisy)


def test_a_limit_of_noise_is_for_what_denoising_leaves(opened, audience, on) -> None:
    """Once the picture is denoised: then each pixel has the samples of `clpt render --denoise`."""
    pytest.importorskip("pyoidn", reason="Open Image Denoise is not installed")
    scene = dataclasses.replace(small(spp=64), noise=0.12)
    session = opened(scene)
    audience.rest()
    before = session._loop.renderer().samples_per_pixel()
    ask(session, audience, "shows", name="denoised")
    header, _ = audience.rest()
    assert header["shows"] == "denoised"
    found = session._loop.renderer().samples_per_pixel()
    with Renderer(scene, on, denoise="oidn") as renderer:
        renderer.run(64, noise=0.12)
        expected = renderer.samples_per_pixel()
    assert np.array_equal(found, expected)
    assert not np.array_equal(found, before)
    ask(session, audience, "stop_at", spp=8, noise=None)
    audience.rest()
    assert (session._loop.renderer().samples_per_pixel() == 8.0).all()


def test_layers_and_maps_take_the_place_of_the_picture(opened, audience, on) -> None:
    """A layer that the film has not begins the render again; a map does not."""
    session = opened(small())
    _, pixels = audience.rest()
    ask(session, audience, "shows", name="albedo")
    header, shown = audience.rest()
    assert header["shows"] == "albedo" and session.scene.film.layers == ()
    film = dataclasses.replace(small().film, layers=("albedo",))
    with Renderer(dataclasses.replace(small(), film=film), on) as renderer:
        renderer.run(4)
        assert np.array_equal(shown, images.to_srgb8(renderer.layers()["albedo"]))
    changes = header["changes"]
    ask(session, audience, "shows", name="samples")
    header, shown = audience.rest()
    assert (
        header["legend"]["high"] == "4 samples"
        and len(np.unique(shown.reshape(-1, 3), axis=0)) == 1
    )
    ask(session, audience, "shows", name="error")
    header, shown = audience.rest()
    assert header["legend"]["high"] == "100 % error" and not np.array_equal(shown, pixels)
    ask(session, audience, "shows", name="picture")
    header, shown = audience.rest()
    assert header["changes"] == changes and header["legend"] is None
    assert np.array_equal(shown, pixels)
    ask(session, audience, "shows", name="thoughts")
    assert "no thoughts" in audience.answer("error")["text"]


def test_a_view_is_copied_saved_and_opened(opened, audience, tmp_path) -> None:
    session = opened(small(), folder=Folder(tmp_path, "a", lambda *_: None))
    audience.rest()
    ask(session, audience, "orbit", dx=0.2, dy=0.1)
    ask(session, audience, "display", exposure=1.0, tone="aces")
    _, turned = audience.rest()
    camera = session.scene.camera
    ask(session, audience, "copy_view")
    copied = audience.answer("view")["view"]
    ask(session, audience, "save", what="view")
    saved = tmp_path / audience.answer("saved")["name"]
    assert json.loads(saved.read_text()) == copied
    ask(session, audience, "home")
    ask(session, audience, "display", exposure=0.0, tone="none")
    assert not np.array_equal(audience.rest()[1], turned)
    session.post(saving.load(saved), audience.message)
    _, again = audience.rest()
    assert np.allclose(session.scene.camera.to_world, camera.to_world)
    assert np.array_equal(again, turned) and session.state()["display"]["tone"] == "aces"


@pytest.mark.parametrize(
    ("document", "told"),
    [
        ([], "no view"),
        ({"display": {}}, "no camera"),
        ({"camera": {"type": "perspectiv"}}, "did you mean 'perspective'"),
        ({"camera": {"type": "perspective", "fow": 3}}, "no 'fow'"),
        ({"camera": {"type": "perspective", "fov": -3}}, "fov"),
        ({"camera": {"type": "perspective", "to_world": {"file": "x"}}}, "unknown transform"),
        ({"camera": {"type": "perspective", "medium": "x"}}, "has no 'medium'"),
        ({"camera": {"type": "lens", "lens": "/etc/passwd"}}, "has no 'lens'"),
        ({"camera": {"type": "thin_lens", "glass": {"file": "x.yml"}}}, "names a file"),
        ({"camera": {"type": []}}, "unknown camera"),
        ({"camera": {"type": "perspective"}, "display": {"exposure": 99}}, "-20 to 20"),
    ],
)
def test_what_is_no_view_is_told(tmp_path, document, told) -> None:
    path = tmp_path / "a.view.json"
    path.write_text(json.dumps(document))
    with pytest.raises(SceneError, match=told):
        saving.load(path)


def test_what_changes_no_sample_does_not_wait_for_them(opened, audience, monkeypatch) -> None:
    """A pass that would never end: display, values and figures come all the same, and a drag."""
    monkeypatch.setattr("clpt.view.render_loop.PASS_SECONDS", 1e9)
    monkeypatch.setattr("clpt.view.pictures.SHARE", 0.0)
    session = opened(small(spp=1 << 30))
    audience.wait(lambda: audience.frames and audience.frames[-1][0]["divider"] == 1)
    time.sleep(2.0)  # passes double each time
    ask(session, audience, "value", x=20, y=15)
    assert audience.answer("value")["samples"] > 0
    seen = len(audience.frames)
    ask(session, audience, "display", exposure=2.0, tone="none")
    header, data = audience.wait(lambda: audience.frames[seen:] and audience.frames[seen])
    assert header["divider"] == 1 and np.asarray(Image.open(io.BytesIO(data))).mean() > 1.0
    ask(session, audience, "statistics")
    audience.answer("statistics")
    seen = len(audience.frames)
    ask(session, audience, "orbit", dx=0.1, dy=0.0)
    audience.wait(lambda: audience.frames[seen:])


def test_several_devices_make_the_same_picture(audience, on) -> None:
    """Two queues of one device stand for two; the picture is that of one, also after a drag."""
    pair = [device.Device.open(on.info, context=on.context) for _ in range(2)]
    session = Session(small(), on, audience, make=partial(MultiRenderer, devices=pair))
    session.watched(1)
    session.start()
    try:
        assert np.array_equal(audience.rest()[1], expected(small(), on))
        ask(session, audience, "orbit", dx=0.1, dy=0.0)
        _, turned = audience.rest()
        assert np.array_equal(turned, expected(session.scene, on))
        ask(session, audience, "shows", name="albedo")
        audience.rest()
        ask(session, audience, "statistics")
        assert audience.answer("statistics")["stats"]["integrator"] == "path"
        assert len(session._loop.renderer().devices) == 2 and session.error is None
    finally:
        session.close()


@pytest.mark.slow
def test_the_merged_picture_of_a_cluster(audience, on) -> None:
    pytest.importorskip("distributed", reason="the extra clpt[cluster] is not installed")
    from clpt.cluster import processes
    from clpt.cluster.cluster_renderer import ClusterRenderer

    with processes.local_cluster(1) as (client, _):

        def make(scene, cancel_seconds, **made):
            return ClusterRenderer(scene, client, device=on, mixed=True, **made)

        session = Session(small(), on, audience, make=make)
        session.watched(1)
        session.start()
        try:
            assert np.array_equal(audience.rest()[1], expected(small(), on))
            ask(session, audience, "orbit", dx=0.1, dy=0.0)
            _, turned = audience.rest()
            assert np.array_equal(turned, expected(session.scene, on))
            assert session.error is None
        finally:
            session.close()


def test_without_a_folder_nothing_is_saved(opened, audience) -> None:
    session = opened(small())
    ask(session, audience, "save", what="exr")
    assert "no folder" in audience.answer("error")["text"]


def test_random_requests_end_nothing(opened, audience) -> None:
    """300 commands with random values of their types; then the session still renders."""
    session = opened(small(spp=2))
    audience.rest()
    chance = random.Random(3)
    names = [name for name in COMMANDS if name not in ("shown", "steer", "invite", "save")]
    for _ in range(300):
        name = chance.choice(names)
        values = {key: _random(kind, chance) for key, kind in COMMANDS[name].parameters.items()}
        session.post(Request(name, values), audience.message)
    ask(session, audience, "stop_at", spp=2, noise=None)
    ask(session, audience, "pause", paused=False)
    ask(session, audience, "restore")
    ask(session, audience, "display", exposure=0.0, tone="none")
    audience.answer("state", edited=False, paused=False)
    audience.rest()
    assert session.error is None


def _random(kind: Any, chance: random.Random) -> Any:
    name = type(kind).__name__
    if name == "Number":
        return (
            chance.uniform(max(kind.low, -2.0), min(kind.high, 2.0)) if kind.low < 2 else kind.low
        )
    if name == "Whole":
        return chance.randint(kind.low, min(kind.high, 31))
    if name == "Choice":
        return chance.choice(kind.names)
    if name == "Flag":
        return chance.random() < 0.5
    if name == "Optional":
        return None if chance.random() < 0.5 else _random(kind.type, chance)
    if name == "Name":
        return chance.choice(["fov", "reflectance", "radiance", "max_depth", "sensor", "to_world"])
    return chance.choice([0.5, -1, 1e9, "D65", [0.1, 0.2, 0.3], {"values": [[400, 0.5]]}, None, []])


# plain data


def test_every_parameter_has_a_panel_and_goes_round() -> None:
    """What a panel shows of a value, given back, is the same value."""
    scene = small("spectral")
    for panel in panels.panels(scene):
        for one in panel["parameters"]:
            if one["value"] is None or one["texture"]:
                continue
            new, _ = panels.edited(scene, panel["target"], panel["index"], one["key"], one["value"])
            again = panels.panels(new)
            found = next(
                p for p in again if (p["target"], p["index"]) == (panel["target"], panel["index"])
            )
            value = next(p["value"] for p in found["parameters"] if p["key"] == one["key"])
            assert value == one["value"], one["key"]


@pytest.mark.parametrize(
    ("target", "index", "key", "value"),
    [
        ("material", 0, "reflectance", {"file": "/etc/passwd"}),
        ("material", 0, "reflectance", {"type": "bitmap", "image": "/etc/passwd"}),
        ("material", 0, "reflectance", 7.0),
        ("material", 0, "name", "x"),
        ("material", 999, "reflectance", 0.5),
        ("camera", 0, "to_world", [[1, 0, 0, 0]] * 4),
        ("film", 0, "width", 60000),
        ("film", 0, "bands", 1024),
        ("film", 0, "sensor", {"file": "/etc/passwd"}),
        ("film", 0, "sensor", "/etc/passwd"),
        ("film", 0, "white_balance", "/etc/passwd"),
        ("integrator", 0, "__class__", 1),
        ("camera", 0, "fov", "wide"),
        ("camera", 0, "fov", 1e6),
    ],
)
def test_what_a_page_may_not_edit(target: str, index: int, key: str, value: Any) -> None:
    with pytest.raises(Exception) as refused:
        panels.edited(small(), target, index, key, value)
    assert refused.type.__name__ in ("CommandError", "SceneError", "UnknownKindError")


def test_a_lamp_keeps_the_luminance_of_lights() -> None:
    red = lights.Point(intensity=spectra.RGBIlluminant(2.0, 0.5, 0.1))
    scene = dataclasses.replace(small(), lights=[red, lights.Constant(radiance=3.0)])
    exchanged = Look(lamp="A").apply(scene).lights
    expected_y = float(spectra.luminance([2.0, 0.5, 0.1]))
    assert exchanged[0].intensity.name == "A"
    assert exchanged[0].intensity.scale == pytest.approx(expected_y, rel=0.02)
    assert exchanged[1].radiance.scale == pytest.approx(3.0, rel=1e-3)


def test_changes_add_up() -> None:
    a, b, c, d = (shapes.Diffuse(reflectance=0.1 * i) for i in range(4))
    both = Change(materials={a: b}).then(Change(materials={b: c, d: a}))
    assert both.materials == {a: c, d: a}
    assert Change(whole=True).then(Change(camera=CAMERAS[0])).whole


def test_moves_of_one_kind_are_added() -> None:
    moves = [Request("orbit", {"dx": 1.0, "dy": 2.0})] * 3 + [Request("dolly", {"by": 1.0})] * 2
    found = [request for request, _ in merged([(one, print) for one in moves])]
    assert found == [Request("orbit", {"dx": 3.0, "dy": 6.0}), Request("dolly", {"by": 2.0})]


def test_the_table_of_commands_is_whole() -> None:
    assert all(
        valid(kind) is not ... for one in COMMANDS.values() for kind in one.parameters.values()
    )
    with pytest.raises(CommandError):
        parse(message("orbit", dx=1e9))
