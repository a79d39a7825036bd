"""The beginning of a session: while kernels are compiled, it shows the scene in plain colours."""

from __future__ import annotations

import dataclasses
import logging
import time
from collections.abc import Callable
from functools import partial

from clpt.arrays import Bytes
from clpt.device import Device
from clpt.render.renderer import Renderer
from clpt.scene import Scene
from clpt.view.making import Making
from clpt.view.solid import SAMPLES, shaded, solid
from clpt.view.target import Change, Make, Target, Variant

log = logging.getLogger(__name__)

PATIENCE = 0.4  # [s]


class Beginning:
    """Makes the first renderer of a session, and pictures of a solid scene until it is there.

    make: makes the renderer of `variant` of the scene, on the device. There are pictures of the
    solid scene where programs are in no cache, or where the scene takes longer than PATIENCE.
    """

    def __init__(self, device: Device, make: Make, variant: Variant, scene: Scene):
        self.variant = variant
        own = Device.open(device.info, context=device.context)  # nobody waits for these programs
        own.compilers, own.hurries = device.compilers, True
        small = partial(Renderer, device=own, tree_quality="fast")
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
        """Offer a picture of the solid scene if it takes long until there is another one.

        Kernels are compiled only after the first one.
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
