"""Packages that only some commands need: extras of the installation, imported late."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from ...errors import ClptError


@contextmanager
def extra(name: str, purpose: str) -> Iterator[None]:
    """Guard an import of packages of one of clpt's extras.

    Raises ClptError, which names the extra, where a package is not installed.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package == "clpt":
            raise
        message = f'{purpose} needs {package}: install it by pip install "clpt[{name}]"'
        raise ClptError(message) from error
