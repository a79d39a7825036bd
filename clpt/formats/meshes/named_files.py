"""Files that a mesh names, as programs of other systems write the names."""

from __future__ import annotations

import os
import unicodedata
from pathlib import Path

from clpt.files import input_files


def find(folder: Path, name: str) -> Path | None:
    """Return the file that `name` means in `folder`, None where there is none.

    The name may be quoted; backslashes may precede its blanks and divide its folders. If no name
    matches exactly, a single name that differs in case is taken; for a path of another machine,
    the file of that name in the folder.
    """
    name = name.strip()
    if len(name) > 1 and name[0] == name[-1] and name[0] in "\"'":
        name = name[1:-1].strip()
    for known in dict.fromkeys((name, name.replace("\\ ", " "), name.replace("\\", "/"))):
        if known and (path := _resolved(folder, known)) is not None:
            return input_files.named("mesh", folder, path)
    last = name.replace("\\", "/").rpartition("/")[2]
    path = _resolved(folder, last) if last else None
    return None if path is None else input_files.named("mesh", folder, path)


def _resolved(folder: Path, name: str) -> Path | None:
    try:
        if (folder / name).is_file():
            return folder / name
        here = Path("/") if name.startswith("/") else folder
        for part in [part for part in name.split("/") if part not in ("", ".")]:
            if (here / part).exists():
                here /= part
                continue
            alike = [entry for entry in os.listdir(here) if _folded(entry) == _folded(part)]
            if len(alike) != 1:
                return None
            here /= alike[0]
        return here if here.is_file() else None
    except (OSError, ValueError):  # no folder, or no name of a file
        return None


def _folded(name: str) -> str:
    return unicodedata.normalize("NFC", name).casefold()
