"""EXT_meshopt_compression and KHR_meshopt_compression: a buffer view that is stored smaller."""

from __future__ import annotations

from clpt.formats.gltf.document import Element

EXTENSIONS = ("KHR_meshopt_compression", "EXT_meshopt_compression")


def extension(view: Element) -> Element | None:
    """Return the element that says how a buffer view is compressed, or None."""
    return next((e for e in map(view.extension, EXTENSIONS) if e is not None), None)


def decode(element: Element, data: memoryview) -> bytes:
    """Return the bytes of a compressed buffer view."""
    raise element.error("is compressed by meshopt, which is not supported")
