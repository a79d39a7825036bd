"""Base of the parts of a scene file: errors about them name the file, the line and the part."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from clpt.errors import SceneError


class Located(ABC):
    """A part of a file that errors can name."""

    @abstractmethod
    def location(self) -> dict[str, Any]:
        """Return `file`, `line` and `where`, as SceneError takes them."""

    def error(self, message: str) -> SceneError:
        """Return an error that says `message` about this part."""
        return SceneError(message, **self.location())

    @contextmanager
    def locating(self) -> Iterator[None]:
        """Give errors that name no file this location."""
        try:
            yield
        except SceneError as error:
            if error.file is not None:
                raise
            raise self.relocated(error) from None

    def relocated(self, error: SceneError) -> SceneError:
        """Return an error at this location; what `error` named is kept in the message."""
        return self.error(f"{error.where}: {error.message}" if error.where else error.message)
