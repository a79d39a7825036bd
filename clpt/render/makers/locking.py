"""Objects on a device: their methods exclude each other, and raise DeviceError after `close`."""

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
        """Whether this thread is within a method of the object."""
        return bool(self._lock._is_owned())  # type: ignore[attr-defined]

    def _check_open(self) -> None:
        """Raise DeviceError after `close`."""
        if self._closed:
            raise self._closed_error()

    def _closed_error(self) -> DeviceError:
        return DeviceError(f"this {type(self).__name__} is closed; make another one")

    def _check(self, inside: bool) -> None:
        """Raise DeviceError if it cannot be used; inside: within a method of the object."""
        self._check_open()

    def _check_healing(self, inside: bool) -> None:
        """Raise DeviceError if `reset` cannot repair it."""
        self._check_open()


def synchronized(
    method: Callable[Concatenate[_S, _P], _R], *, heals: bool = False
) -> Callable[Concatenate[_S, _P], _R]:
    """Return a method that excludes other threads.

    It raises DeviceError after `close`, and for a broken object unless `heals`.
    """

    def locked(self: _S, /, *args: _P.args, **named: _P.kwargs) -> _R:
        inside = self._inside
        with self._lock:
            (self._check_healing if heals else self._check)(inside)
            return method(self, *args, **named)

    functools.update_wrapper(locked, method)
    return locked


def healing(method: Callable[Concatenate[_S, _P], _R]) -> Callable[Concatenate[_S, _P], _R]:
    """Return a synchronized method that repairs a broken object."""
    return synchronized(method, heals=True)


class Stop:
    """A request to stop a run.

    It is a threading.Event without a lock: the handler of a signal that interrupted the holder of
    the lock would wait for ever.
    """

    def __init__(self) -> None:
        self._wanted = False

    def set(self) -> None:
        """Request a stop."""
        self._wanted = True

    def clear(self) -> None:
        """Withdraw the request."""
        self._wanted = False

    def is_set(self) -> bool:
        """Return whether a stop is requested."""
        return self._wanted
