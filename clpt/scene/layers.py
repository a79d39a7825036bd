"""Layers: pictures beside the picture, which `Film.layers` names."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from clpt.records import LAYER_SIZES

Form = Literal["near", "long", "id", "light", "matte", "film"]

MATTE_SLOTS = LAYER_SIZES["matte_slots"]  # names that a pixel keeps
MOST_NAMED = (1 << 25) - 2  # what a matte can tell apart, kernels/film/layers.cl
# of a channel, kernels/film/layers.cl
WORDS: dict[Form, int] = {"near": 1, "long": LAYER_SIZES["long_words"], "id": 1}


@dataclass(frozen=True)
class Layer:
    """A picture beside the picture.

    channels: their names in an .exr. form: what is kept of a pixel: means of numbers that are
    "near" 1, or of any size ("long"), over its first 64 samples; the "id" that its first sample has
    met; the "light" of all samples; a "matte": names that its first 64 samples have met, and how
    often; "film": nothing, it is made of the film. blender: its name in Blender, or a name after
    Blender's manner. denoising: of the first surface that is neither a mirror nor smooth glass,
    else of the first. exr: what an .exr calls its channels, where other programs expect names that
    are not the layer's, a dot and `channels`. flipped: the channels whose sign Blender turns.
    """

    channels: str
    blender: str
    form: Form = "near"
    denoising: bool = False
    exr: tuple[str, ...] = ()
    flipped: str = ""

    @property
    def is_colour(self) -> bool:
        return self.channels == "RGB"

    @property
    def words(self) -> int:
        """Words of a pixel that hold its means or its id, see kernels/film/layers.cl."""
        return len(self.channels) * WORDS.get(self.form, 0)


LAYERS = {
    "albedo": Layer("RGB", "Albedo"),
    "shading_normal": Layer("XYZ", "Normal"),
    "geometric_normal": Layer("XYZ", "Geometric Normal"),
    "depth": Layer("Z", "Denoising Depth", "long"),
    "z": Layer("Z", "Depth", "long", exr=("Z",)),
    "position": Layer("XYZ", "Position", "long"),
    "uv": Layer("UV", "UV", "long"),
    "motion": Layer(
        "XYZW",
        "Vector",
        "long",
        exr=("backward.u", "backward.v", "forward.u", "forward.v"),
        flipped="ZW",
    ),
    "shape_id": Layer("X", "IndexOB", "id"),
    "primitive_id": Layer("X", "IndexPrimitive", "id"),
    "material_id": Layer("X", "IndexMA", "id"),
    "denoising_albedo": Layer("RGB", "Denoising Albedo", denoising=True),
    "denoising_normal": Layer("XYZ", "Denoising Normal", denoising=True),
    "direct": Layer("RGB", "Direct", "light"),
    "indirect": Layer("RGB", "Indirect", "light"),
    "light_groups": Layer("RGB", "Combined", "light"),
    "crypto_object": Layer("", "CryptoObject", "matte"),
    "crypto_material": Layer("", "CryptoMaterial", "matte"),
    "samples": Layer("X", "Debug Sample Count", "film"),
    "variance": Layer("RGB", "Variance", "film"),
}
