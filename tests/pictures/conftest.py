"""Renderers of these tests share a context, and so the programs that are built there."""

from __future__ import annotations

import pytest


@pytest.fixture(scope="module", autouse=True)
def _shared(one_context: None) -> None:
    """Use the fixture `one_context` in every test."""
