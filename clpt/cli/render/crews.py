"""Who renders the frames of an animation: devices of this machine, or the workers of a cluster."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ... import device as dev
from ...cluster.cluster_renderer import ClusterRenderer
from ...render.progress import Progress
from ...scene import Scene
from ..options.scene_options import AnyRenderer, choose_devices, new_renderer, share_compilers
from ..printing.display import Display
from .on_cluster import Watch, connected, pass_seconds, picture_device
from .passes import PASS_SECONDS

if TYPE_CHECKING:
    from distributed import Client

OVERLAP = 2  # frames of a cluster at a time: workers begin the next one while the last one ends


class Crew:
    """Renders one frame after the other.

    name: for people; frame: the number of the frame that is rendered, infinite without.
    """

    name = ""
    frame = math.inf

    def make(self, scene: Scene, shown: Display) -> AnyRenderer | ClusterRenderer:
        """Return a new renderer of a scene."""
        raise NotImplementedError

    def pass_seconds(self, scene: Scene) -> float:
        """Return how long a pass should take."""
        return PASS_SECONDS

    def tell(self, progress: Progress) -> None:
        """Note what there is to say while a frame is rendered."""

    def stop(self) -> None:
        """End what would delay the end of the process, after a signal."""


class DeviceCrew(Crew):
    """Devices of this machine; made: options of their renderer."""

    def __init__(self, devices: list[dev.Device], made: Mapping[str, Any]):
        self.devices, self._made = devices, made
        self.name = " and ".join(on.info.label for on in devices)

    def make(self, scene: Scene, shown: Display) -> AnyRenderer:
        """Return a new renderer of a scene."""
        with shown.phase(
            f"building kernels for {' and '.join(on.info.name for on in self.devices)}"
        ):
            return new_renderer(scene, self.devices, **self._made)

    def stop(self) -> None:
        """End the processes that compile."""
        for on in self.devices:
            if on.compilers is not None:
                on.compilers.kill()


class ClusterCrew(Crew):
    """The workers of a cluster, of which frames with lower numbers come first.

    crews: all of this cluster; made: options of its renderer, with those of `ClusterRenderer`.
    """

    def __init__(
        self, where: str, client: Client, crews: list[ClusterCrew], made: Mapping[str, Any]
    ):
        self.name, self._client, self._crews, self._made = where, client, crews, made
        self.renderer: ClusterRenderer | None = None
        self.watch: Watch

    def make(self, scene: Scene, shown: Display) -> ClusterRenderer:
        """Return a new renderer of a scene."""
        others = [one.renderer for one in self._crews if one.renderer and one is not self]
        beside = others[0] if others else None
        self.renderer = ClusterRenderer(scene, self._client, beside=beside, **self._made)
        self.renderer.farm.priority = self._priority
        return self.renderer

    def pass_seconds(self, scene: Scene) -> float:
        """Return how long a pass should take."""
        return pass_seconds(scene.noise is not None)

    def tell(self, progress: Progress) -> None:
        """Tell of workers that come and go."""
        self.watch.look()

    def _priority(self) -> float:
        """That of this frame's blocks among those of the others: earlier frames come first."""
        return -self.frame


def device_crews(
    device: str | None,
    threads: int | None,
    frames: int,
    profiling: bool,
    made: Mapping[str, Any],
    resources: ExitStack,
) -> list[Crew]:
    """Return a crew for each device, or one of all where there are fewer frames.

    resources: get the processes that compile.
    """
    devices = choose_devices(device, profiling=profiling, threads=threads)
    share_compilers(devices, threads, resources)
    options = {**made, "profiling": profiling}
    if frames < len(devices):
        return [DeviceCrew(devices, options)]
    return [DeviceCrew([one], options) for one in devices]  # with nothing to add up


@contextmanager
def cluster_crews(
    where: str,
    keys: Path | None,
    device: str | None,
    threads: int | None,
    frames: int,
    made: Mapping[str, Any],
    shown: Display,
) -> Iterator[list[Crew]]:
    """Yield crews for the workers at an address; tell at the end what each worker has done.

    frames: that may be rendered at a time.
    """
    chosen = {name: value for name, value in made.items() if value is not None}
    with connected(where, keys, device, threads, shown) as client:
        crews: list[ClusterCrew] = []
        options = {**chosen, "device": picture_device(where, device)}
        crews += [ClusterCrew(where, client, crews, options) for _ in range(min(frames, OVERLAP))]
        watch = Watch(lambda: [crew.renderer for crew in crews if crew.renderer], shown)
        for crew in crews:
            crew.watch = watch
        yield [*crews]
        watch.report()
