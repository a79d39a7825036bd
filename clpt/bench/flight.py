"""A wavefront whose stages run singly, with access to its paths."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import device
from clpt.bench.figures import Taken, timed
from clpt.layout import Record
from clpt.records import HIT, PATH, PATH_BITS, SHADOW
from clpt.render.flow.scene_to_tables import lower
from clpt.render.wavefront.bounce_loop import Step
from clpt.render.wavefront.path_buffers import default_slots
from clpt.render.wavefront.wavefront import Wavefront
from clpt.scene import Scene

ALIVE, FRESH, DONE = (PATH_BITS[name] for name in ("alive", "fresh", "done"))
ENDLESS = 1 << 24  # samples of a pixel
_TYPES = {"integer": np.int32, "natural": np.uint32}


class Flight:
    """A scene's paths in flight, with about a slot for each pixel of a small picture.

    slots: paths in flight, by default the number of a render on the device. Other parameters and
    errors: see clpt.render.wavefront.wavefront.Wavefront.create.
    """

    def __init__(self, on: device.Device, scene: Scene, slots: int | None = None, **wavefront: Any):
        slots = slots or default_slots(on.info)
        width, height = scene.film.size
        side = math.sqrt(slots * width / height)
        width, height = (max(4, round(n / 4) * 4) for n in (side, slots / side))
        film = dataclasses.replace(scene.film, width=width, height=height, crop=None, bands=0)
        self.scene = dataclasses.replace(scene, film=film)
        self.device = on
        self.wavefront = Wavefront.create(on, lower(self.scene), slots=slots, **wavefront)
        self.slots = self.wavefront.paths.slots
        self.restart()

    def restart(self) -> None:
        """Empty the film, and restart every slot at its first sample."""
        self.wavefront.clear()
        self.wavefront.paths.restart()
        self.wavefront.stages[0].bound.set_args(samples=(0, ENDLESS))

    def bounce(self) -> None:
        """Enqueue the stages of a bounce."""
        for step in self.wavefront.stages:
            self.stage(step)

    def stage(self, step: Step) -> Any:
        """Enqueue a stage; return its event."""
        return self.wavefront.stream.run(step.bound, step.size, step.group)

    def timed(self, step: Step) -> tuple[int, Taken]:
        """Run a stage; return its items and their time."""
        return self.items(step), timed(self.device, lambda: [self.stage(step)])

    def read(self, record: Record, name: str) -> NDArray:
        """Return a member of all slots: (slots,), or (slots, components)."""
        member = next(m for m in record.members if m.name == name)
        wave = self.wavefront
        buffer = wave.paths.arguments[f"{record.name.lower()}_words"]
        streams = np.empty((member.words, self.slots), _TYPES.get(member.type, np.float32))
        for i, stream in enumerate(streams):
            wave.stream.read_rows(buffer, stream, wave.paths.rows(record, member.word + i))
        return streams[0] if member.words == 1 else np.ascontiguousarray(streams.T)

    @property
    def alive(self) -> NDArray[np.bool_]:
        """Which slots have a ray in flight."""
        return (self.read(PATH, "state") & ALIVE) != 0

    @property
    def met(self) -> NDArray[np.bool_]:
        """Which slots' rays have met a surface; after `intersect`."""
        return self.alive & (self.read(HIT, "prim") >= 0)

    @property
    def waiting(self) -> NDArray[np.bool_]:
        """Which slots begin a path in the next bounce: their path has ended or left the scene."""
        state = self.read(PATH, "state")
        alive = (state & ALIVE) != 0
        missed = alive & ((state & FRESH) == 0) & (self.read(HIT, "prim") < 0)
        return ((state & DONE) == 0) & (~alive | missed)

    @property
    def shadowed(self) -> NDArray[np.bool_]:
        """Which slots have an untested shadow ray."""
        return self.read(SHADOW, "t") > 0.0

    @property
    def kinds(self) -> NDArray[np.int32]:
        """The kind of material at each slot's hit, in the order of the features; or -1."""
        word = self.read(HIT, "material").view(np.uint32)
        return np.where(self.met, (word >> 24).astype(np.int32), -1)

    def items(self, step: Step) -> int:
        """Count the slots that a stage has work for."""
        kernel = step.bound.kernel.name
        if kernel in ("generate", "emit"):
            return int(self.waiting.sum())
        if kernel == "intersect":
            return int(self.alive.sum())
        if kernel == "mix_materials":
            return int(self.met.sum())
        if kernel == "shade":
            kinds = self.wavefront.features.materials.kinds
            return int((self.kinds == kinds.index(step.name.removeprefix("shade_"))).sum())
        if kernel in ("shadow", "splat"):
            return int(self.shadowed.sum())
        return self.slots
