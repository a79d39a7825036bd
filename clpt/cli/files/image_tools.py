"""Images that are converted and compared: pictures, films, and single layers."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from clpt import images
from clpt.files import output_files
from clpt.images.colour import false_colours

from ...choices import FOR_SCREENS
from ...errors import SceneError, nearest, one_line
from ...images import screen_files
from ...images.measures import Differences, differences, size_of
from ...version import VERSION
from ..options.grading import Grading, for_screens
from .image_contents import ImageContents, contents, in_order, size_text
from .targets import checked

MOST = 0.99  # of the pixels differ by less than the brightest of the false colours


def write_converted(
    source: Path, target: Path, layer: str | None, grading: Grading
) -> Iterator[str]:
    """Write an image in the format of the target; yield lines about it. Raises SceneError."""
    (target,) = checked((target,))
    if text := grading.unused((target,)):
        yield f"clpt: warning: {text}"
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
        yield f"exposure {images.auto_exposure(images.straight(pixels)) - stops:+.1f} stops"
    yield str(target)


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
    channels = sorted(
        known[name], key=lambda place: in_order(image.labels[place].rpartition(".")[2])
    )
    return np.asarray(image.values[..., channels[: 3 if len(channels) >= 3 else 1]])


def _layers(image: ImageContents) -> dict[str, list[int]]:
    """The places of channels by their layer; those of the picture by their own names."""
    layers: dict[str, list[int]] = {}
    for place, label in enumerate(image.labels):
        layers.setdefault(label.rpartition(".")[0] or label, []).append(place)
    return layers


@dataclass(frozen=True)
class Pair:
    """Two images (h, w, n) of equal shape and channels, and how they differ."""

    paths: tuple[Path, Path]
    a: np.ndarray
    b: np.ndarray
    labels: tuple[str, ...]
    figures: Differences

    @classmethod
    def read(cls, a: Path, b: Path) -> Pair:
        """Read two files. Raises SceneError where they cannot be compared."""
        first, second = contents(a), contents(b)
        sizes = size_text(first.values), size_text(second.values)
        if sizes[0] != sizes[1]:
            advice = "; render both with the same --size"
            raise SceneError(f"is {sizes[1]} pixels, and {a} is {sizes[0]}{advice}", file=b)
        if _same_wavelengths(first.lambdas, second.lambdas):
            values, labels = (first.values, second.values), first.labels
        elif first.colours is not None and second.colours is not None:
            values, labels = (first.colours, second.colours), ("R", "G", "B")
        elif first.labels == second.labels:
            values, labels = (first.values, second.values), first.labels
        else:
            channels = f"{', '.join(second.labels)}, and {a} has {', '.join(first.labels)}"
            raise SceneError(f"has other channels: {channels}", file=b)
        return cls((a, b), *values, labels, differences(*values))

    @property
    def place(self) -> str:
        """Where the largest difference is."""
        x, y, channel = self.figures.where
        return one_line(f"{x},{y} {self.labels[channel]}")


def _same_wavelengths(a: np.ndarray | None, b: np.ndarray | None) -> bool:
    """Whether two images are spectral, and of the same wavelengths."""
    return a is not None and b is not None and np.array_equal(a, b)


def as_json(pair: Pair) -> str:
    """Return the figures as JSON."""
    figures = asdict(pair.figures) | {"root_mean_square": pair.figures.root_mean_square}
    x, y, channel = pair.figures.where
    figures["where"] = {"at": [x, y], "channel": pair.labels[channel]}
    return json.dumps({"files": [str(path) for path in pair.paths], **figures}, indent=2)


def as_text(pair: Pair) -> str:
    """Return the figures as lines."""
    figures = pair.figures
    share = f" ({figures.bias / figures.means[1]:+.3%} of B)" if figures.means[1] else ""
    rows = {
        "mean of A": f"{figures.means[0]:.6g}",
        "mean of B": f"{figures.means[1]:.6g}",
        "mean difference": f"{figures.bias:+.4g}{share}",
        "mean absolute error": f"{figures.absolute:.4g}",
        "root mean square error": f"{figures.root_mean_square:.4g}",
        "relative square error": f"{figures.relative_square:.4g}",
        "largest difference": f"{figures.largest:.4g} at {pair.place}",
    }
    if not figures.largest and not figures.lost:
        rows = {"mean of both": rows["mean of A"], "difference": "none: all values are the same"}
    if figures.lost:
        rows["not finite, left out"] = f"{figures.lost:,} values"
    return "\n".join(f"{name:<24} {value}" for name, value in rows.items())


def write(pair: Pair, path: Path, most: float | None) -> str:
    """Write the difference, and return a line about it. Raises SceneError.

    most: that is the brightest of the false colours.
    """
    (path,) = checked((path,))
    if path.suffix.lower() not in FOR_SCREENS:
        apart = pair.a - pair.b
        images.write(path, apart if apart.shape[2] in (1, 3) else size_of(pair.a, pair.b))
        return str(path)
    size = size_of(pair.a, pair.b)
    top = most or float(np.quantile(size, MOST)) or float(size.max()) or 1.0
    data = screen_files.encode(path.suffix.lower(), false_colours(size / top))
    try:
        output_files.write(path, data)
    except OSError as error:
        raise SceneError(f"cannot be written: {error}", file=path) from error
    return f"{path}  black: no difference, bright yellow: {top:.3g} and more"
