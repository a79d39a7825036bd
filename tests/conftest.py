"""Fixtures that every test may use."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent


@pytest.fixture(scope="session")
def assets() -> Path:
    """Third-party test scenes: `shared/assets` beside the checkout, or $CLPT_ASSETS."""
    beside = HERE.parent.parent / "shared" / "assets"
    folder = Path(os.environ.get("CLPT_ASSETS", beside))
    if not folder.is_dir():
        pytest.skip("no shared/assets beside the checkout, and CLPT_ASSETS is not set")
    return folder


@pytest.fixture(scope="session")
def scenes() -> Path:
    """The folder of the small scenes that belong to the tests."""
    return HERE / "scenes"
