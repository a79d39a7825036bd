"""Plans: changes of the scene on a device that are prepared, but not yet written."""

from __future__ import annotations

from abc import ABC, abstractmethod


class Plan(ABC):
    """A prepared change of a scene on its device; the change happens when it is written.

    refusals: errors of `write` after which nothing has changed.
    """

    refusals: tuple[type[BaseException], ...] = ()

    @property
    def repeatable(self) -> bool:
        """Whether `write` may be called again after an error."""
        return True

    @abstractmethod
    def write(self) -> None:
        """Enqueue the change. The picture is then of another scene, from its first sample on."""
