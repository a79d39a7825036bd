"""The session behind a page: a thread that serves requests of viewers, and renders meanwhile."""

from __future__ import annotations

import dataclasses
import logging
import threading
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Protocol

from clpt.denoise import oidn
from clpt.device import Device
from clpt.errors import SceneError
from clpt.scene import Scene
from clpt.view import panels, pictures, saving
from clpt.view.camera_work import CameraWork
from clpt.view.look import History, Look, State
from clpt.view.messages import COMMANDS, CommandError, Reply, Request, answering, error_message
from clpt.view.pictures import METHOD, Display
from clpt.view.probe import Probe, Question
from clpt.view.render_loop import Outlet, RenderLoop
from clpt.view.saving import Folder
from clpt.view.target import Change

log = logging.getLogger(__name__)

MOST_WAITING = 256  # requests; beyond, the oldest are dropped
EDITABLE = ("shapes", "lights", "film", "integrator")  # parts of a scene, but the camera
MOVES = ("orbit", "look", "pan", "dolly", "fly")
WATCH_SECONDS = 1.0  # between looks at the scene's file


class Source(Protocol):
    """Where the scene comes from, to be read again."""

    def stamp(self) -> Any:
        """Return what differs when the scene has changed."""

    def load(self) -> Scene:
        """Return the present scene."""


