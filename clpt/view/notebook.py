"""The widget of a renderer, made where notebooks are installed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from clpt.errors import ClptError

if TYPE_CHECKING:
    from clpt.device import Device
    from clpt.scene import Scene
    from clpt.view.widget import Widget


def widget(scene: Scene, device: Device, **options: Any) -> Widget:
    """Return a widget that shows a scene; options: of its renderer.

    Raises ClptError where clpt[notebook] is not installed.
    """
    try:
        from clpt.view.widget import Widget
    except ImportError as error:
        message = f"a widget needs {error.name}: pip install 'clpt[notebook]'"
        raise ClptError(message) from error
    return Widget(scene, device, **options)
