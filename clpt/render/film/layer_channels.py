"""Pictures with their layers as .exr files, by one of two sets of names."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from clpt import images
from clpt.arrays import Image
from clpt.choices import Exposure
from clpt.images import exr_files, spectral_exr
from clpt.images.colour.view import View
from clpt.render.film import cryptomatte
from clpt.render.film.denoised_picture import DenoisedPicture
from clpt.render.film.layers import GROUP, matte_names
from clpt.render.film.picture_form import PictureForm
from clpt.render.film.pictures import Pictures
from clpt.scene.layers import LAYERS
from clpt.spectra.spaces import chromaticities

VIEW_LAYER = "ViewLayer."  # what Blender's names begin with
PICTURE = {"clpt": "", "blender": f"{VIEW_LAYER}Combined."}  # before R, G and B of the picture
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

    path: of the file. source: has the picture. names: a set of SETS; "blender" gives names such as
    ViewLayer.Combined.R. metadata: further attributes of the file. The picture is in half floats,
    or its bands in float32, layers in float32. A crop has its place in the whole picture as the
    data window. Raises SceneError.
    """
    source = source._developed()
    layers, form = source.layers(), source._form
    if form.adaptive:
        layers.setdefault("samples", source.samples_per_pixel()[..., None])
    channels = channels_of(layers, names)
    if isinstance(source, DenoisedPicture):
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

    An .exr has its layers and bands, an .npy its numbers: bands where it has those. The rest: see
    `write_layers` and `clpt.write_image`. Raises SceneError.
    """
    suffix, form = path.suffix.lower(), source._form
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

    layers: as `Renderer.layers` returns them; names: a set of SETS, "blender" gives names such as
    ViewLayer.Position.X.
    """
    made: dict[str, Image] = {}
    for name, image in layers.items():
        prefix, form = _prefix(name, names), LAYERS[_owner(name)].form
        if form == "matte":
            blender = names == "blender"
            of_pairs = cryptomatte.SHORT_LETTERS if blender else cryptomatte.LETTERS
            made |= cryptomatte.channels_of(prefix, image, of_pairs)
            continue
        layer = LAYERS[_owner(name)]
        own = layer.exr if names == "clpt" else ()
        for i, letter in enumerate(layer.channels):
            turned = names == "blender" and letter in layer.flipped
            channel = own[i] if own else f"{prefix}.{letter}"
            made[channel] = -image[..., i] if turned else image[..., i]
    return made


def _beside(denoised: DenoisedPicture, names: str) -> dict[str, Image]:
    """The channels of the picture with its noise, and of what is known of errors."""
    made: dict[str, Image] = {}
    for name, picture in denoised.beside.items():
        prefix = VIEW_LAYER + BESIDE[name] if names == "blender" else name
        if picture.ndim == 2:
            made[f"{prefix}.X" if names == "blender" else prefix] = picture
        else:
            made |= {f"{prefix}.{letter}": picture[..., i] for i, letter in enumerate("RGB")}
    return made


def attributes_of(form: PictureForm, names: str = "clpt") -> dict[str, str | float]:
    """Return what an .exr says of a film: stops for screens, the names of mattes of layers."""
    found: dict[str, str | float] = {}
    if form.display_exposure:
        found[images.STOPS] = form.display_exposure
    for name in form.layers:
        if LAYERS[name].form == "matte":
            found |= cryptomatte.attributes_of(_prefix(name, names), matte_names(form, name))
    return found


def _owner(name: str) -> str:
    """The name in LAYERS of a layer."""
    return name if name in LAYERS else "light_groups"


def _prefix(name: str, names: str) -> str:
    """Return the beginning of the names of a layer's channels."""
    layer = LAYERS[_owner(name)]
    if names == "blender":
        group = "" if name in LAYERS else f"_{name.removeprefix(GROUP)}"
        return f"{VIEW_LAYER}{layer.blender}{group}"
    return layer.blender if layer.form == "matte" else name
