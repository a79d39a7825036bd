"""Features: which materials send each wavelength its own way."""

from __future__ import annotations

import pytest

from clpt.device import kernels_folder
from clpt.render.contract.features import disperses
from clpt.scene import materials
from clpt.scene.params import device_params

INDICES = [
    (cls, name)
    for cls in materials.LEAVES
    for name, param in device_params(cls).items()
    if param.role == "index"
]


@pytest.mark.parametrize(
    ("cls", "name"), INDICES, ids=lambda v: v if isinstance(v, str) else v.kind
)
def test_glass_disperses_where_its_index_is_a_table(cls: type, name: str) -> None:
    """Metals, coats and thin sheets have tables too, and send all wavelengths one way."""
    tabulated = frozenset({(cls.kind, name, "table")})
    assert disperses([cls], tabulated) == (cls.refracts or cls.disperses)
    assert disperses([cls], frozenset({(cls.kind, name, "constant")})) == cls.disperses
    assert not disperses([materials.Diffuse], tabulated)


@pytest.mark.parametrize("cls", materials.LEAVES, ids=lambda cls: cls.kind)
def test_a_material_that_tells_wavelengths_apart_says_so(cls: type[materials.Material]) -> None:
    """A kind with LOBE_DISPERSE or `pdfs` in its file is one that refracts or disperses."""
    text = (kernels_folder() / f"bsdf/{cls.kind}.cl").read_text(encoding="utf-8")
    told = "LOBE_DISPERSE" in text or f"{cls.kind}_pdfs(" in text
    assert told == (cls.refracts or cls.disperses)
    assert cls.chromatic == (f"{cls.kind}_pdfs(" in text)
