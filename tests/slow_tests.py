"""Tests that are slow by what they took: `slow_tests.txt`, beside those with the mark `slow`.

`python -m tests.slow_tests REPORT.xml` writes the list anew from a report of pytest (`--junitxml`)
of a run on two cores without programs in any cache. Slow are, by the clock with three workers:

- tests that took over LONGEST seconds, except NEEDED,
- of the cases of a test those that took over LONGEST_CASE seconds, except the quickest, and except
  those of KINDS, where a case is a kind.

So `make test` shows each property that can be shown in LONGEST seconds, and all properties of each
kind's functions. Tests that the report does not have stay as they were.
"""

from __future__ import annotations

import sys
import xml.etree.ElementTree as ET
from collections import defaultdict
from functools import cache
from pathlib import Path

LIST = Path(__file__).with_suffix(".txt")
LONGEST = 3.0
LONGEST_CASE = 0.4
KINDS = "tests/kernels/"
NEEDED = frozenset(
    {  # each the one quick test of what clpt promises first
        "tests/pictures/device/test_determinism.py::test_who_runs_the_loop_changes_no_bit",
        "tests/pictures/transport/test_caustics.py::test_the_floor_of_a_pool",
        "tests/pictures/transport/test_hybrid.py::test_same_bits_however_samples_are_split",
        "tests/test_house.py::test_figures_only_fall",
        "tests/test_readme.py::test_its_python_runs_from_the_first_line_to_the_last",
    }
)


@cache
def listed() -> frozenset[str]:
    """The ids of the tests that the list names."""
    return frozenset(LIST.read_text(encoding="utf-8").splitlines())


def function(test: str) -> str:
    """A test's id without its parameters."""
    return test.partition("[")[0]


def slow(seconds: dict[str, float]) -> set[str]:
    """Which of these tests are slow. seconds: what each took, by its id."""
    cases: defaultdict[str, list[str]] = defaultdict(list)
    for test in sorted(seconds, key=seconds.__getitem__):
        cases[function(test)].append(test)
    long = {test for test in seconds if seconds[test] > LONGEST and function(test) not in NEEDED}
    others = {test for tests in cases.values() for test in tests[1:] if not test.startswith(KINDS)}
    return long | {test for test in others if seconds[test] > LONGEST_CASE}


def _seconds(report: Path) -> dict[str, float]:
    """What each test of a report took, by its id; without those that were skipped or failed."""
    seconds = {}
    for case in ET.parse(report).getroot().iter("testcase"):
        if not len(case):
            module, _, group = case.attrib["classname"].partition(".Test")
            group = f"::Test{group}" if group else ""
            test = f"{module.replace('.', '/')}.py{group}::{case.attrib['name']}"
            seconds[test] = float(case.attrib["time"])
    return seconds


def _write(report: Path) -> None:
    seconds = _seconds(report)
    before = listed() if LIST.exists() else frozenset()
    tests = slow(seconds) | {test for test in before if test not in seconds}
    LIST.write_text("".join(f"{test}\n" for test in sorted(tests)), encoding="utf-8")
    left = sum(seconds[test] for test in seconds if test not in tests)
    print(f"{len(tests)} slow tests; the others took {left:.0f} of {sum(seconds.values()):.0f} s")


if __name__ == "__main__":
    _write(Path(sys.argv[1]))
