"""KHR_materials_variants: which materials primitives show."""

from __future__ import annotations

from clpt.formats.gltf.document import Document, Element

NAME = "KHR_materials_variants"


def names(document: Document) -> list[str]:
    """Return the names of a file's variants."""
    extension = document.root.extension(NAME)
    found = [] if extension is None else extension.children("variants")
    return [one.text("name", str(i)) for i, one in enumerate(found)]


def chosen(document: Document, wanted: str | None) -> int | None:
    """Return the number of the variant of a name or number; None: the default materials.

    Raises SceneError where there is none of that name.
    """
    if wanted is None:
        return None
    known = names(document)
    for number, name in enumerate(known):
        if wanted in (name, str(number)):
            return number
    message = f"has no material variant {wanted!r}; it has: {', '.join(known) or 'none'}"
    raise document.root.error(message)


def material(primitive: Element) -> Element | None:
    """Return the material that a primitive shows under the document's variant."""
    number, usual = primitive.document.variant, primitive.entry("material", "materials")
    extension = None if number is None else primitive.extension(NAME)
    if extension is None:
        return usual
    for mapping in extension.children("mappings"):
        if number in mapping.numbers("variants", None, ()):
            return mapping.entry("material", "materials") or usual
    return usual
