"""Factories of renderers: on devices of this machine, or on the workers of a cluster."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from ... import device as dev
from ...render.progress import Progress
from ...render.renderer import Renderer
from ...render.resumable import ResumableRenderer
from ...scene import Scene
from ..options.scene_options import SceneOptions
from ..options.workers import Workers
from ..printing.display import Display
from ..printing.names import device_names
from ..process.allocator import reusing
from ..process.stopping import prompt
from .devices import ending_at_limit

if TYPE_CHECKING:  # one device has no use for what several need
    from distributed import Client

    from ...cluster.cluster_renderer import ClusterRenderer
    from .workers import Watch

OVERLAP = 2  # pictures of a cluster at a time: workers begin the next one while the last one ends
DEVICE_SECONDS = 3.0  # of a pass: at its end few paths are left; only there is there a checkpoint
CLUSTER_SECONDS = 30.0  # of a pass with noise, at the end of which workers wait for each other


class RendererFactory:
    """Makes the renderer of one picture after the other.

    name: for people; frame: the number of the frame that is rendered, infinite without.
    """

    name = ""
    frame = math.inf

    def make(self, scene: Scene, shown: Display, first_sample: int = 0) -> ResumableRenderer:
        """Return a new renderer of a scene, which takes samples from this number on."""
        raise NotImplementedError

    def pass_seconds(self, adaptive: bool, *periods: float | None) -> float:
        """Return how long a pass should take, infinite for a single one.

        adaptive: whether pixels end by their noise; periods: how often something is written.
        """
        return DEVICE_SECONDS

    def look(self, progress: Progress) -> None:
        """Note what there is to say while a picture is rendered."""

    def report(self) -> None:
        """Note what each machine has done."""

    def stop(self) -> None:
        """End what would delay the end of the process, after a signal."""


class DeviceFactory(RendererFactory):
    """Makes renderers on devices of this machine; renderer: the last one that was made."""

    renderer: ResumableRenderer

    def __init__(self, devices: list[dev.Device], options: SceneOptions):
        self.devices = devices
        self.name = " and ".join(on.info.label for on in devices)
        self._made = options.made

    def make(self, scene: Scene, shown: Display, first_sample: int = 0) -> ResumableRenderer:
        """Return a new renderer of a scene; note its warnings."""
        text = f"compiling for {device_names([on.info for on in self.devices])}"
        compiling = shown.compiling(text)
        with prompt(dev.kill_compilers), ending_at_limit(), reusing(), compiling as programs:
            for on in self.devices:
                on.builds.on_compile, on.builds.on_compiled = programs.begin, programs.end
            renderer = new_renderer(scene, self.devices, first_sample=first_sample, **self._made)
        for warning in renderer.warnings:
            shown.note(f"clpt: warning: {warning}")
        self.renderer = renderer
        return renderer

    def stop(self) -> None:
        """End the processes that compile."""
        dev.kill_compilers()


class ClusterFactory(RendererFactory):
    """Makes renderers on the workers of a cluster, where lower numbers of pictures come first.

    others: all factories of this cluster, itself among them; made: options of its renderer.
    """

    watch: Watch

    def __init__(
        self, name: str, client: Client, others: list[ClusterFactory], made: Mapping[str, Any]
    ):
        self.name, self._client, self._others, self._made = name, client, others, made
        self.renderer: ClusterRenderer | None = None

    def make(self, scene: Scene, shown: Display, first_sample: int = 0) -> ClusterRenderer:
        """Return a new renderer of a scene, whose warnings the watch notes."""
        from ...cluster.cluster_renderer import ClusterRenderer

        others = [one.renderer for one in self._others if one.renderer and one is not self]
        self.renderer = ClusterRenderer(
            scene, self._client, beside=others[0] if others else None, first_sample=first_sample,
            **self._made,
        )  # fmt: skip
        self.renderer.farm.priority = self._priority
        return self.renderer

    def pass_seconds(self, adaptive: bool, *periods: float | None) -> float:
        """Return how long a pass should take: without adaptive sampling there is one alone."""
        wanted = [seconds for seconds in periods if seconds]
        return min([CLUSTER_SECONDS, *wanted]) if adaptive else math.inf

    def look(self, progress: Progress) -> None:
        """Note workers that come and go."""
        self.watch.look()

    def report(self) -> None:
        """Note what each worker has done."""
        self.watch.report()

    def _priority(self) -> float:
        """That of this frame's blocks among those of the others: earlier frames come first."""
        return -self.frame


def new_renderer(scene: Scene, devices: list[dev.Device], **made: Any) -> ResumableRenderer:
    """Return a renderer on one device, or on several."""
    if len(devices) > 1:
        from ...cluster.multi_renderer import MultiRenderer

        return MultiRenderer(scene, devices, **made)
    return Renderer(scene, devices[0], **made)


def device_factories(
    devices: list[dev.Device], options: SceneOptions, pictures: int
) -> list[DeviceFactory]:
    """Return a factory for each device, or one of all where there are fewer pictures."""
    if pictures < len(devices):
        return [DeviceFactory(devices, options)]
    return [DeviceFactory([one], options) for one in devices]  # with nothing to add up


@contextmanager
def cluster_factories(
    workers: Workers, options: SceneOptions, pictures: int, shown: Display
) -> Iterator[list[ClusterFactory]]:
    """Yield factories of the workers at an address; pictures: that may be rendered at a time."""
    from .workers import Watch, connected

    device = options.machine.device
    several = workers.number is None or dev.names_several(device)
    made = options.made | {"device": None if several else device}  # one alone makes the pictures
    made = {name: value for name, value in made.items() if value is not None}
    with connected(workers, options.machine, shown) as client:
        factories: list[ClusterFactory] = []
        for _ in range(min(pictures, OVERLAP)):
            factories.append(ClusterFactory(workers.cluster or "", client, factories, made))
        watch = Watch(lambda: [one.renderer for one in factories if one.renderer], shown)
        for factory in factories:
            factory.watch = watch
        yield factories
