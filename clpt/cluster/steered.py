"""A scene that changes while a cluster renders it: what a page needs of a `Renderer`."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from clpt.cluster.cluster_renderer import ClusterRenderer
from clpt.device import Device
from clpt.errors import SceneError
from clpt.render.progress import Progress
from clpt.render.renderer import Renderer
from clpt.scene import Scene
from clpt.scene.cameras import Camera

if TYPE_CHECKING:
    from distributed import Client


class SteeredCluster:
    """The merged picture of workers, of whatever the scene is at the time.

    device: where pictures are made of the film; options: as of `ClusterRenderer`. A change is
    another job for the workers, who keep files and arrays that they have. Raises as
    `ClusterRenderer` does.
    """

    def __init__(self, scene: Scene, client: Client, device: Device, **options: Any):
        options.pop("cancel_seconds", None)  # of one device
        self._of = client, device, {k: v for k, v in options.items() if v is not None}
        self._renderer = self._new(scene)

    def _new(self, scene: Scene, former: ClusterRenderer | None = None) -> ClusterRenderer:
        client, device, options = self._of
        options = {**options, "device": device, "mixed": True}
        return ClusterRenderer(scene, client, beside=former, **options)

    def update(
        self, *, camera: Camera | None = None, materials: Any = None, scene: Scene | None = None
    ) -> None:
        """Begin again with another camera or scene. Raises SceneError for materials alone."""
        if materials is not None:
            raise SceneError("give the whole scene", where="materials")
        new = self.scene if scene is None else scene
        new = new if camera is None else dataclasses.replace(new, camera=camera)
        made = self._new(new, self._renderer)
        self._renderer.close()
        self._renderer = made

    def run(
        self,
        samples: int,
        progress: Callable[[Progress], bool | None] | None = None,
        *,
        noise: float | None = None,
    ) -> bool:
        """Add samples to every pixel, or to those with noise, as `ClusterRenderer.run` does."""
        return self._renderer.run(samples, progress, noise=noise)

    def cancel(self) -> None:
        """Let a run end soon."""
        self._renderer.cancel()

    def close(self) -> None:
        """Give back what this machine holds."""
        self._renderer.close()

    def shown(self) -> Renderer:
        """Return a renderer on this machine that holds the picture so far."""
        return self._renderer.shown()

    @property
    def scene(self) -> Scene:
        """The present scene."""
        return self._renderer.scene

    @property
    def samples(self) -> int:
        """How many samples each pixel has."""
        return self._renderer.samples

    @property
    def active(self) -> float:
        """The share of the pixels that would get more samples."""
        return self._renderer.active

    @property
    def devices(self) -> tuple[str, ...]:
        """The classes of the workers' devices."""
        return tuple(sorted({record.kind for record in self._renderer.workers.values()}))

    @property
    def film(self) -> Any:
        """The picture so far on the device of this machine, as `Renderer.film`."""
        return self.shown().film

    @property
    def stats(self) -> Any:
        """Figures of this machine's part, as `Renderer.stats`."""
        return self.shown().stats

    def resolve(self, **how: Any) -> Any:
        """A picture for a screen, as `Renderer.resolve`."""
        return self.shown().resolve(**how)

    def layers(self) -> Any:
        """The layers by name, as `Renderer.layers`."""
        return self._renderer.layers()
