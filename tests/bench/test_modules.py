"""Every module of `bench` can be imported: what it takes of the package is there."""

from __future__ import annotations

import importlib
from pathlib import Path

import pytest

from bench.python_files import full_name

BENCH = Path(__file__).resolve().parents[2] / "bench"
IN_BLENDER = "bench.in_blender"  # run by a Python that has Blender's modules


def test_all_are_imported() -> None:
    failed = []
    for path in sorted(BENCH.rglob("*.py")):
        name = full_name(path, BENCH.parent)
        if name == IN_BLENDER:
            continue
        try:
            importlib.import_module(name.removesuffix(".__init__"))
        except ImportError as error:
            failed.append(f"{name}: {error}")
    if failed:
        pytest.fail("\n".join(failed), pytrace=False)
