"""What a host program hears of clpt: nothing until it asks, and then what took time."""

from __future__ import annotations

import logging
import subprocess
import sys

from clpt import bvh
from clpt.device import Device, assemble, build_all, choose


def test_devices_programs_and_trees_are_told(caplog) -> None:
    caplog.set_level(logging.INFO, "clpt")
    on = Device.adopt(choose().queue)
    text = "kernel void nothing(global int *x) { x[0] = 1; }"
    for _ in range(2):
        build_all(on, {"nothing": assemble("nothing.cl", {"nothing.cl": text})})
    bvh.build(on, [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    said = [record.getMessage() for record in caplog.records]
    assert {record.name.split(".")[0] for record in caplog.records} == {"clpt"}
    assert any(on.info.label in text for text in said)
    assert [text.startswith("programs: 1 in") for text in said].count(True) == 2
    assert any("brute tree over 1 triangles in" in text for text in said)


QUIET = """
import logging, random, signal, sys, warnings
import numpy as np, pyopencl as cl
before = list(warnings.filters), signal.getsignal(signal.SIGINT), logging.root.level
np.random.seed(1), random.seed(1)
drawn = np.random.random(), random.random()
np.random.seed(1), random.seed(1)
import clpt
from clpt.device import choosing
logging.getLogger("clpt.device").warning("not heard")
assert drawn == (np.random.random(), random.random())
after = list(warnings.filters), signal.getsignal(signal.SIGINT), logging.root.level
assert before[1:] == after[1:]
assert not [f for f in after[0] if f not in before[0]]
"""


def test_importing_changes_nothing() -> None:
    """No filter of warnings, signal, level or seed, and no word."""
    done = subprocess.run([sys.executable, "-c", QUIET], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout == done.stderr == ""
