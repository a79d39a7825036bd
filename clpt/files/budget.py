"""Limits of a load in memory, time and parts: readers ask before they take what a file announces.

A file of a few bytes can announce gigabytes. So each reader asks here, before it allocates, and the
whole of a load has one account, which its scene keeps: what is made of the scene until its first
sample draws from it too. What files hold themselves is always allowed, as far as there is memory;
what grows out of little is limited. What is read for a scene of no file has the machine's limit
alone.
"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from clpt.errors import SceneError
from clpt.files import host_memory

FREE, RATIO = 768 << 20, 256  # bytes that a load may take anyway, and for each byte of its files
PARTS, PER_PART = 50_000, 4  # the same of parts: one for so many bytes of its files
PER_REPEAT = 256  # bytes of a file that is read once more, which count as a part
SECONDS = 600.0
SHARE = 2  # of the memory that is available, one part in so many
UNKNOWN = 4 << 30  # bytes, where the system tells nothing
Result = TypeVar("Result")


@dataclass(frozen=True)
class Budget:
    """The most that `clpt.load` may take; None stands for the usual limit.

    memory: [bytes], by default half of what is available, and 768 MiB and 256 bytes for each byte
    of the files read; seconds: 600 by default; parts: elements, shapes, instances and textures, by
    default 50 000 and one for each 4 bytes of the files read, repeated ones counted each time.

    Raises SceneError for a limit that is not above 0.
    """

    memory: int | None = None
    seconds: float | None = None
    parts: int | None = None

    def __post_init__(self) -> None:
        given = {"memory": self.memory, "seconds": self.seconds, "parts": self.parts}
        for name, value in given.items():
            if value is not None and not value > 0:
                raise SceneError(f"a budget's {name} must be above 0, not {value!r}")


@dataclass(eq=False)
class Account:
    """A count of what a load has taken so far, with its limits.

    passing: whether images are given back, as while a scene is made ready to be rendered.
    """

    limits: Budget
    available: int
    alone: bool = False  # of one thing, outside of a load
    began: float = field(default_factory=time.monotonic)
    held: int = 0
    parts: int = 0
    read: int = 0  # bytes of files, each counted once
    files: set[tuple[int, int]] = field(default_factory=set)
    lent: int = 0  # bytes that are soon given back
    spent: float = 0.0  # [s] before it was opened again
    passing: bool = False
    lock: threading.Condition = field(default_factory=threading.Condition)

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name != "lock"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state, lock=threading.Condition())

    def rest(self) -> Account:
        """Return an account of what this one has left."""
        state = self.__getstate__() | {"files": set(self.files), "lent": 0, "passing": True}
        available = _available() + self.held
        return Account(**state | {"began": time.monotonic(), "available": available})

    @property
    def memory(self) -> int:
        """The most bytes that may be held."""
        if self.limits.memory is not None:
            return self.limits.memory
        return self.available if self.alone else min(self.available, FREE + RATIO * self.read)

    @property
    def most_parts(self) -> int:
        """The most parts that there may be."""
        given = self.limits.parts
        return PARTS + self.read // PER_PART if given is None else given


usual = Budget()  # of loads that are given none
_account: ContextVar[Account | None] = ContextVar("account", default=None)


def set_usual(limits: Budget) -> None:
    """Set what loads may take that are given no budget: the command line's."""
    global usual
    usual = limits


@contextmanager
def opened(limits: Budget | None = None) -> Iterator[Account]:
    """Open the account of a load; one inside another has that one's account."""
    account = _account.get()
    if account is not None:
        yield account
        return
    account = Account(usual if limits is None else limits, _available())
    with _drawn_from(account):
        yield account


@contextmanager
def resumed(account: Account | None) -> Iterator[None]:
    """Draw from what a load has left, each time anew: for what is made of its scene.

    account: of the scene; None, or one that is open already, changes nothing.
    """
    if account is None or _account.get() is not None:
        yield
        return
    with _drawn_from(account.rest()):
        yield


@contextmanager
def _drawn_from(account: Account) -> Iterator[None]:
    token = _account.set(account)
    try:
        yield
    finally:
        account.spent += time.monotonic() - account.began
        _account.reset(token)


