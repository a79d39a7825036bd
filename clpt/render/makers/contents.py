"""Contents of a film with what its renderer says of it: one value, which changes at one point.

An exception can come at any line: Ctrl-C raises one wherever the main thread is. So while a film
changes, a `Change` stands in the place of its `Contents`. The new ones take its place by one
assignment, the last thing of all. What ends before that leaves the film as it was, or brings it to
a state with a name; where neither works the change stays, and the renderer says that it is broken.
"""

from __future__ import annotations

import datetime
import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from types import TracebackType

from clpt.device import Device, forking
from clpt.errors import DeviceError
from clpt.render.film.saved_film import Session
from clpt.render.film.state import Ranges
from clpt.render.makers.locking import DeviceOwner
from clpt.render.wavefront.adaptive import Adaptive

log = logging.getLogger(__name__)

LONGEST = 120  # letters of an error that another one quotes


def _now() -> str:
    return datetime.datetime.now(datetime.timezone.utc).isoformat(timespec="seconds")


@dataclass(frozen=True, eq=False)
class Contents:
    """The contents of a film: which samples it holds, and how they came to be.

    taken: first and end of each range of its samples' numbers; adaptive: which pixels get more;
    sessions: of those who rendered it before; began: when it was empty, or was gone on with.
    """

    taken: Ranges = ()
    adaptive: Adaptive | None = None
    sessions: tuple[Session, ...] = ()
    began: str = field(default_factory=_now)


class Change:
    """A change of a film that is not over, for a `with`; see `FilmOwner.change`."""

    def __init__(
        self,
        owner: FilmOwner,
        what: str,
        former: Contents,
        finish: Callable[[BaseException], Contents] | None,
        heals: bool,
    ):
        self._owner, self._what, self.former = owner, what, former
        self.heals, self._finish = heals, finish
        self._began = finish is not None
        self._cause = ""  # no exception: that would keep all that its traceback refers to
        self.over = False

    def begin(self) -> None:
        """Note that from now on the film is not what it was."""
        self._began = True

    @contextmanager
    def beginning_unless(self, *refusals: type[BaseException]) -> Iterator[None]:
        """Begin with what is inside, unless one of these ends it: nothing has changed then."""
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
        """The error of every use after a change that did not end."""
        name = type(self._owner).__name__
        advice = "reset it or make another one" if self.heals else "make another one"
        return DeviceError(
            f"this {name} is broken: its {self._what} was stopped{self._cause}; {advice}"
        )

    def unfinished(self) -> DeviceError:
        """The error of who is called by a change, and asks what it will bring."""
        return DeviceError(
            f"the film changes: {self._what} calls this; end it first, as by returning False"
        )


class FilmOwner(DeviceOwner):
    """Base of renderers: what their film holds."""

    def __init__(self) -> None:
        super().__init__()
        self._contents: Contents | Change = Contents()

    @property
    def _settled(self) -> Contents:
        """The contents of the film. Raises DeviceError while they change."""
        if isinstance(self._contents, Change):
            raise self._contents.unfinished()
        return self._contents

    @property
    def _known(self) -> Contents:
        """The contents of the film; while they change, those before."""
        now = self._contents
        if not isinstance(now, Change):
            return now
        if now.over:
            raise now.failure()
        return now.former

    def _change(
        self,
        what: str,
        finish: Callable[[BaseException], Contents] | None = None,
        *,
        heals: bool = True,
    ) -> Change:
        """Return what stands for the contents, in a `with` whose last line gives them new ones.

        what: changes, for people. finish: makes the film whole after an error, which it is told,
        and returns what it then holds; without it the film is as it was until `Change.begin`.
        heals: whether `reset` makes it whole where that fails. Raises DeviceError within another.
        """
        return Change(self, what, self._settled, finish, heals)

    def _healing(self, what: str, finish: Callable[[BaseException], Contents]) -> Change:
        """Return a change as `change` does, also of what is broken."""
        now = self._contents
        former = now.former if isinstance(now, Change) else now
        return Change(self, what, former, finish, heals=True)

    def _check_healing(self, inside: bool) -> None:
        super()._check_healing(inside)
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
        super()._check_open()
        for device in self.devices:
            forking.check(device.queue)

    def _check(self, inside: bool) -> None:
        super()._check(inside)
        if isinstance(self._contents, Change) and not inside:
            raise self._contents.failure()
