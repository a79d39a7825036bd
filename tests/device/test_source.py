"""Assembled text: includes once, names kept, clear errors."""

from __future__ import annotations

import pytest

from clpt.device.source import assemble, kernels_folder
from clpt.errors import KernelBuildError


def test_the_kernels_are_found():
    assert (kernels_folder() / "core").is_dir()


def test_a_kernel_file_is_named_by_its_path():
    source = assemble("root", {"root": '#include "core/lanes.cl"\nint after;'})
    assert source.files[:2] == ("root", "core/lanes.cl")
    assert '#line 1 "kernels/core/lanes.cl"' in source.text
    assert source.text.endswith('#line 2 "root"\nint after;\n')


def test_each_file_once_even_in_a_circle():
    virtual = {"a": '#include "b"\nint a;', "b": '#include "a"\n#include "b"\nint b;'}
    source = assemble("a", virtual)
    assert source.files == ("a", "b")
    assert source.text.count("int a;") == source.text.count("int b;") == 1


def test_lines_are_counted_past_an_include():
    virtual = {"a": 'one\n#include "b"\nthree\n#include "b"\nfive', "b": "x\ny"}
    source = assemble("a", virtual, {"one": 1})
    places = {text: source.place(row) for row, text in enumerate(source.text.splitlines(), 1)}
    assert places["y"] == ("b", 2)
    assert places["three"] == ("a", 3)
    assert places["five"] == ("a", 5)
    assert places["#define one 1"] == (None, None)


def test_defines_come_first_if_the_text_names_them():
    defines = {"N": "K", "K": 3, "M": "uint", "NONE": 0}
    text = assemble("a", {"a": "M x = N;"}, defines).text
    assert text == '#define N K\n#define K 3\n#define M uint\n#line 1 "a"\nM x = N;\n'


def test_a_generated_file_wins_over_one_on_disk():
    virtual = {"a": '#include "core/lanes.cl"', "core/lanes.cl": "mine"}
    assert "mine" in assemble("a", virtual).text


def test_a_missing_include_names_its_place():
    with pytest.raises(KernelBuildError, match=r"no file 'lib/none\.cl'") as raised:
        assemble("a", {"a": '\n#include "lib/none.cl"'})
    assert (raised.value.stage, raised.value.file, raised.value.line) == ("a", "a", 2)


def test_no_include_leaves_the_folder():
    with pytest.raises(KernelBuildError, match="no file"):
        assemble("a", {"a": '#include "../pyproject.toml"'})


def test_an_include_inside_an_if_is_refused():
    with pytest.raises(KernelBuildError, match="stands inside an #if"):
        assemble("a", {"a": '#ifdef X\n#include "b"\n#endif', "b": ""})
