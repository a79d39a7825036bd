"""Options `-D NAME=VALUE`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import click


def variables(defines: Iterable[str]) -> dict[str, Any]:
    """Return NAME=VALUE options as a dictionary. Raises click.BadParameter."""
    pairs = [define.partition("=") for define in defines]
    wrong = next((name for name, equals, _ in pairs if not (name and equals)), None)
    if wrong is not None:
        raise click.BadParameter(f"{wrong!r} does not look like NAME=VALUE", param_hint="-D")
    if any(name == "progress" for name, _, _ in pairs):
        raise click.BadParameter("no variable can be called progress", param_hint="-D")
    return {name: value for name, _, value in pairs}
