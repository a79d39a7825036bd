"""Pictures for a DataLoader of PyTorch, which clpt itself does not need."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import numpy as np

from clpt.arrays import whole
from clpt.dataset.generating import MakeScene, PictureOptions, Renderers
from clpt.dataset.picture import Picture

if TYPE_CHECKING:
    from typing_extensions import Unpack


class Pictures:
    """Pictures of random scenes by number, as `torch.utils.data.DataLoader` takes them.

    make_scene, options: as of `clpt.dataset.pictures`; count: of pictures. A picture is a dict:
    index; image (h, w, 3) float32; with ground truth also depth (h, w) [m] and normal (h, w, 3)
    float32, and instances (h, w) int32. `torch.from_dlpack` and `torch.as_tensor` take the arrays
    without a copy; a batch of the loader is one copy.

    Each process renders by itself. A pickled one, as workers get it, has no renderer yet.
    """

    def __init__(self, make_scene: MakeScene, count: int, **options: Unpack[PictureOptions]):
        self.make_scene, self.count = make_scene, whole(count, 0, where="count")
        self.options = options
        self._renderers: Renderers | None = None
        self._process = 0  # that has the renderers

    def __len__(self) -> int:
        return self.count

    def __getitem__(self, index: int) -> dict[str, int | np.ndarray]:
        """Render a picture. Raises IndexError, what make_scene raises, and as `clpt.Renderer`."""
        number = index + self.count if index < 0 else index
        if not 0 <= number < self.count:
            raise IndexError(f"picture {index} of {self.count}")
        if self._renderers is None or self._process != os.getpid():
            self._renderers, self._process = Renderers(self.options), os.getpid()
        return _arrays(self._renderers.picture(self.make_scene, number))

    def __getstate__(self) -> dict[str, object]:
        return {**self.__dict__, "_renderers": None}

    def close(self) -> None:
        """Give the memory of devices back; another picture takes it again."""
        if self._renderers is not None:
            self._renderers.close()
        self._renderers = None


def _arrays(picture: Picture) -> dict[str, int | np.ndarray]:
    arrays: dict[str, int | np.ndarray] = {"index": picture.index, "image": picture.image}
    if picture.truth is not None:
        arrays["depth"] = picture.truth.depth.astype(np.float32, order="C")
        arrays["normal"] = picture.truth.normal.astype(np.float32, order="C")
        arrays["instances"] = picture.truth.instances
    return arrays
