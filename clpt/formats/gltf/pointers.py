"""KHR_animation_pointer: channels whose target is any number of the file, not only a node's."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.formats.gltf.document import Element

NAME = "KHR_animation_pointer"
OF_NODES = ("translation", "rotation", "scale", "weights")
TABLES = ("materials", "cameras", "meshes", "extensions")  # whose numbers may change
LISTS = ("weights",)  # of which even a single number is a list


def parts(channel: Element) -> list[str]:
    """Return the parts of a channel's pointer (RFC 6901). Raises SceneError where it is none."""
    extension = channel.needed("target").extension(NAME)
    if extension is None:
        raise channel.error(f"a target of the path 'pointer' needs {NAME}", "target")
    text = extension.text("pointer")
    if not text.startswith("/"):
        raise extension.error(f"{text!r} is no JSON pointer: it must begin with '/'", "pointer")
    return [part.replace("~1", "/").replace("~0", "~") for part in text[1:].split("/")]


def node_path(names: list[str]) -> tuple[int, str] | None:
    """Return the node and the path of a pointer that means what other channels mean, or None."""
    if len(names) == 3 and names[0] == "nodes" and names[1].isdigit() and names[2] in OF_NODES:
        return int(names[1]), names[2]
    return None


def put(root: Element, names: list[str], values: NDArray[np.float64]) -> bool:
    """Write values where a pointer points to; return whether there is such a place.

    Objects on the way that the file leaves out, as their numbers are the usual ones, are added. A
    texture that the file leaves out is not, as it needs an image.
    """
    if names[0] not in TABLES or len(names) < 3 or (names[0] == "meshes" and names[2:] != [*LISTS]):
        return False
    at: Any = root.value
    for number, name in enumerate(names[:-1]):
        if name.endswith("Texture") and not (isinstance(at, dict) and name in at):
            return False
        if isinstance(at, dict) and (number > 1 or name in at):
            at = at.setdefault(name, {})
        elif isinstance(at, list) and name.isdigit() and int(name) < len(at):
            at = at[int(name)]
        else:
            return False
    last, single = names[-1], len(values) == 1 and names[-1] not in LISTS
    given: Any = float(values[0]) if single else values.tolist()
    if isinstance(at, list) and last.isdigit() and int(last) < len(at):
        at[int(last)] = given
        return True
    if not isinstance(at, dict) or isinstance(at.get(last), str | dict):
        return False
    at[last] = values[0] > 0.5 if isinstance(at.get(last), bool) else given
    return True
