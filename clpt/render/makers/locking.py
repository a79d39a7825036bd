"""Objects on a device that one thread at a time may use, and none once they are closed."""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable
from typing import Concatenate, NoReturn, ParamSpec, TypeVar

from clpt.device import forking
from clpt.errors import DeviceError

_P = ParamSpec("_P")
_R = TypeVar("_R")
_S = TypeVar("_S", bound="DeviceOwner")


class DeviceOwner:
    """Base of objects on a device, whose `synchronized` methods exclude each other."""

    def __init__(self) -> None:
        self._lock = forking.renewed(threading.RLock())  # a callback may call back
        self._closed = False

    def __reduce__(self) -> NoReturn:
        raise TypeError(
            f"a {type(self).__name__} is on its device and can be neither pickled nor copied; "
            "pickle its scene and make another one of it"
        )

    @property
    def _inside(self) -> bool:
        """Whether this thread is in a method: who asks is called by it."""
        return bool(self._lock._is_owned())  # type: ignore[attr-defined]

    def _check_open(self) -> None:
        """Raise DeviceError after `close`."""
        if self._closed:
            raise self._closed_error()

    def _closed_error(self) -> DeviceError:
        return DeviceError(f"this {type(self).__name__} is closed; make another one")

    def _check(self, inside: bool) -> None:
        """Raise DeviceError where it cannot be used; inside: by what one of its methods calls."""
        self._check_open()

    def _check_healing(self, inside: bool) -> None:
        """Raise DeviceError where it cannot be made whole."""
        self._check_open()


def synchronized(
    method: Callable[Concatenate[_S, _P], _R], *, heals: bool = False
) -> Callable[Concatenate[_S, _P], _R]:
    """Return a method for one thread at a time; it raises DeviceError after `close`, and where the
    object is broken, unless it heals that."""

    def locked(self: _S, /, *args: _P.args, **named: _P.kwargs) -> _R:
        inside = self._inside
        with self._lock:
            (self._check_healing if heals else self._check)(inside)
            return method(self, *args, **named)

    functools.update_wrapper(locked, method)
    return locked


def healing(method: Callable[Concatenate[_S, _P], _R]) -> Callable[Concatenate[_S, _P], _R]:
    """Return a method as `synchronized` does, which makes what is broken whole again."""
    return synchronized(method, heals=True)


class Stop:
    """Whether what is being done is to stop.

    As threading.Event, but without a lock: a signal's handler would wait for ever where it has
    interrupted who holds it.
    """

    def __init__(self) -> None:
        self._wanted = False

    def set(self) -> None:
        """Let it stop."""
        self._wanted = True

    def clear(self) -> None:
        """Let it go on."""
        self._wanted = False

    def is_set(self) -> bool:
        """Return whether a stop is wanted."""
        return self._wanted
