"""What comes from the network can name clpt's tasks, and nothing else."""

from __future__ import annotations

import os
import pickle

import numpy as np
import pytest

pytest.importorskip("distributed")

from clpt.cluster import restricted, tasks


class Evil:
    """Runs a command where it is unpickled."""

    def __reduce__(self):
        return os.system, ("true",)


@pytest.mark.parametrize("name", restricted.TASKS)
def test_tasks_are_known_by_name(name):
    function = getattr(tasks, name)
    assert restricted.loads(pickle.dumps(function)) is function


@pytest.mark.parametrize(
    "value", [Evil(), os.system, eval, getattr, tasks.Store, tasks.dev.choose, pickle.loads, type]
)
def test_other_names_are_refused(value):
    with pytest.raises(pickle.UnpicklingError, match="refused by clpt"):
        restricted.loads(pickle.dumps(value))


def test_a_dotted_name_leads_nowhere():
    """Of an allowed module, what it imports: `clpt.cluster.tasks.dev.choose`."""
    data = b"\x80\x04\x8c\x12clpt.cluster.tasks\x8c\x0adev.choose\x93."
    with pytest.raises(pickle.UnpicklingError, match="refused by clpt"):
        restricted.loads(data)


def test_plain_data_passes():
    value = {"words": np.arange(6, dtype=np.uint32).reshape(2, 3), "x": (1, 2.0, b"b", None, True)}
    buffers: list = []
    data = pickle.dumps(value, protocol=5, buffer_callback=buffers.append)
    found = restricted.loads(data, buffers=buffers)
    assert np.array_equal(found["words"], value["words"])
    assert found["x"] == value["x"]


def test_numbers_of_pickles_that_are_damaged():
    with pytest.raises(pickle.UnpicklingError):
        restricted.loads(b"\x80\x05garbage")
