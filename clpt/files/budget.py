"""Limits of a load in memory, time and parts: readers ask before they take what a file announces.

A file of a few bytes can announce gigabytes. So each reader asks here before it allocates. A load
has an account. The scene keeps it, and the preparation of the scene for its first sample draws
from the same account. The contents of files are always allowed while there is memory; data that a
small file expands to is limited. A scene without a file has the limit of the machine alone.

Whatever takes time consists of steps that many scenes share. Each reports by `check_time`: the
fields of an object are read, a shape is placed, a spectrum is evaluated, words are appended to a
table, a lowering is looked up, a level of a tree or of an image is made. So a preparation ends soon
after its time is spent, whatever the scene has many of.
"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

from clpt.errors import SceneError

FREE, RATIO = 768 << 20, 256  # bytes that a load may take anyway, and for each byte of its files
PARTS, PER_PART = (
    50_000,
    4,
)  # parts that a load may have anyway, and bytes of its files for each further part
PER_REPEAT = 256  # a file that is read again counts as a part for each so many bytes
SECONDS = 600.0
SHARE = 2  # a load may take the available memory divided by this
UNKNOWN = 4 << 30  # bytes, if the system does not tell
Function = TypeVar("Function", bound=Callable[..., object])
T = TypeVar("T")
# Files of a control group, versions 2 and 1: the limit, what is used, and the pages of files that
# nobody has used of late. These count as used, but the kernel gives them up first.
_CGROUPS = (
    ("memory.max", "memory.current", "inactive_file"),
    ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"),
)


@dataclass(frozen=True)
class Budget:
    """The most that `clpt.load` may take; None stands for the usual limit.

    memory: [bytes], by default half of the available memory, at most 768 MiB and 256 bytes for each
    byte of the files; seconds: 600 by default; parts: elements, shapes, instances and textures, by
    default 50 000 and another for each 4 bytes of the files. A repeated part counts each time.

    Raises SceneError for a limit that is not above 0.
    """

    memory: int | None = None
    seconds: float | None = None
    parts: int | None = None

    def __post_init__(self) -> None:
        limits = {"memory": self.memory, "seconds": self.seconds, "parts": self.parts}
        for name, value in limits.items():
            if value is not None and not value > 0:
                raise SceneError(f"a budget's {name} must be above 0, not {value!r}")


@dataclass(eq=False)
class Account:
    """Memory, time and parts that a load has taken so far, with its limits.

    passing: whether images are freed after use, as while a scene is prepared for rendering.
    """

    limits: Budget
    available: int
    alone: bool = False  # for a single request outside a load
    began: float = field(default_factory=time.monotonic)
    held: int = 0
    parts: int = 0
    read: int = 0  # bytes of files, each counted once
    files: set[tuple[int, int]] = field(default_factory=set)
    lent: int = 0  # bytes that are soon freed
    spent: float = 0.0  # [s] before it was opened again
    passing: bool = False
    lock: threading.Condition = field(default_factory=threading.Condition)

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name != "lock"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state, lock=threading.Condition())

    def remaining(self) -> Account:
        """Return an account with the memory, time and parts that this account has left."""
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
        parts = self.limits.parts
        return PARTS + self.read // PER_PART if parts is None else parts


usual = Budget()  # of loads without a budget
_account: ContextVar[Account | None] = ContextVar("account", default=None)


def set_usual(limits: Budget) -> None:
    """Set the limits of loads without a budget, as the command line does."""
    global usual
    usual = limits


@contextmanager
def opened(limits: Budget | None = None) -> Iterator[Account]:
    """Open the account of a load; a load inside another shares its account."""
    account = _account.get()
    if account is not None:
        yield account
        return
    account = Account(usual if limits is None else limits, _available())
    with _drawn_from(account):
        yield account


@contextmanager
def resumed(account: Account | None) -> Iterator[None]:
    """Draw from the remainder of a load's account while its scene is prepared.

    account: of the scene. If it is None, or an account is open already, nothing changes.
    """
    if account is None or _account.get() is not None:
        yield
        return
    with _drawn_from(account.remaining()):
        yield


@contextmanager
def _drawn_from(account: Account) -> Iterator[None]:
    token = _account.set(account)
    try:
        yield
    finally:
        account.spent += time.monotonic() - account.began
        _account.reset(token)


def carried(function: Function) -> Function:
    """Return the function such that it draws from this account in other threads too."""
    account = _account.get()

    def carrying(*arguments: object) -> object:
        token = _account.set(account)
        try:
            return function(*arguments)
        finally:
            _account.reset(token)

    return cast(Function, carrying)


def take(size: int, subject: str, file: Path | None = None) -> None:
    """Ask for memory [bytes] that the load keeps. subject: of the message, a noun phrase.

    Raises SceneError if the memory or the time of the load is spent.
    """
    account = _account.get()
    if account is None:
        check(size, subject, file)
        return
    with account.lock:
        _check(account, size, subject, file)
        account.held += size
    check_time(file)


def take_arrays(arrays: Iterable[Any], subject: str) -> None:
    """Ask for the memory of arrays computed from a scene; None takes none. Raises as `take` does.

    A scene without a file has no account and no limit.
    """
    if _account.get() is not None:
        take(sum(array.nbytes for array in arrays if array is not None), subject)


def take_image(size: int, subject: str, file: Path | None = None) -> None:
    """Ask for memory [bytes] of an image that a load keeps. Raises as `take` does."""
    account = _account.get()
    (check if account is not None and account.passing else take)(size, subject, file)


def check(size: int, subject: str, file: Path | None = None) -> None:
    """Ask for memory [bytes] that is soon freed. Raises as `take` does."""
    account = _account.get()
    if account is None:
        account = Account(usual, _available(), alone=True)
    _check(account, size, subject, file)
    check_time(file)


@contextmanager
def lending(size: int, subject: str, file: Path | None = None) -> Iterator[None]:
    """Lend memory [bytes] to the block. Threads of a load share their memory and wait for it.

    Raises as `take` does. The block must not ask for memory itself.
    """
    check(size, subject, file)
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


def take_parts(count: int, subject: str, file: Path | None = None) -> None:
    """Ask for elements, shapes, instances or textures. Raises as `take` does."""
    account = _account.get()
    if account is None:
        return
    with account.lock:
        account.parts += count
        parts, most = account.parts, account.most_parts
    if parts > most:
        message = f"{subject}: more than {most} parts, most of them repeated: {_advice('parts')}"
        raise SceneError(message, file=file)
    check_time(file)


def check_time(file: Path | None = None) -> None:
    """Raise SceneError if the time of the load is spent."""
    account = _account.get()
    if account is None:
        return
    seconds = SECONDS if account.limits.seconds is None else account.limits.seconds
    if account.spent + time.monotonic() - account.began > seconds:
        message = f"reading the scene takes more than {seconds:g} s: {_advice('seconds')}"
        raise SceneError(message, file=file)


def steps(members: Iterable[T]) -> Iterator[T]:
    """Yield the members of a long list; each is a step. Raises as `check_time` does."""
    for member in members:
        check_time()
        yield member


def reads(status: os.stat_result) -> None:
    """Note that a file is read. Its size raises the limits once, not for each reading.

    Raises SceneError if a file is read again and again.
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


