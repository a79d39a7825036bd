"""Images that are converted: pictures, films, and single layers."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from ... import images
from ...errors import SceneError, nearest
from ...version import VERSION
from ..options.grading import Grading, for_screens
from .film_contents import film_contents
from .image_contents import ImageContents, in_order, read_contents
from .targets import checked, is_film


def contents(path: Path) -> ImageContents:
    """Return an image, a film or a checkpoint. Raises SceneError."""
    return film_contents(path) if is_film(path) else read_contents(path)


def write_converted(
    source: Path, target: Path, layer: str | None, grading: Grading, tell: Callable[[str], None]
) -> None:
    """Write an image in the format of the target. Raises SceneError."""
    (target,) = checked((target,))
    if text := grading.unused((target,)):
        tell(f"clpt: warning: {text}")
    image = contents(source)
    pixels = _picture(image) if layer is None else _layer(image, layer)
    if source.suffix.lower() in images.STRAIGHT:
        pixels = images.multiplied(pixels)
    metadata: dict[str, str | int | float] = {
        "software": f"clpt {VERSION}", "source": source.name
    }  # fmt: skip
    stops = image.stops if layer is None else 0.0
    if stops and target.suffix.lower() == ".exr":
        metadata[images.STOPS] = stops
    images.write(
        target, pixels, metadata=metadata, exposure=images.raised(grading.exposure, stops),
        tone=grading.tone, view=grading.view,
    )  # fmt: skip
    if grading.exposure == "auto" and for_screens((target,)):
        tell(f"exposure {images.auto_exposure(images.straight(pixels)) - stops:+.1f} stops")
    tell(str(target))


def _picture(image: ImageContents) -> np.ndarray:
    """The colours of an image, linear Rec. 709, with alpha where it has that. Raises SceneError."""
    if image.colours is None:
        choice = f"--layer takes one of {', '.join(_layers(image))}"
        raise SceneError(f"has no colours; {choice}", file=image.path)
    if "A" not in image.labels:
        return image.colours
    alpha = image.values[..., image.labels.index("A")]
    return np.dstack([image.colours, alpha])


def _layer(image: ImageContents, name: str) -> np.ndarray:
    """The channels of a layer (h, w, 1 or 3). Raises SceneError."""
    known = _layers(image)
    if name not in known:
        raise SceneError(f"has no layer {name!r}{nearest(name, known)}", file=image.path)
    found = sorted(known[name], key=lambda place: in_order(image.labels[place].rpartition(".")[2]))
    return np.asarray(image.values[..., found[: 3 if len(found) >= 3 else 1]])


def _layers(image: ImageContents) -> dict[str, list[int]]:
    """The places of channels by their layer; those of the picture by their own names."""
    layers: dict[str, list[int]] = {}
    for place, label in enumerate(image.labels):
        layers.setdefault(label.rpartition(".")[0] or label, []).append(place)
    return layers
