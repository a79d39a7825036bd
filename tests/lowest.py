"""The lowest versions that pyproject.toml allows: prints them as pip takes them.

`make test-lowest` installs them into a folder of their own and tests there.
"""

from __future__ import annotations

import re
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[1] / "pyproject.toml"
EXTRAS = ("colour", "denoise", "cluster", "notebook", "plot", "video", "volumes")  # of users
_LOWEST = re.compile(r'"([\w-]+)(?:\[[\w,]+\])?>=([\w.]+)(?:;[^"]*)?"')


def lowest(text: str) -> list[str]:
    """Return the dependencies of a project's text, those of EXTRAS too, as NAME==VERSION."""
    blocks = [_block(text, "dependencies"), *(_block(text, name) for name in EXTRAS)]
    found = [_LOWEST.findall(block) for block in blocks]
    for block, pairs in zip(blocks, found, strict=True):
        if len(pairs) != len(re.findall(r'"[^"]+"', block)):
            raise ValueError(f"a dependency has no lowest version: {block}")
    return [f"{name}=={version}" for pairs in found for name, version in pairs]


def _block(text: str, name: str) -> str:
    """Return the list of that name."""
    found = re.search(rf"^{name} = \[(.*?)\](?:\s+#[^\n]*)?$", text, re.MULTILINE | re.DOTALL)
    if found is None:
        raise ValueError(f"pyproject.toml has no {name}")
    return re.sub(r"#[^\n]*", "", found[1])


if __name__ == "__main__":
    print(*lowest(PROJECT.read_text("utf-8")))
