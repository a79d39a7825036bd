"""Features: small records of what kernels are asked for, and which materials disperse."""

from __future__ import annotations

import dataclasses
import pickle
from typing import Any

import pytest

from clpt.device import kernels_folder
from clpt.render.records import Features, MaterialFeatures, MediaFeatures, MotionFeatures
from clpt.render.records.macros import macros_of
from clpt.scene import materials
from clpt.scene.params import device_params
from clpt.scene.roles import INDEX

INDICES = [
    (cls, name)
    for cls in materials.LEAVES
    for name, param in device_params(cls).items()
    if param.role is INDEX
]


@pytest.mark.parametrize(
    ("cls", "name"), INDICES, ids=lambda v: v if isinstance(v, str) else v.kind
)
def test_glass_disperses_where_its_index_is_a_table(cls: type, name: str) -> None:
    """Metals, coats and thin sheets have tables too, and send all wavelengths one way."""
    tabulated = frozenset({(cls.kind, name, "table")})
    assert MaterialFeatures((cls,), sources=tabulated).disperses == (cls.refracts or cls.disperses)
    even = frozenset({(cls.kind, name, "constant")})
    assert MaterialFeatures((cls,), sources=even).disperses == cls.disperses
    assert not MaterialFeatures((materials.Diffuse,), sources=tabulated).disperses


@pytest.mark.parametrize("cls", materials.LEAVES, ids=lambda cls: cls.kind)
def test_a_material_that_tells_wavelengths_apart_says_so(cls: type[materials.Material]) -> None:
    """A kind with LOBE_DISPERSE or `pdfs` in its file is one that refracts or disperses."""
    text = (kernels_folder() / f"materials/kinds/{cls.kind}.cl").read_text(encoding="utf-8")
    told = "LOBE_DISPERSE" in text or f"{cls.kind}_pdfs(" in text
    assert told == (cls.refracts or cls.disperses)
    assert cls.chromatic == (f"{cls.kind}_pdfs(" in text)


def records(record: Any) -> dict[str, Any]:
    """The records of features by the names of their classes, with default values."""
    found = {type(record).__name__: record}
    for field in dataclasses.fields(record):
        own = getattr(record, field.name)
        if dataclasses.is_dataclass(own) and not isinstance(own, type):
            found |= records(own)
    return found


def test_records_of_features_are_small_and_of_one_subject() -> None:
    """At most ten fields each; their macros are told apart; they are keys, and travel."""
    found = records(Features())
    assert max(len(dataclasses.fields(record)) for record in found.values()) <= 10
    names = [name for name, _ in macros_of(Features())]
    assert len(names) == len(set(names))
    assert pickle.loads(pickle.dumps(Features())) == Features()
    assert len({Features(), Features(media=MediaFeatures(present=True)), Features()}) == 2


def test_a_macro_is_defined_where_its_field_holds() -> None:
    """A flag where it holds, a number wherever there is one."""
    nothing, moves = (dict(macros_of(MotionFeatures(row=row))) for row in (None, 0))
    assert nothing["MOTION_ROW"] is None and moves["MOTION_ROW"] == 0
    found = dict(macros_of(MotionFeatures(vertices=True)))
    assert found["MOVES_VERTICES"] == 1 and found["MOVES_INSTANCES"] is None
    assert found["MOVES_VERTICES"] is not True, "true is 1 in kernels"
