"""A device measured in a process of its own, so that a driver that crashes or hangs ends only that.

The process tells JSON lines on what was its standard output; what drivers print goes to its
standard error, of which the last words are told if it dies.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import os
import queue
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterable, Iterator, Mapping
from typing import IO, Any

from clpt import device
from clpt.bench.figures import Figure
from clpt.errors import ClptError, one_line
from clpt.files import child_processes

PART = "process"  # of figures that tell how a process ended
HANGS = "it hangs"  # how the figure of a process begins that told nothing for too long
LIMIT = 900.0  # seconds without a figure after which a process is ended

About = Mapping[str, Any]  # of a device, see clpt.bench.records.of_device
Told = tuple[About, Figure]


def measured(
    which: str | int | None, label: str | None, settings: Mapping[str, Any], limit: float
) -> Iterator[Told]:
    """Measure a device in a process of its own; yield figures with what the device is.

    which: as clpt.device.choose takes it; label: of one of several devices; settings: of
    clpt.bench.measure, as JSON takes them; limit: seconds that may pass without a figure.
    A process that dies or hangs is a last figure, which is refused; of one of several devices an
    error of clpt's is too. Else it is raised, as ClptError.
    """
    main = f"from {__name__} import main; main(*sys.argv[1:])"
    command = child_processes.command(main, json.dumps(which), json.dumps(dict(settings)))
    about: About = {"device": label or which or "the default device"}
    last = "it began"
    with tempfile.TemporaryFile() as errors, _process(command, errors) as process:
        try:
            for message in _messages(process, limit):
                if "error" in message:
                    if label is None:
                        raise ClptError(message["error"])
                    yield about, _refused(message["error"])
                    return
                if "end" in message:
                    return
                about = message.get("device", about)
                if "figure" in message:
                    figure = Figure(**message["figure"])
                    figure = dataclasses.replace(figure, rounds=tuple(figure.rounds))
                    last = f"{figure.part} {figure.name}"
                    yield about, figure
        except TimeoutError:
            yield about, _ended(f"{HANGS}: nothing came for {limit:g} s after {last}", errors)
            return
        yield about, _ended(f"it died ({_status(process.wait())}) after {last}", errors)


@contextlib.contextmanager
def _process(command: list[str], errors: IO[bytes]) -> Iterator[subprocess.Popen[str]]:
    """Start a process, which is killed at the end with those that it has started."""
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=errors, text=True, encoding="utf-8",
        errors="replace", start_new_session=os.name == "posix",
    )  # fmt: skip
    try:
        yield process
    finally:
        if os.name == "posix":
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(process.pid, signal.SIGKILL)
        else:
            process.kill()
        process.wait()


def _messages(process: subprocess.Popen[str], limit: float) -> Iterator[dict[str, Any]]:
    """Yield what a process tells until it ends. Raises TimeoutError if nothing comes for long."""
    lines: queue.Queue[str | None] = queue.Queue()

    def read(output: Iterable[str]) -> None:
        for line in output:
            lines.put(line)
        lines.put(None)

    threading.Thread(target=read, args=(process.stdout,), daemon=True).start()
    while True:
        try:
            line = lines.get(timeout=limit)
        except queue.Empty:
            raise TimeoutError from None
        if line is None:
            return
        with contextlib.suppress(ValueError):  # a line that a crash has cut
            message = json.loads(line)
            yield message


def _ended(why: str, errors: IO[bytes]) -> Figure:
    """Return the figure of a process that did not come to its end."""
    errors.seek(0)
    words = errors.read().decode("utf-8", "replace").strip().splitlines()[-1:]
    return _refused(": ".join([why, *words]))


def _refused(why: str) -> Figure:
    return Figure(PART, "measuring", "", ()).refuse(one_line(why))


def _status(code: int) -> str:
    if code < 0:
        with contextlib.suppress(ValueError):
            return signal.Signals(-code).name
    return f"status {code}"


def main(which: str, settings: str) -> None:
    """The process that measures: a JSON line for the device, each figure, an error and the end."""
    from clpt import bench as benchmark
    from clpt.bench import records

    with os.fdopen(os.dup(1), "w", encoding="utf-8") as told:
        os.dup2(2, 1)

        def tell(**message: Any) -> None:
            told.write(json.dumps(message) + "\n")
            told.flush()

        try:
            on = device.choose(json.loads(which), profiling=True)
            tell(device=records.of_device(on.info))
            for figure in benchmark.measure(on, **json.loads(settings)):
                tell(figure=dataclasses.asdict(figure))
        except ClptError as error:
            tell(error=str(error))
        else:
            tell(end=True)
    sys.stdout.flush()
    os._exit(0)  # a driver that crashes when it is unloaded has measured all the same
