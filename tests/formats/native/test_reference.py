"""The reference of scene.json follows from the dataclasses; each form of a parameter is known."""

from __future__ import annotations

import json
from pathlib import Path
from typing import get_args

import clpt
from clpt import scene
from clpt.formats.native import forms, reference
from clpt.scene import KINDS, integrators, materials
from clpt.scene.params import params, shorthands
from clpt.scene.roles import HostForm

ROOT = Path(__file__).resolve().parents[3]


def test_the_page_is_up_to_date():
    assert (ROOT / "docs" / "scene_format.md").read_text("utf-8") == reference.text(), (
        "run python -m clpt.formats.native.reference"
    )


def test_every_form_is_read_and_written():
    """The table has all forms; every host parameter of ours has one; none is left over."""
    classes = [cls for of_category in KINDS.values() for cls in of_category]
    declared = [
        (cls, name, param)
        for cls in (*classes, integrators.Film, materials.Layer)
        for name, param in {**params(cls), **shorthands(cls)}.items()
    ]
    assert set(get_args(HostForm)) < forms.FORMS.keys()
    assert not [(cls, name) for cls, name, p in declared if p.role.name == "host"]
    unused = forms.FORMS.keys() - {param.role.name for *_, param in declared}
    assert unused <= {"host", "numbers"}, "only a kind of a user's own may need these"


def test_every_kind_and_parameter_is_in_the_reference():
    page = reference.text()
    for classes in KINDS.values():
        for cls in classes:
            section = page.split(f"### `{cls.kind}`\n")[1].split("\n## ")[0].split("\n### ")[0]
            assert all(f"| `{name}` |" in section for name in params(cls))
            assert all(f"| `{name}` |" in section for name in shorthands(cls))


def test_examples_say_the_same_in_json_and_python():
    modules = {name: getattr(scene, name) for name in scene.__all__}
    shown = 0
    for classes in KINDS.values():
        for cls in classes:
            for text, code in reference.example(cls):
                given = json.loads(text)
                assert given.pop("type") == cls.kind
                lists = {n: tuple(v) if isinstance(v, list) else v for n, v in given.items()}
                assert repr(eval(code, modules)) == repr(cls(**lists))
                shown += 1
    assert shown > 60


def test_examples_in_xml_say_the_same(tmp_path):
    """Mitsuba's reader takes them for what the example in Python makes."""
    modules = {name: getattr(scene, name) for name in scene.__all__}
    for cls, tag in reference.MITSUBA.items():
        element, ((_, code),) = reference.xml(cls), reference.example(cls)
        if tag == "texture":
            named = element.replace("<texture", '<texture name="reflectance"')
            element = f'<bsdf type="diffuse">{named}</bsdf>'
        inside = f'<shape type="sphere">{element}</shape>'
        file = tmp_path / "scene.xml"
        file.write_text(
            f'<scene version="3.0.0"><sensor type="perspective"/>{inside}</scene>', "utf-8"
        )
        read = clpt.load(file).shapes[0].material
        read = read.reflectance if tag == "texture" else read
        assert repr(read) == repr(eval(code, modules)), element
