"""The list of slow tests names tests that exist, and follows its rules."""

from __future__ import annotations

import re

from tests import slow_tests
from tests.conftest import HERE


def test_each_listed_test_exists() -> None:
    missing = []
    for test in sorted({slow_tests.function(test) for test in slow_tests.listed()}):
        path, *_, name = test.split("::")
        file = HERE.parent / path
        if not (file.exists() and re.search(rf"^ *def {name}\(", file.read_text("utf-8"), re.M)):
            missing.append(test)
    assert not missing, "remove their lines from tests/slow_tests.txt"


def test_the_quickest_case_stays() -> None:
    seconds = {"tests/a.py::f[x]": 3.0, "tests/a.py::f[y]": 1.0, "tests/a.py::f[z]": 0.2}
    assert slow_tests.slow(seconds) == {"tests/a.py::f[x]", "tests/a.py::f[y]"}


def test_long_tests_are_slow_unless_they_are_needed() -> None:
    needed = sorted(slow_tests.NEEDED)[0]
    seconds = {"tests/a.py::f": 3.1, "tests/a.py::g": 2.9, needed: 9.0}
    assert slow_tests.slow(seconds) == {"tests/a.py::f"}


def test_a_kind_is_not_left_out_for_its_siblings() -> None:
    seconds = {"tests/kernels/a.py::f[x]": 3.0, "tests/kernels/a.py::f[y]": 1.0}
    assert not slow_tests.slow(seconds)
