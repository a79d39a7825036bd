"""The beginning of a session: a renderer is built, while the scene is shown in plain colours."""

from __future__ import annotations

import dataclasses
import logging
import threading
import time
from collections.abc import Callable
from concurrent.futures import CancelledError, Future
from functools import partial

from clpt.arrays import Bytes
from clpt.device import Device
from clpt.render.renderer import Renderer
from clpt.scene import Scene
from clpt.view.solid import SAMPLES, shaded, solid
from clpt.view.target import Change, Make, Target, Variant

log = logging.getLogger(__name__)

PATIENCE = 0.4  # [s]


class Making:
    """Makes a renderer in a separate thread, which waits before it compiles anything new.

    device: of the renderer; make: returns it.
    """

    def __init__(self, device: Device, make: Callable[[], Renderer]):
        self._builds, self._make = device.builds, make
        self._news = threading.Condition()
        self._is_new = self._goes_on = self._is_given_up = False
        self._result: Future[Renderer] = Future()
        self._result.add_done_callback(lambda _: self._tell())
        self._builds.on_new = self._wait_to_compile
        threading.Thread(target=self._main, name="clpt view programs", daemon=True).start()

    @property
    def is_done(self) -> bool:
        """Whether the renderer is made, or cannot be."""
        return self._result.done()

    @property
    def is_new(self) -> bool:
        """Whether there is something to compile that no cache has."""
        return self._is_new

    def wait(self, seconds: float) -> None:
        """Wait until it is done, or waits itself, but no longer than this."""
        with self._news:
            self._news.wait_for(
                lambda: self.is_done or (self._is_new and not self._goes_on), seconds
            )

    def go_on(self) -> None:
        """Let the thread compile."""
        with self._news:
            self._goes_on = True
            self._news.notify_all()

    def renderer(self) -> Renderer:
        """Return the renderer; wait for it. Raises what making it has raised."""
        self.go_on()
        return self._result.result()

    def give_up(self) -> None:
        """Let the thread end soon, wait for that, and close its renderer."""
        self._is_given_up = True
        self.go_on()
        if self._result.exception() is None:
            self._result.result().close()

    def _main(self) -> None:
        try:
            renderer = self._make()
        except BaseException as error:
            self._end()
            self._result.set_exception(error)
        else:
            self._end()
            self._result.set_result(renderer)

    def _end(self) -> None:
        self._builds.on_new = lambda: None

    def _tell(self) -> None:
        with self._news:
            self._news.notify_all()

    def _wait_to_compile(self) -> None:
        """Wait in a thread that would compile. Raises CancelledError once it is given up."""
        with self._news:
            self._is_new = True
            self._news.notify_all()
            self._news.wait_for(lambda: self._goes_on)
        if self._is_given_up:
            raise CancelledError


class Beginning:
    """Makes the first renderer of a session, and pictures of a solid scene until it is there.

    make: makes the renderer of `variant` of the scene, on the device. There are pictures of the
    solid scene where programs are in no cache, or where the scene takes longer than PATIENCE.
    """

    def __init__(self, device: Device, make: Make, variant: Variant, scene: Scene):
        self.variant = variant
        # Nobody waits for these programs.
        unhurried = Device.open(device.info, context=device.context)
        unhurried.compilers, unhurried.hurries = device.compilers, True
        small = partial(Renderer, device=unhurried, tree_quality="fast")
        self._solid = Target(small, lambda scene: solid(variant(scene)))
        self._making = Making(device, lambda: make(variant(scene)))
        self._fails, self._began = False, time.monotonic()

    def note(self, change: Change) -> None:
        """Note that the scene has changed; no camera of a solid scene is in a medium."""
        camera = change.camera and dataclasses.replace(change.camera, medium=None)
        self._solid.note(dataclasses.replace(change, camera=camera))

    @property
    def is_over(self) -> bool:
        """Whether the renderer is made, or cannot be."""
        return self._making.is_done

    def wait(self, seconds: float) -> None:
        """Wait until there is something to do, but no longer than this."""
        self._making.wait(seconds)

    def show(self, scene: Scene, offer: Callable[[Bytes], None]) -> None:
        """Offer a picture of the solid scene if the real picture takes long.

        Kernels are compiled only after the first picture.
        """
        soon = not self._making.is_new and time.monotonic() - self._began < PATIENCE
        if soon or self._fails:
            return
        try:
            renderer = self._solid.follow(scene)
            renderer.reset()
            renderer.run(SAMPLES)
            if not self.is_over:
                offer(shaded(renderer))
        except Exception:  # the scene's own renderer tells what is wrong
            log.debug("the scene is not shown in plain colours", exc_info=True)
            self._fails = True
        self._making.go_on()

    def renderer(self) -> Renderer:
        """Return the renderer; wait for it. Raises what making it has raised."""
        self._solid.close()
        return self._making.renderer()

    def close(self) -> None:
        """Give up, and give the device's memory back."""
        self._making.give_up()
        self._solid.close()
