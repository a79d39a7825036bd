"""The lowest versions of all that clpt needs, as `make test-lowest` installs them."""

from __future__ import annotations

import re

import pytest

from tests import lowest


def test_each_dependency_has_a_lowest_version() -> None:
    found = lowest.lowest(lowest.PROJECT.read_text("utf-8"))
    names = [one.partition("==")[0] for one in found]
    assert {"numpy", "pyopencl", "OpenEXR", "distributed", "blosc"} <= set(names)
    assert len(names) == len(set(names))
    assert all(re.fullmatch(r"[\w-]+==\d[\w.]*", one) for one in found)


def test_a_dependency_without_one_is_told() -> None:
    text = lowest.PROJECT.read_text("utf-8").replace('"numpy>=', '"numpy!=')
    with pytest.raises(ValueError, match="a dependency has no lowest version"):
        lowest.lowest(text)
