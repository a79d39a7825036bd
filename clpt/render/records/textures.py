"""Textures: the records of their tables, and their features."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from clpt.records.layout import Record
from clpt.render.records.macros import flag

_COMMON = {
    "kind": ("integer", "position in the table of textures"),
    "to_u": ("vec3", "u of the texture from (u, v, 1) of the surface"),
    "to_v": ("vec3", "and v"),
    "mapping": ("integer", "MAPPING_"),
    "transform": ("integer", "first of twelve words in `textures`: from the world to the mapping"),
}

_SOLID = {
    "kind": _COMMON["kind"],
    "transform": ("integer", "first of twelve words in `textures`: from the world to the texture"),
}

_OCTAVES = {
    "octaves": ("integer", "how many"),
    "roughness": ("real", "how strong each is beside the one before"),
}

_IMAGE = {
    **_COMMON,
    "width": ("integer", "[texels]"),
    "height": ("integer", "[texels]"),
    "first": ("integer", "of its words in `images`"),
    "filter": ("integer", "BITMAP_FILTER_"),
    "wrap_u": ("integer", "BITMAP_WRAP_"),
    "wrap_v": ("integer", "BITMAP_WRAP_"),
    "decode": ("integer", "of 256 words in `images`: what bytes mean"),
}

RECORDS: dict[str, Record] = {
    "bitmap": Record("Bitmap", "An image of floats.", **_IMAGE),
    "packed_bitmap": Record("PackedBitmap", "An image of bytes.", **_IMAGE),
    "checkerboard": Record(
        "Checkerboard",
        "Two colours.",
        **_COMMON,
        color0=("integer", "first of its five words in `textures`"),
        color1=("integer", "first of its five words in `textures`"),
    ),
}

RECORDS["dots"] = Record("Dots", "Round dots.", **_COMMON)

RECORDS["checkers"] = Record("Checkers", "Cubes.", **_SOLID)

RECORDS["noise"] = Record(
    "Noise", "Octaves of noise.", **_SOLID, pattern=("integer", "NOISE_PATTERN_"), **_OCTAVES
)

RECORDS["marble"] = Record(
    "Marble",
    "Marble.",
    **_SOLID,
    **_OCTAVES,
    scale=("real", "how fine it is"),
    variation=("real", "how much the veins are disturbed"),
    colours=("integer", "first of five words of each of nine in `textures`"),
)

RECORDS["voxels"] = Record(
    "Voxels",
    "Values on a grid in a box.",
    **_SOLID,
    nx=("integer", "points along x"),
    ny=("integer", "points along y"),
    nz=("integer", "points along z"),
    first=("integer", "of its words in `images`, x fastest"),
    nearest=("integer", "1: without interpolation"),
    wrap=("integer", "BITMAP_WRAP_"),
)

RECORDS["mesh_attribute"] = Record(
    "MeshAttribute",
    "Values per vertex or face.",
    kind=_COMMON["kind"],
    number=("integer", "its place in the directories of `attributes`"),
    per_face=("integer", "1: a value for each face; 0: for each vertex"),
)

RECORDS["graph"] = Record(
    "Graph",
    "A value that nodes compute.",
    kind=_COMMON["kind"],
    structure=("integer", "number of the function that computes it"),
    first=("integer", "of its constants and of the rows of its textures, in `textures`"),
    channel=("integer", "GRAPH_CHANNEL_"),
    bounded=("integer", "1: a reflectance, in [0, 1]"),
    uplift=("integer", "first of the table in `texels` that makes spectra of colours"),
)

RECORDS["spectral_bitmap"] = Record(
    "SpectralBitmap",
    "An image of spectra.",
    **{**_IMAGE, "first": ("integer", "of its floats in `texels`; `bands` a texel")},
    bands=("integer", "values in a texel"),
    number=("integer", "row in `spectra`: the number of the band by wavelength"),
)

_LEVELS = {
    "levels": ("integer", "how many, that of the image itself among them"),
    "table": ("integer", "first of three words of each in `textures`: first word, width, height"),
}

# kinds of images with smaller copies, by the kind that each level is
MIPS = {"mip_bitmap": "bitmap", "packed_mip_bitmap": "packed_bitmap"}

RECORDS["mip_bitmap"] = Record("MipBitmap", "Levels of floats.", **_IMAGE, **_LEVELS)

RECORDS["packed_mip_bitmap"] = Record("PackedMipBitmap", "Levels of bytes.", **_IMAGE, **_LEVELS)

# images of texels, which are filtered
IMAGES = ("bitmap", "packed_bitmap", "spectral_bitmap", *MIPS)

KINDS = (*(kind for kind in RECORDS if kind not in MIPS), "program", *MIPS)

PROGRAM = KINDS.index("program")


OPERANDS = ("top", "own", "factor", "real", "constant", "number")

OPERATIONS = {"push": 0, "multiply": 8, "mix": 16}

END = 32

ROLES = ("reflectance", "emission", "index", "factor", "real")


# An operand of a node: ("step", number), (a source, perhaps a word), or a run of words: of numbers
# ("words", first, count), or of rows in tables ("rows", first, count).
Operand: TypeAlias = tuple[str | int, ...]


@dataclass(frozen=True)
class GraphNode:
    """A node of a graph, without its numbers.

    operands: of its inputs, in their order; of a texture the words of its rows before the place.
    """

    kind: str
    operands: tuple[Operand, ...]
    settings: tuple[int, ...]
    width: int


@dataclass(frozen=True)
class Structure:
    """A graph without its numbers: kernels have a function for each. Each node has a number."""

    nodes: tuple[GraphNode, ...]
    result: Operand


@dataclass(frozen=True)
class TextureFeatures:
    """The textures of a scene; roles: their (kind, role) pairs, in their order."""

    roles: tuple[tuple[str, str], ...] = ()
    mappings: bool = False  # some texture makes uv of the place
    depth: int = 0  # how many values their programs stack
    graphs: tuple[Structure, ...] = ()  # of the graphs, in the order of their numbers
    attributes: bool = flag("USES_ATTRIBUTES")  # some reads what meshes say per vertex or face

    @property
    def kinds(self) -> tuple[str, ...]:
        """The kinds of textures, in their order."""
        return tuple(sorted({kind for kind, _ in self.roles}))

    @property
    def mips(self) -> bool:
        """Whether some image has smaller copies, which the cones around rays choose."""
        return not MIPS.keys().isdisjoint(self.kinds)
