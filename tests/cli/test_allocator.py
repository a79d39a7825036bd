"""Freed memory goes back; cycles are collected, though not while clpt begins or ends."""

from __future__ import annotations

import platform
import subprocess
import sys

import pytest

PROGRAM = """
import re
import numpy as np
from clpt.cli.process import allocator
allocator.return_large_blocks()
def resident():
    return int(re.search(r"VmRSS:\\s*(\\d+)", open("/proc/self/status").read())[1]) / 1024
for _ in range(3):
    np.ones(30 << 20, np.uint8)  # by itself the library would keep blocks up to this size
before = resident()
blocks = [np.ones(4 << 20, np.uint8) for _ in range(20)]
del blocks[:-1]
print(resident() - before)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only glibc is asked")
def test_blocks_below_one_that_is_kept_are_given_back():
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True
    )
    assert float(done.stdout) < 20.0  # of 80 MiB


REUSED = """
import resource
import numpy as np
from clpt.cli.process import allocator
allocator.return_large_blocks()
def faults():
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(50):
        np.ones(3 << 20, np.uint8)
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before
before = faults()
with allocator.reusing(), allocator.reusing():
    inside = faults()
print(before, inside, faults())
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only glibc is asked")
def test_blocks_are_used_again_while_a_scene_is_prepared():
    done = subprocess.run(
        [sys.executable, "-c", REUSED], capture_output=True, text=True, check=True
    )
    before, inside, after = map(int, done.stdout.split())
    assert 4 * inside < before and 4 * inside < after


CYCLES = """
import gc
from clpt.cli.process import allocator
usual = gc.get_threshold()
class Cycle:
    def __init__(self):
        self.own = self
allocator.collect_later()
before = sum(one["collections"] for one in gc.get_stats())
few = [Cycle() for _ in range(5_000)]
assert sum(one["collections"] for one in gc.get_stats()) == before
many = [Cycle() for _ in range(200_000)]
assert sum(one["collections"] for one in gc.get_stats()) > before
assert gc.get_threshold() == usual and not gc.callbacks
"""


def test_cycles_are_collected_as_usual_once_there_are_many_objects():
    subprocess.run([sys.executable, "-c", CYCLES], check=True)


ENDED = """
import atexit
from clpt.cli.process import allocator
class Told:
    def __init__(self):
        self.own = self
    def __del__(self):
        print("collected")
atexit.register(print, "before")
allocator.collect_later()
cycle = Told()
atexit.register(print, "exit")
"""


def test_no_cycles_are_sought_when_the_process_ends():
    done = subprocess.run([sys.executable, "-c", ENDED], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["exit", "before"]
