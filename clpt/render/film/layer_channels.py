"""Pictures with their layers as .exr files; channels have the names of clpt or of Blender."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from clpt import images
from clpt.arrays import Image
from clpt.choices import Exposure
from clpt.images import exr_files, spectral_exr
from clpt.images.colour import View
from clpt.render.film import cryptomatte
from clpt.render.film.layers import GROUP, matte_names
from clpt.render.film.pictures import PictureForm, Pictures
from clpt.scene.layers import LAYERS
from clpt.spectra.spaces import chromaticities

VIEW_LAYER = "ViewLayer."  # prefix of Blender's names
PICTURE = {"clpt": "", "blender": f"{VIEW_LAYER}Combined."}  # prefix of R, G and B of the picture
SETS = tuple(PICTURE)
BESIDE = {"noisy": "Noisy Image", "denoised_error": "Denoised Error"}  # Blender's names


def write_layers(
    path: str | Path,
    source: Pictures,
    *,
    names: str = "clpt",
    metadata: Mapping[str, str | int | float] | None = None,
) -> None:
    """Write the picture of a renderer or film and its layers as an .exr.

    path: of the file. source: the renderer or film. names: a name of SETS; "blender" gives names
    such as ViewLayer.Combined.R. metadata: further attributes of the file. The picture is stored in
    half floats; bands and layers are stored in float32. The data window of a crop is its part of
    the whole film. Raises SceneError.
    """
    source = source.developed()
    layers, form = source.layers(), source.form
    if form.adaptive:
        layers.setdefault("samples", source.samples_per_pixel()[..., None])
    channels = channels_of(layers, names)
    channels |= _beside(source, names)
    if form.bands and form.alpha:
        channels["A"] = source.picture()[..., 3]
    place = exr_files.windows(source.colours().shape, form.place)
    stated = {**(metadata or {}), **attributes_of(form, names), **place}
    if form.bands:
        said = {**stated, "chromaticities": chromaticities(form.output_space)}
        spectral = source.spectral_image()
        preview = source.colours() * np.float32(2.0**spectral.exposure)
        spectral_exr.write(path, spectral, preview=preview, metadata=said, layers=channels)
    else:
        images.write(
            path, source.image(), metadata=stated, layers=channels, space=form.output_space,
            prefix=PICTURE[names],
        )  # fmt: skip


def write_picture(
    path: Path,
    source: Pictures,
    *,
    names: str = "clpt",
    metadata: Mapping[str, str | int | float] | None = None,
    exposure: Exposure = 0.0,
    tone: str = "none",
    view: View | None = None,
) -> None:
    """Write the picture of a renderer or film in the format of a path's suffix.

    An .exr holds its layers and bands, an .npy its bands or else its colours. Other parameters are
    as in `write_layers` and `clpt.write_image`. Raises SceneError.
    """
    suffix, form = path.suffix.lower(), source.form
    if form.bands and suffix == ".npy":
        images.write_npy(path, source.image())
    elif suffix == ".exr":
        write_layers(path, source, names=names, metadata=metadata)
    else:
        images.write(
            path, source.picture(), metadata=metadata, space=form.output_space, tone=tone,
            view=view, exposure=images.raised(exposure, form.display_exposure),
        )  # fmt: skip


def channels_of(layers: Mapping[str, Image], names: str = "clpt") -> dict[str, Image]:
    """Return the channels of layers as an .exr has them, (h, w) by names such as depth.Z.

    layers: as `Renderer.layers` returns them; names: a name of SETS, "blender" gives names such as
    ViewLayer.Position.X.
    """
    channels: dict[str, Image] = {}
    for name, image in layers.items():
        prefix, layer = _prefix(name, names), LAYERS[_kind(name)]
        if layer.form == "matte":
            blender = names == "blender"
            letters = cryptomatte.SHORT_LETTERS if blender else cryptomatte.LETTERS
            channels |= cryptomatte.channels_of(prefix, image, letters)
            continue
        exr_names = layer.exr if names == "clpt" else ()
        for i, letter in enumerate(layer.channels):
            flipped = names == "blender" and letter in layer.flipped
            channel = exr_names[i] if exr_names else f"{prefix}.{letter}"
            channels[channel] = -image[..., i] if flipped else image[..., i]
    return channels


def _beside(source: Pictures, names: str) -> dict[str, Image]:
    channels: dict[str, Image] = {}
    for name, picture in source.extra_pictures.items():
        prefix = VIEW_LAYER + BESIDE[name] if names == "blender" else name
        if picture.ndim == 2:
            channels[f"{prefix}.X" if names == "blender" else prefix] = picture
        else:
            channels |= {f"{prefix}.{letter}": picture[..., i] for i, letter in enumerate("RGB")}
    return channels


def attributes_of(form: PictureForm, names: str = "clpt") -> dict[str, str | float]:
    """Return the attributes of an .exr: the stops for screens, and the names in mattes."""
    attributes: dict[str, str | float] = {}
    if form.display_exposure:
        attributes[images.STOPS] = form.display_exposure
    for name in form.layers:
        if LAYERS[name].form == "matte":
            attributes |= cryptomatte.attributes_of(_prefix(name, names), matte_names(form, name))
    return attributes


def _kind(name: str) -> str:
    """Return the key of a layer in LAYERS."""
    return name if name in LAYERS else "light_groups"


def _prefix(name: str, names: str) -> str:
    layer = LAYERS[_kind(name)]
    if names == "blender":
        group = "" if name in LAYERS else f"_{name.removeprefix(GROUP)}"
        return f"{VIEW_LAYER}{layer.blender}{group}"
    return layer.blender if layer.form == "matte" else name