def _check(account: Account, size: int, subject: str, file: Path | None) -> None:
    limit = account.memory
    if account.held + size > limit:
        so_far = f", {_shown(account.held)} are taken" if account.held else ""
        message = (
            f"{subject} would take {_shown(size)} of memory, the limit is {_shown(limit)}{so_far}"
        )
        raise SceneError(f"{message}: {_advice('memory')}", file=file)


def _advice(resource: str) -> str:
    return f"if you trust the file, raise --load-{resource} or clpt.Budget({resource}=...)"


def _shown(size: int) -> str:
    return f"{size / 2**30:.1f} GiB" if size >= 1 << 29 else f"{size / 2**20:.1f} MiB"


def _available() -> int:
    """Return how much of the free memory a load may take [bytes]."""
    available = free_memory()
    return UNKNOWN if available is None else available // SHARE


def free_memory(
    root: Path = Path("/sys/fs/cgroup"), membership: Path = Path("/proc/self/cgroup")
) -> int | None:
    """Return the host memory left to this process [bytes]; None where the system does not tell.

    The limits of the process's control group and of all groups that hold it count too, as does
    `ulimit -v`. root: the folder of all groups; membership: the file that names the process's.
    """
    amounts = []
    try:
        for row in Path("/proc/meminfo").read_text().splitlines():
            if row.startswith("MemAvailable:"):
                amounts.append(int(row.split()[1]) * 1024)
    except OSError:
        pass
    try:
        rows = membership.read_text()
    except OSError:
        rows = ""
    for limit, usage, stat, inactive in _limits(root, rows):
        try:
            left = int(limit.read_text()) - int(usage.read_text())
            known = dict(row.split() for row in stat.read_text().splitlines())
            amounts.append(left + int(known.get(inactive, 0)))
        except (OSError, ValueError):  # the limit is "max"
            continue
    amounts += _of_process()
    return max(0, min(amounts)) if amounts else None


@cache
def _limits(root: Path, rows: str) -> list[tuple[Path, Path, Path, str]]:
    """Return the files with limits: of the process's control group and of all that hold it.

    A row is ID:CONTROLLERS:PATH, without controllers in version 2. In version 1 those of memory
    stand in a folder of their own, which has the name of the controllers that share it. Each tuple
    is a row of `_CGROUPS`, with the file that counts its pages.
    """
    groups = {root, root / "memory"}
    for row in rows.splitlines():
        _, controllers, path = row.split(":", 2)
        if controllers and "memory" not in controllers.split(","):
            continue
        for tree in {root / controllers, root / "memory"} if controllers else {root}:
            group = tree / path.lstrip("/")
            groups |= {group, *(parent for parent in group.parents if parent.is_relative_to(tree))}
    return [
        (group / limit, group / usage, group / "memory.stat", inactive)
        for group in groups
        for limit, usage, inactive in _CGROUPS
        if os.path.exists(group / limit)
    ]


def _of_process() -> list[int]:
    """Return the addresses that `ulimit -v` leaves to the process [bytes], if there is a limit."""
    try:
        import resource  # not on Windows

        most, _ = resource.getrlimit(resource.RLIMIT_AS)
        if most == resource.RLIM_INFINITY:
            return []
        pages = int(Path("/proc/self/statm").read_text().split()[0])
        return [most - pages * os.sysconf("SC_PAGE_SIZE")]
    except (ImportError, OSError, ValueError):
        return []
