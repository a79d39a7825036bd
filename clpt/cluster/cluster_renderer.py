"""A renderer whose samples come from the workers of a Dask cluster."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from clpt import device as dev
from clpt.cluster import tasks
from clpt.cluster.blocks import WorkerRecord
from clpt.cluster.cluster_maker import ClusterMaker
from clpt.cluster.farm import Farm
from clpt.render.options import check_options, check_scene
from clpt.render.resumable import ResumableRenderer
from clpt.scene import Scene

if TYPE_CHECKING:
    from distributed import Client

NO_WORKER_SECONDS = 300.0  # without any worker, until the render fails


class ClusterRenderer(ResumableRenderer):
    """Renders a scene on the workers of a cluster, with the methods of `Renderer`.

    client: a Dask client of any cluster whose workers have clpt installed. mixed: whether workers
    of different device classes may take part; the last bits of the picture then depend on the
    distribution of samples. patience: seconds without any worker until the render fails.
    first_sample: the number of the first sample. device: of this machine, for pictures and noise
    measurements. beside: a renderer of the same cluster that renders at the same time; both use
    the same device class.
    options: halves, layout, queued, looped, slots, texture_budget, tree_quality, denoise, see
    `Renderer`.

    This process adds the films up and keeps the sum whatever happens to the cluster. At a stop
    workers send partial films; the next run renders the missing samples, but with a noise limit no
    sample number is reused. A single thread may use the renderer; `cancel` works from any thread.
    warnings: for people.

    Raises TypeError for an unknown option or anything but a scene, SceneError for a scene that
    cannot be written and for custom materials.
    """

    _maker: ClusterMaker

    def __init__(
        self,
        scene: Scene,
        client: Client,
        *,
        device: dev.Device | str | int | None = None,
        mixed: bool = False,
        patience: float = NO_WORKER_SECONDS,
        first_sample: int = 0,
        beside: ClusterRenderer | None = None,
        **options: Any,
    ):
        options = {name: value for name, value in options.items() if value is not None}
        check_scene(scene)
        check_options(scene, options)
        unknown = options.keys() - {*tasks.OPTIONS, "denoise"}
        if unknown:
            raise TypeError(f"the option {min(unknown)!r} is of one device, not of a cluster")
        self.farm = Farm(client, mixed=mixed, patience=patience)
        if beside is not None:
            self.farm.known.agreed = beside.farm.known.agreed
        maker = ClusterMaker(scene, self.farm, device, options)
        super().__init__(maker, options.get("denoise"), first_sample)

    @property
    def digest(self) -> str:
        """The job's SHA-256 for workers: of scene, options, kernels and version."""
        return self._maker.job.digest

    @property
    def workers(self) -> dict[str, WorkerRecord]:
        """Records of workers by address: rate, blocks, samples, failures."""
        return dict(self.farm.known.records)

    @property
    def _device_text(self) -> str:
        kinds = {record.kind for record in self.workers.values()}
        return "; ".join(sorted(kinds)) or super()._device_text

    @property
    def refused(self) -> dict[str, str]:
        """The reasons why workers were refused, by address."""
        return dict(self.farm.known.refused)

    @property
    def lost(self) -> int:
        """The number of workers that left."""
        return self.farm.known.lost
