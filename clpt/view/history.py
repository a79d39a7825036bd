"""The steps of a session that can be undone, and done again."""

from __future__ import annotations

from collections import deque
from collections.abc import Hashable
from dataclasses import dataclass

from clpt.scene import Scene
from clpt.view.look import Look

MOST_STEPS = 100


@dataclass(frozen=True)
class State:
    """A scene, and the way in which it is looked at."""

    scene: Scene
    look: Look


class History:
    """States before the present one, and those that undoing has left."""

    def __init__(self) -> None:
        self._past: deque[State] = deque(maxlen=MOST_STEPS)
        self._future: list[State] = []
        self._last: Hashable = None

    def note(self, before: State, by: Hashable = None) -> None:
        """Note the state before a change.

        by: what changed, such as a parameter. Changes of the same one after the other are one step,
        as a slider makes many; None is never the same.
        """
        if by is None or by != self._last:
            self._past.append(before)
        self._future.clear()
        self._last = by

    def back(self, now: State) -> State | None:
        """Return the state before the present one; None where there is none."""
        self._last = None
        if not self._past:
            return None
        self._future.append(now)
        return self._past.pop()

    def forward(self, now: State) -> State | None:
        """Return the state that was undone last; None where there is none."""
        self._last = None
        if not self._future:
            return None
        self._past.append(now)
        return self._future.pop()

    def clear(self) -> None:
        """Forget all: the scene is another one."""
        self._past.clear()
        self._future.clear()
        self._last = None
