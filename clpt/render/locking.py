"""Who may use a renderer when: one thread after the other, and nobody once it is closed."""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable
from typing import Concatenate, NoReturn, ParamSpec, TypeVar

from clpt.errors import DeviceError

_P = ParamSpec("_P")
_R = TypeVar("_R")
_S = TypeVar("_S", bound="DeviceOwner")


class DeviceOwner:
    """Base of what lives on a device: its methods marked by `alone` exclude each other."""

    def __init__(self) -> None:
        self._lock = threading.RLock()  # a callback may call back
        self._closed = False

    def __reduce__(self) -> NoReturn:
        raise TypeError(
            f"a {type(self).__name__} lives on its device and can be neither pickled nor copied; "
            "pickle its scene and make another one of it"
        )


def synchronized(method: Callable[Concatenate[_S, _P], _R]) -> Callable[Concatenate[_S, _P], _R]:
    """A method that runs by itself: other threads wait. It raises DeviceError after `close`."""

    def in_turn(self: _S, /, *args: _P.args, **named: _P.kwargs) -> _R:
        with self._lock:
            if self._closed:
                raise DeviceError(f"this {type(self).__name__} is closed; make another one")
            return method(self, *args, **named)

    functools.update_wrapper(in_turn, method)
    return in_turn