def carried(function: Callable[..., Result]) -> Callable[..., Result]:
    """Return the function such that it draws from this account in other threads too."""
    account = _account.get()

    def carrying(*arguments: object) -> Result:
        token = _account.set(account)
        try:
            return function(*arguments)
        finally:
            _account.reset(token)

    return carrying


def take(size: int, what: str, file: Path | None = None) -> None:
    """Ask for memory [bytes] that the load keeps. what: a noun phrase, subject of the message.

    Raises SceneError where there is no more of it, or no more time.
    """
    account = _account.get()
    if account is None:
        check(size, what, file)
        return
    with account.lock:
        _check(account, size, what, file)
        account.held += size
    check_time(file)


def take_made(arrays: Iterable[Any], what: str) -> None:
    """Ask for memory of arrays that are made of a scene, None left out. Raises as `take` does.

    The scene of no file, which has no account, has no limit either.
    """
    if _account.get() is not None:
        take(sum(array.nbytes for array in arrays if array is not None), what)


def take_image(size: int, what: str, file: Path | None = None) -> None:
    """Ask for memory [bytes] of an image, which a load keeps. Raises as `take` does."""
    account = _account.get()
    (check if account is not None and account.passing else take)(size, what, file)


def check(size: int, what: str, file: Path | None = None) -> None:
    """Ask for memory [bytes] that is soon given back. Raises as `take` does."""
    account = _account.get()
    if account is None:
        account = Account(usual, _available(), alone=True)
    _check(account, size, what, file)
    check_time(file)


@contextmanager
def lending(size: int, what: str, file: Path | None = None) -> Iterator[None]:
    """Lend memory [bytes] inside, which threads of one load have together; they wait for it.

    Raises as `take` does. What is inside must not ask for any itself.
    """
    check(size, what, file)
    account = _account.get()
    if account is None:
        yield
        return
    with account.lock:
        account.lock.wait_for(
            lambda: not account.lent or account.held + account.lent + size <= account.memory
        )
        account.lent += size
    try:
        yield
    finally:
        with account.lock:
            account.lent -= size
            account.lock.notify_all()


def take_parts(count: int, what: str, file: Path | None = None) -> None:
    """Ask for elements, shapes, instances or textures. Raises as `take` does."""
    account = _account.get()
    if account is None:
        return
    with account.lock:
        account.parts += count
        parts, most = account.parts, account.most_parts
    if parts > most:
        message = f"{what}: more than {most} parts, most of them repeated: {_advice('parts')}"
        raise SceneError(message, file=file)
    check_time(file)


def check_time(file: Path | None = None) -> None:
    """Raise SceneError where the load has no more time."""
    account = _account.get()
    if account is None:
        return
    seconds = SECONDS if account.limits.seconds is None else account.limits.seconds
    if account.spent + time.monotonic() - account.began > seconds:
        message = f"reading the scene takes more than {seconds:g} s: {_advice('seconds')}"
        raise SceneError(message, file=file)


def reads(status: os.stat_result) -> None:
    """Note that a file is read: what it holds itself is allowed, but not once more each time.

    Raises SceneError where the same is read again and again.
    """
    account = _account.get()
    if account is None:
        return
    key = status.st_dev, status.st_ino
    with account.lock:
        again = key in account.files
        if not again:
            account.files.add(key)
            account.read += status.st_size
    if again:
        take_parts(1 + status.st_size // PER_REPEAT, "files are read again and again")


def _check(account: Account, size: int, what: str, file: Path | None) -> None:
    limit = account.memory
    if account.held + size > limit:
        so_far = f", {_shown(account.held)} are taken" if account.held else ""
        message = (
            f"{what} would take {_shown(size)} of memory, the limit is {_shown(limit)}{so_far}"
        )
        raise SceneError(f"{message}: {_advice('memory')}", file=file)


def _advice(what: str) -> str:
    return f"if you trust the file, raise --load-{what} or clpt.Budget({what}=...)"


def _shown(size: int) -> str:
    return f"{size / 2**30:.1f} GiB" if size >= 1 << 29 else f"{size / 2**20:.1f} MiB"


def _available() -> int:
    """Return the share of the memory that is left that one load may have [bytes]."""
    available = host_memory.available()
    return UNKNOWN if available is None else available // SHARE
