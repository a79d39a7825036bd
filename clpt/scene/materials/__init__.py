"""Materials: what a surface does with light. Local frame: z is the shading normal.

A leaf material has a pair kernels/materials/kinds/<kind>.cl. A composite (`two_sided`, `mask`,
`blend`, maps) has none: lowering turns it into rules that choose the leaf of a hit.
"""

from clpt.scene.materials.composites import (
    NO_SURFACE,
    Blend,
    BumpMap,
    Mask,
    NormalMap,
    NormalMapped,
    Null,
    TwoSided,
    parts,
)
from clpt.scene.materials.diffuse import (
    AshikhminShirley,
    Diffuse,
    DiffuseTransmission,
    Fluorescent,
    Measured,
    Merl,
    OrenNayar,
    Phong,
    Ward,
)
from clpt.scene.materials.material import CLEAR, DISTRIBUTIONS, LEAST_ALPHA, Layer, Material
from clpt.scene.materials.principled import GltfSurface, Openpbr, Principled, PrincipledThin
from clpt.scene.materials.specular import (
    CoatedConductor,
    Conductor,
    Dielectric,
    Grating,
    Hair,
    Plastic,
    RoughConductor,
    RoughDielectric,
    RoughPlastic,
    ThinDielectric,
    pigment,
)

LEAVES = (
    Diffuse, OrenNayar, Phong, Ward, AshikhminShirley, Dielectric, ThinDielectric,
    RoughDielectric, Conductor, RoughConductor, Plastic, RoughPlastic, CoatedConductor,
    Principled, PrincipledThin, DiffuseTransmission, GltfSurface, Openpbr, Grating,
    Fluorescent, Hair, Measured, Merl, Null,
)  # fmt: skip
KINDS = (*LEAVES, TwoSided, Mask, Blend, NormalMap, BumpMap)

__all__ = [
    "CLEAR", "DISTRIBUTIONS", "KINDS", "LEAST_ALPHA", "LEAVES", "NO_SURFACE",
    "AshikhminShirley", "Blend", "BumpMap", "CoatedConductor", "Conductor", "Dielectric",
    "Diffuse", "DiffuseTransmission", "Fluorescent", "GltfSurface", "Grating", "Hair",
    "Layer", "Mask", "Material", "Measured", "Merl", "NormalMap", "NormalMapped", "Null",
    "Openpbr", "OrenNayar", "Phong", "Plastic", "Principled", "PrincipledThin",
    "RoughConductor", "RoughDielectric", "RoughPlastic", "ThinDielectric", "TwoSided", "Ward",
    "parts", "pigment",
]  # fmt: skip
