"""A renderer on several devices of this machine at once."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from clpt import device as dev
from clpt.cluster.devices_maker import DevicesMaker
from clpt.errors import DeviceError
from clpt.render.options import RenderOptions, check_options, check_scene
from clpt.render.resumable import ResumableRenderer
from clpt.scene import Scene

if TYPE_CHECKING:
    from typing_extensions import Unpack


@dataclass(frozen=True)
class DeviceShare:
    """A device's part in a picture.

    name: of the device; share: of all paths, 0 to 1; rate: of paths [1/s]; failure: the error of a
    failed device, None otherwise.
    """

    name: str
    share: float
    rate: float
    failure: str | None


class MultiRenderer(ResumableRenderer):
    """Renders a scene on several devices; its picture so far is available between runs.

    devices: "all", "gpu", or names or indexes as `clpt.device.choose_all` takes them, and
    clpt.device.Device objects. options: see `RenderOptions`, without `queue`; `threads` counts for
    each CPU. If all devices have the same class, as two equal GPUs do, the film equals that of a
    `Renderer` to the bit: the samples are the same on every device.

    A device that fails is left out, with a warning in `warnings` and in the log, and the others
    render its samples. The class has the methods of `Renderer` except `step`, which returns before
    devices have shared out samples. `film` is memory of the first device, which holds the picture
    until the next run.

    Raises like `Renderer`; also DeviceError if a device is named twice, and SceneError for arrays
    in a device's memory.
    """

    _maker: DevicesMaker

    def __init__(
        self,
        scene: Scene,
        devices: str | Iterable[dev.Device | str | int] = "all",
        **options: Unpack[RenderOptions],
    ):
        check_scene(scene)
        check_options(scene, options)
        if options.pop("queue", None) is not None:
            raise DeviceError("a queue is of one device; give a Renderer the queue")
        threads, profiling = options.pop("threads", None), options.get("profiling", False)
        chosen = dev.choose_all(devices, profiling=profiling, threads=threads)
        maker = DevicesMaker(scene, chosen, options)
        super().__init__(maker, options.get("denoise"), options.get("first_sample") or 0)

    @property
    def shares(self) -> tuple[DeviceShare, ...]:
        """The part of each device in the picture so far, failed devices last."""
        crew = self._maker.crew
        failed = {id(worker): str(error) for worker, error in crew.failed}
        workers = [*crew.workers, *(worker for worker, _ in crew.failed)]
        paths = max(sum(worker.paths for worker in workers), 1)
        return tuple(
            DeviceShare(worker.name, worker.paths / paths, worker.rate, failed.get(id(worker)))
            for worker in workers
        )