class Session(CameraWork):
    """A scene that is rendered while it is watched and steered.

    scene, display: at the start; device: where; outlet: gets pictures and messages; folder: gets
    what is saved, and source tells when the file has changed, where they are given; where: what
    renders, for people. options: of `RenderLoop` and renderers.

    `post`, `watched`, `status` and `state` may be called from any thread.
    """

    def __init__(
        self,
        scene: Scene,
        device: Device,
        outlet: Outlet,
        *,
        folder: Folder | None = None,
        source: Source | None = None,
        display: Display | None = None,
        where: str | None = None,
        **options: Any,
    ):
        self.device, self.outlet, self.folder, self.source = device, outlet, folder, source
        self.where = where or device.info.label
        self.scene = self._first = scene
        self.look = Look()
        self._works = self.scene, self.look  # the last scene and look that could be rendered
        self._history = History()
        self._has_worked = False
        self._rests = False  # nothing can be rendered until something is asked for
        self.error: BaseException | None = None
        self._loop = RenderLoop(scene, device, outlet, display or Display(), **options)
        self._loop.meanwhile = self._handle_quick_ones
        self._probe: Probe | None = None
        self._requests: deque[tuple[Request, Reply]] = deque()
        self._wake = threading.Condition()
        self._closing = False
        self._viewers = -1  # nobody has come yet: the picture begins before
        self._set_pivot()
        self._stamp = source.stamp() if source is not None else None
        self._looked = time.monotonic()
        self._revision = 0
        self._thread = threading.Thread(target=self._main, name="clpt view", daemon=True)

    def start(self, *, solid: bool = False) -> None:
        """Begin to render.

        solid: show the scene in plain colours while its kernels are compiled, if they have to be.
        """
        if solid:
            self._loop.begin_solid()
        self._thread.start()

    def close(self, timeout: float | None = None) -> bool:
        """Stop, and give the device's memory back; return whether that was done.

        timeout: [s] to wait at most: a driver that compiles cannot be stopped.
        """
        with self._wake:
            self._closing = True
            self._wake.notify_all()
        self._loop.stop()
        if self._thread.ident is not None:
            self._thread.join(timeout)
        return not self._thread.is_alive()

    def post(self, request: Request, reply: Reply) -> None:
        """Ask for something; reply: gets messages for the viewer alone."""
        with self._wake:
            left_out = self._requests.popleft() if len(self._requests) >= MOST_WAITING else None
            last = [self._requests.pop()] if self._requests else []
            self._requests.extend(merged([*last, (request, reply)]))
            self._wake.notify_all()
        if left_out is not None:
            left_out[1](error_message(CommandError(f"{left_out[0].name} was left out: too many")))
        command = COMMANDS.get(request.name)  # None for requests of the probe
        if command is not None and command.restarts:
            self._loop.cancel(discard=command.certain)

    def watched(self, viewers: int) -> None:
        """Note how many viewers there are; when the last has left the render waits."""
        with self._wake:
            if viewers or self._viewers > 0:
                self._viewers = viewers
            self._wake.notify_all()
        if not self._viewers:
            self._loop.cancel()

    def status(self) -> dict[str, Any]:
        """Return how far the render is, as all viewers were told last."""
        return self._loop.status

    def state(self) -> dict[str, Any]:
        """Return the state of scene and look for a viewer."""
        scene, film = self.scene, self.scene.film
        return {
            "type": "state",
            "revision": self._revision,
            "name": panels.for_people(scene.name),
            "film": [film.width, film.height],
            "mode": film.mode,
            "lambdas": [film.lambda_min, film.lambda_max],
            "spp": scene.spp,
            "noise": scene.noise,
            "paused": self._loop.paused,
            "display": self._display(),
            "look": {**dataclasses.asdict(self.look), "hidden": sorted(self.look.hidden)},
            "device": self.where,
            "names": {
                **panels.names(self._loop.display.view is not None),
                "maps": pictures.offered(),
            },
            "objects": panels.objects(scene),
            "panels": panels.panels(scene),
            "saves": self.folder is not None,
            "compares": self._loop.kept is not None,
            "edited": differ(scene, self._first),
        }

    # the thread

    def _main(self) -> None:
        try:
            while not self._closing:
                self._handle_requests()
                self._watch()
                self._loop.watched = self._viewers != 0
                if not self._closing and not self._try_to_advance():
                    with self._wake:
                        if not self._requests and not self._closing:
                            self._wake.wait(0.25)
        except BaseException as error:
            log.debug("the session ended", exc_info=True)
            self.error = error
            self.outlet.message(error_message(error, "the render ended: "))
        finally:
            if self._probe is not None:
                self._probe.close()
            self._loop.close()

    def _try_to_advance(self) -> bool:
        """Go on; the last scene that could be rendered replaces a scene that cannot.

        Raises errors of the loop where the first scene cannot be rendered. If a former scene cannot
        be rendered any more, as with a device that is gone, the render rests.
        """
        if self._rests:
            return False
        try:
            advanced = self._loop.advance()
        except Exception as error:
            scene, look = self._works
            again = self.scene is scene and self.look == look
            if again and not self._has_worked:
                raise
            log.debug("the scene cannot be rendered", exc_info=True)
            self.outlet.message(error_message(error))
            self._show(scene, Change(whole=True), look)
            self._rests = again
            self._tell_state()
            return True
        if self._loop.has_shown:
            self._works, self._has_worked = (self.scene, self.look), True
            if not self._aimed:
                self._aim()
        return advanced

    def _handle_requests(self) -> None:
        with self._wake:
            requests = list(self._requests)
            self._requests.clear()
        self._handle(requests)

    def _handle_quick_ones(self) -> None:
        """While samples are taken: do what need not wait for them."""
        if not self._requests:
            return
        with self._wake:
            requests = [waiting for waiting in self._requests if is_quick(waiting[0])]
            kept = [waiting for waiting in self._requests if not is_quick(waiting[0])]
            self._requests = deque(kept)
        self._handle(requests)

    def _handle(self, requests: list[tuple[Request, Reply]]) -> None:
        for request, reply in requests:
            self._rests = False
            with answering(reply), self._all_or_nothing(), self._noted(request):
                function = getattr(self, f"_do_{request.name}", None)
                if function is None:  # what the server does
                    raise CommandError(f"there is nothing to {request.name} here")
                function(reply, **request.values)

    @contextmanager
    def _all_or_nothing(self) -> Iterator[None]:
        """Undo what a request has changed of scene, look and pivot if it fails halfway."""
        scene, look = self.scene, self.look
        pivot = self._pivot, self._up, self._aimed
        try:
            yield
        except Exception:
            self._pivot, self._up, self._aimed = pivot
            self._loop.forget_request()
            if self.scene is not scene or self.look != look:
                self._show(scene, Change(whole=True), look)
            raise

    @contextmanager
    def _noted(self, request: Request) -> Iterator[None]:
        """Note the state before a request that changes more than the camera, so as to undo it."""
        scene, look = before = self.scene, self.look
        yield
        if request.name in ("undo", "redo"):
            return
        if differ(scene, self.scene) or look != self.look:
            values = request.values
            by = (values["target"], values["index"], values["key"]) if "key" in values else None
            self._history.note(State(*before), by)

    def _watch(self) -> None:
        """Read the scene again if its file has changed."""
        if self.source is None or time.monotonic() - self._looked < WATCH_SECONDS:
            return
        self._looked = time.monotonic()
        stamp = self.source.stamp()
        if stamp == self._stamp or stamp is None:
            return
        self._stamp = stamp
        with answering(self.outlet.message):
            self._read_again(self.source.load())

    def _read_again(self, scene: Scene) -> None:
        """Show the scene that its file has now."""
        same_camera = panels.written(scene.camera) == panels.written(self._first.camera)
        camera = self.scene.camera if same_camera else scene.camera  # the viewer's stays
        look = Look(lamp=self.look.lamp, wavelength=self.look.wavelength)
        self._show(dataclasses.replace(scene, camera=camera), Change(whole=True), look)
        self._first = scene
        self._history.clear()
        if not same_camera:
            self._set_pivot()
        self._tell_state()
        self.outlet.message({"type": "note", "text": "the scene's file was read again"})

    def _show(self, scene: Scene, change: Change, look: Look | None = None) -> None:
        """Render another scene with the present look, or another look."""
        look = self.look if look is None else look
        shown = look.apply(scene)
        self.scene, self.look = scene, look
        self._loop.shows, self._rests = look.shows, False
        self._begin(shown, change)

    def _begin(self, shown: Scene, change: Change) -> None:
        self._loop.begin(shown, change, METHOD if self.look.denoises else None)

    def _display(self) -> dict[str, Any]:
        display = self._loop.display
        return {"exposure": display.exposure, "tone": display.tone}

    def _tell_state(self) -> None:
        self._revision += 1
        self.outlet.message(self.state())

    # pixels

    def _do_value(self, reply: Reply, x: int, y: int) -> None:
        self._check_pixel(x, y)
        reply({"type": "value", "x": x, "y": y, **self._value(x, y)})

    def _do_inspect(self, reply: Reply, x: int, y: int) -> None:
        self._do_value(reply, x, y)
        self._ask(Question(self._loop.scene, x, y, self._named(reply)))

    def _value(self, x: int, y: int) -> dict[str, Any]:
        """Return what the last whole picture has in a pixel of the film."""
        film, crop = self._loop.film, self._loop.scene.film.crop
        x, y = (x, y) if crop is None else (x - crop[0], y - crop[1])
        if film is None or not (0 <= x < film.shape[1] and 0 <= y < film.shape[0]):
            return {"rgb": None, "samples": 0}
        *rgb, samples = film[y, x].tolist()
        return {"rgb": rgb, "samples": round(samples)}

    def _named(self, reply: Reply) -> Reply:
        """Return a reply that adds which shape of the scene a hit is of."""
        scene, look = self.scene, self.look

        def named(message: dict[str, Any]) -> None:
            if message["type"] == "hit" and message["shape"] is not None:
                number = look.shape(message["shape"])
                message["shape"] = number
                if number < len(scene.shapes):
                    message["object"] = panels.object_of(scene, number)
            reply(message)

        return named

    def _check_pixel(self, x: int, y: int) -> None:
        film = self.scene.film
        if not (x < film.width and y < film.height):
            raise CommandError(f"the film has {film.width}x{film.height} pixels")

    def _ask_hit(self, x: int, y: int, reply: Reply, then: Reply) -> None:
        self._check_pixel(x, y)
        self._ask(Question(self._loop.scene, x, y, reply, then=then))

    def _ask(self, question: Question) -> None:
        if self._probe is None:
            self._probe = Probe(self.device)
        self._probe.ask(question)

    # the scene

    def _do_edit(self, reply: Reply, target: str, index: int, key: str, value: object) -> None:
        scene, change = panels.edited(self.scene, target, index, key, value)
        if target == "camera":
            self._move(scene.camera)
            return
        self._show(scene, change)
        if key in (panels.KIND, panels.METAL):  # the panel has other values
            self._tell_state()

    def _do_undo(self, reply: Reply) -> None:
        self._go_to(self._history.back(State(self.scene, self.look)), "undo")

    def _do_redo(self, reply: Reply) -> None:
        self._go_to(self._history.forward(State(self.scene, self.look)), "redo")

    def _go_to(self, state: State | None, verb: str) -> None:
        """Show a state of the history; the camera and the end of the render stay."""
        if state is None:
            raise CommandError(f"there is nothing to {verb}")
        now = self.scene
        scene = dataclasses.replace(state.scene, camera=now.camera, spp=now.spp, noise=now.noise)
        self._show(scene, Change(whole=True), state.look)
        self._tell_state()

    def _do_size(self, reply: Reply, width: int, height: int) -> None:
        before = self.scene.film
        film = dataclasses.replace(before, width=width, height=height, crop=None)
        if before.crop is None and before.size == film.size and self.look.region is None:
            return
        look = dataclasses.replace(self.look, region=None)  # it is told in pixels
        self._show(dataclasses.replace(self.scene, film=film), Change(whole=True), look)
        self._tell_state()

    def _do_restore(self, reply: Reply) -> None:
        if self.scene is self._first and self.look == Look():
            raise CommandError("the scene is as in the file")
        self._show(self._first, Change(whole=True), Look())
        self._set_pivot()
        self._tell_state()

    def _do_hide(self, reply: Reply, shape: int, hidden: bool) -> None:
        if shape >= len(self.scene.shapes):
            raise CommandError(f"the scene has {len(self.scene.shapes)} objects")
        others = self.look.hidden - {shape}
        self._look(hidden=others | {shape} if hidden else others)

    def _do_hide_at(self, reply: Reply, x: int, y: int) -> None:
        look = self.look

        def hide(hit: dict[str, Any]) -> None:
            if hit["shape"] is None:
                reply({"type": "note", "text": "there is nothing to hide"})
            else:
                values = {"shape": look.shape(hit["shape"]), "hidden": True}
                self.post(Request("hide", values), reply)

        self._ask_hit(x, y, reply, hide)

    def _do_show_all(self, reply: Reply) -> None:
        self._look(hidden=frozenset())

    def _do_lamp(self, reply: Reply, name: str | None) -> None:
        self._look(lamp=name)

    def _do_wavelength(self, reply: Reply, nm: float | None, width: float) -> None:
        if nm is not None and self.scene.film.mode != "spectral":
            raise CommandError("a picture in RGB has no wavelengths")
        self._look(wavelength=nm, width=width)

    def _do_region(
        self, reply: Reply, x: int | None, y: int | None, width: int | None, height: int | None
    ) -> None:
        if x is None or y is None or width is None or height is None:
            self._look(region=None)
            return
        film = self.scene.film
        if x + width > film.width or y + height > film.height:
            raise CommandError("the region does not lie in the film")
        self._look(region=(x, y, width, height))

    def _look(self, **changes: Any) -> None:
        look = dataclasses.replace(self.look, **changes)
        if look != self.look:
            self._show(self.scene, Change(whole=True), look)
        self._tell_state()

    # the render

    def _do_copy_view(self, reply: Reply) -> None:
        reply({"type": "view", "view": self._view()})

    def _view(self) -> dict[str, Any]:
        return saving.written(self.scene, self._loop.display)

    def _do_display(self, reply: Reply, exposure: float, tone: str) -> None:
        self._loop.show(Display(exposure, tone, self._loop.display.view), self.look.shows)

    def _do_shows(self, reply: Reply, name: str) -> None:
        if name not in pictures.MAPS:
            raise CommandError(f"there is no {name} to show")
        if name == pictures.DENOISED and not self.look.denoises:
            try:
                oidn.check_installed()
            except SceneError as error:
                raise CommandError(error.message) from error
            self._look(shows=name, denoises=True)
            return
        if name in pictures.SURFACES and name not in (*self.scene.film.layers, *self.look.layers):
            self._look(shows=name, layers=(*self.look.layers, name))
            return
        self.look = dataclasses.replace(self.look, shows=name)
        self._loop.show(self._loop.display, name)
        self._tell_state()

    def _do_pause(self, reply: Reply, paused: bool) -> None:
        self._loop.paused = paused
        self._tell_state()

    def _do_stop_at(self, reply: Reply, spp: int, noise: float | None) -> None:
        until: dict[str, Any] = {"spp": spp, "noise": noise}
        self._first = dataclasses.replace(self._first, **until)
        self.scene = dataclasses.replace(self.scene, **until)
        before = self._loop.scene.noise
        shown = dataclasses.replace(self._loop.scene, spp=spp, noise=noise)
        if noise != before:  # filters and light paths may depend on it
            self._begin(shown, Change(whole=True))
        else:
            self._loop.scene = shown
            self._loop.wants_more()
        self._tell_state()

    def _do_restart(self, reply: Reply) -> None:
        self._show(self.scene, Change(whole=True))

    def _do_keep(self, reply: Reply, kept: bool) -> None:
        self._loop.kept = self._loop.film if kept else None
        self._tell_state()

    def _do_statistics(self, reply: Reply) -> None:
        stats = dataclasses.asdict(self._loop.renderer().stats)
        reply({"type": "statistics", "stats": stats, "device": self.where})

    def _do_save(self, reply: Reply, what: str) -> None:
        if self.folder is None:
            raise CommandError("no folder was given to save in")
        if what == "scene":
            path = self.folder.save_scene(self.scene)
        elif what == "view":
            path = self.folder.save_view(self._view())
        elif what == "png":
            path = self.folder.save_png(self._loop.pixels())
        else:
            path = self.folder.save_exr(self._loop.renderer(), self._loop.seconds)
        reply({"type": "saved", "what": what, "name": str(path.relative_to(self.folder.folder))})


def differ(scene: Scene, other: Scene) -> bool:
    """Return whether scenes differ in more than the camera."""
    return any(getattr(scene, part) is not getattr(other, part) for part in EDITABLE)


def is_quick(request: Request) -> bool:
    """Return whether a request can be done while samples are taken."""
    command = COMMANDS.get(request.name)
    return command is not None and command.quick


def merged(requests: list[tuple[Request, Reply]]) -> list[tuple[Request, Reply]]:
    """Return requests; consecutive moves of a kind are added up."""
    kept: list[tuple[Request, Reply]] = []
    for request, reply in requests:
        last = kept[-1][0] if kept else None
        if last is not None and request.name == last.name and request.name in MOVES:
            values = {key: last.values[key] + value for key, value in request.values.items()}
            kept[-1] = Request(request.name, values), reply
        else:
            kept.append((request, reply))
    return kept
