"""The contents of a renderer's film as a single value, and the lock around its methods.

A single assignment replaces the contents.

An exception can come at any line: Ctrl-C raises it wherever the main thread is. So while a film
changes, a `Change` replaces its `Contents`. The last assignment of a change sets the new contents.
An error before that leaves the film as it was, or `finish` brings it to a known state. If that
fails too, the change stays, and the renderer says that it is broken.
"""

from __future__ import annotations

import datetime
import functools
import logging
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from types import TracebackType
from typing import NoReturn, TypeVar, cast

from clpt.device import Device, forking
from clpt.errors import DeviceError
from clpt.render.film.film_file import Session
from clpt.render.film.state import Ranges
from clpt.render.wavefront.adaptive import Adaptive

_Method = TypeVar("_Method", bound=Callable[..., object])

log = logging.getLogger(__name__)

LONGEST = 120  # letters of an error within the message of another error


def _now() -> str:
    return datetime.datetime.now(datetime.timezone.utc).isoformat(timespec="seconds")


@dataclass(frozen=True, eq=False)
class Contents:
    """The contents of a film: its samples, and the sessions that rendered them.

    taken: first and end of each range of numbers of samples; adaptive: state of adaptive sampling;
    sessions: former sessions; began: when this session began, ISO 8601 in UTC.
    """

    taken: Ranges = ()
    adaptive: Adaptive | None = None
    sessions: tuple[Session, ...] = ()
    began: str = field(default_factory=_now)


Settle = Callable[[BaseException | None], Contents]  # ends a change; see `FilmOwner._change`


class Change:
    """A change of a film, as a context manager; see `FilmOwner._change`."""

    def __init__(
        self,
        owner: FilmOwner,
        name: str,
        former: Contents,
        finish: Settle | None,
        heals: bool,
    ):
        self._owner, self._name, self.former = owner, name, former
        self.heals, self._finish = heals, finish
        self._began = finish is not None
        self._cause = ""  # a text: an exception would keep all objects of its traceback
        self.over = False

    def begin(self) -> None:
        """Note that the film differs from its former contents from now on."""
        self._began = True

    @contextmanager
    def beginning_unless(self, *refusals: type[BaseException]) -> Iterator[None]:
        """Begin, unless an error of these types ends the block: then nothing has changed."""
        self.begin()
        try:
            yield
        except refusals:
            self._began = False
            raise

    def __enter__(self) -> Change:
        self._owner._contents = self
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._owner._contents is not self:
            return
        if not self._began:
            self._owner._contents = self.former
            return
        self.over = True
        if error is not None:
            words = " ".join(str(error).split())[:LONGEST]
            self._cause = f" by {type(error).__name__}" + (f" ({words})" if words else "")
        if self._finish is None or error is None:
            return
        try:
            self._owner._contents = self._finish(error)
        except Exception as other:
            log.warning("%s: %s", self.failure(), other)

    def failure(self) -> DeviceError:
        """Return the error for every use after a change that did not end."""
        owner = type(self._owner).__name__
        advice = "reset it or make another one" if self.heals else "make another one"
        return DeviceError(
            f"this {owner} is broken: its {self._name} was stopped{self._cause}; {advice}"
        )

    def unfinished(self) -> DeviceError:
        """Return the error for a callback within a change that reads the new contents."""
        return DeviceError(
            f"the film changes: {self._name} calls this; end it first, as by returning False"
        )


class FilmOwner:
    """Base of renderers, which own the contents of a film.

    Their `synchronized` methods exclude each other, and raise DeviceError after `close`.
    """

    def __init__(self) -> None:
        self._lock = forking.renewed(threading.RLock())  # a callback may call back
        self._closed = False
        self._contents: Contents | Change = Contents()

    def __reduce__(self) -> NoReturn:
        raise TypeError(
            f"a {type(self).__name__} is on its device and can be neither pickled nor copied; "
            "pickle its scene and make another one of it"
        )

    @property
    def _inside(self) -> bool:
        """Whether this thread is within a method of the object."""
        return bool(self._lock._is_owned())  # type: ignore[attr-defined]

    def _closed_error(self) -> DeviceError:
        return DeviceError(f"this {type(self).__name__} is closed; make another one")

    @property
    def _settled(self) -> Contents:
        """The contents of the film. Raises DeviceError while they change."""
        if isinstance(self._contents, Change):
            raise self._contents.unfinished()
        return self._contents

    @property
    def _known(self) -> Contents:
        """The contents of the film; during a change, the former contents."""
        now = self._contents
        if not isinstance(now, Change):
            return now
        if now.over:
            raise now.failure()
        return now.former

    def _change(
        self,
        name: str,
        finish: Settle | None = None,
        *,
        heals: bool = True,
    ) -> Change:
        """Return a change for a `with` block, whose last line sets the new contents.

        name: of the change, for people. finish: makes the film whole after an error, its argument,
        and returns the contents; without it the film is unchanged until `Change.begin`. heals:
        whether `reset` repairs the renderer if `finish` fails. Raises DeviceError within a change.
        """
        return Change(self, name, self._settled, finish, heals)

    def _healing(self, name: str, finish: Settle) -> Change:
        """Return a change as `_change` does, also for a broken renderer."""
        now = self._contents
        former = now.former if isinstance(now, Change) else now
        return Change(self, name, former, finish, heals=True)

    def _check_healing(self, inside: bool) -> None:
        """Raise DeviceError if `reset` cannot repair it."""
        self._check_open()
        if isinstance(self._contents, Change):
            if inside:
                raise self._contents.unfinished()
            if not self._contents.heals:
                raise self._contents.failure()

    @property
    def devices(self) -> tuple[Device, ...]:
        """The devices that render."""
        raise NotImplementedError

    def _check_open(self) -> None:
        """Raise DeviceError after `close`, and in a forked process."""
        if self._closed:
            raise self._closed_error()
        for device in self.devices:
            forking.check(device.queue)

    def _check(self, inside: bool) -> None:
        """Raise DeviceError if it cannot be used; inside: within a method of the object."""
        self._check_open()
        if isinstance(self._contents, Change) and not inside:
            raise self._contents.failure()


def synchronized(method: _Method, *, heals: bool = False) -> _Method:
    """Return a method that excludes other threads.

    It raises DeviceError after `close`, and for a broken object unless `heals`.
    """

    def locked(self: FilmOwner, /, *args: object, **named: object) -> object:
        inside = self._inside
        with self._lock:
            (self._check_healing if heals else self._check)(inside)
            return method(self, *args, **named)

    functools.update_wrapper(locked, method)
    return cast(_Method, locked)


def healing(method: _Method) -> _Method:
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
