"""A renderer that is made beside a session, which sees whether it has to be compiled first."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import CancelledError, Future

from clpt.device import Device
from clpt.render.renderer import Renderer


class Making:
    """Makes a renderer in a thread of its own, which waits before it compiles anything new.

    device: the one that it is made on; make: makes it.
    """

    def __init__(self, device: Device, make: Callable[[], Renderer]):
        self._builds, self._make = device.builds, make
        self._news = threading.Condition()
        self._is_new = self._goes_on = self._is_given_up = False
        self._result: Future[Renderer] = Future()
        self._result.add_done_callback(lambda _: self._tell())
        self._builds.on_new = self._wait_to_compile
        threading.Thread(target=self._main, name="clpt view programs", daemon=True).start()

    @property
    def is_done(self) -> bool:
        """Whether the renderer is made, or cannot be."""
        return self._result.done()

    @property
    def is_new(self) -> bool:
        """Whether there is something to compile that no cache has."""
        return self._is_new

    def wait(self, seconds: float) -> None:
        """Wait until it is done, or waits itself, but no longer than this."""
        with self._news:
            self._news.wait_for(
                lambda: self.is_done or (self._is_new and not self._goes_on), seconds
            )

    def go_on(self) -> None:
        """Let the thread compile."""
        with self._news:
            self._goes_on = True
            self._news.notify_all()

    def renderer(self) -> Renderer:
        """Return the renderer; wait for it. Raises what making it has raised."""
        self.go_on()
        return self._result.result()

    def give_up(self) -> None:
        """Let the thread end soon, wait for that, and close its renderer."""
        self._is_given_up = True
        self.go_on()
        if self._result.exception() is None:
            self._result.result().close()

    def _main(self) -> None:
        try:
            made = self._make()
        except BaseException as error:
            self._end()
            self._result.set_exception(error)
        else:
            self._end()
            self._result.set_result(made)

    def _end(self) -> None:
        self._builds.on_new = lambda: None

    def _tell(self) -> None:
        with self._news:
            self._news.notify_all()

    def _wait_to_compile(self) -> None:
        """Wait in a thread that would compile. Raises CancelledError once it is given up."""
        with self._news:
            self._is_new = True
            self._news.notify_all()
            self._news.wait_for(lambda: self._goes_on)
        if self._is_given_up:
            raise CancelledError
