"""The widget of a renderer where notebooks are not installed."""

from __future__ import annotations

import sys
from typing import Any

import pytest

import clpt
from clpt.view import notebook


def test_without_the_extra_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "anywidget", None)
    monkeypatch.delitem(sys.modules, "clpt.view.widget", raising=False)
    monkeypatch.delattr(sys.modules["clpt.view"], "widget", raising=False)
    unused: Any = None
    with pytest.raises(clpt.ClptError, match="anywidget: pip install"):
        notebook.widget(unused, unused)


def test_a_renderer_has_it() -> None:
    assert clpt.Renderer._make_widget is notebook.widget
    assert clpt.MultiRenderer._make_widget is notebook.widget
