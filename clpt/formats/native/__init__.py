"""scene.json: a mirror of the dataclasses of clpt.scene; its schema: scenes/schema.json."""

from clpt.formats.native.read import load
from clpt.formats.native.write import save

__all__ = ["load", "save"]
