"""Measurement of a device in a separate process, which a driver may crash or hang.

The process writes JSON lines to its standard output. Drivers' output goes to standard error, whose
last line is reported if the process dies.
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

PART = "process"  # of figures that report the end of a process
HANGS = "it hangs"  # prefix of the figure of a silent process
LIMIT = 900.0  # [s] without a figure, after which a process is killed

About = Mapping[str, Any]  # of a device, see clpt.bench.records.of_device
Measured = tuple[About, Figure]


def measured(
    which: str | int | None, label: str | None, settings: Mapping[str, Any], limit: float
) -> Iterator[Measured]:
    """Measure a device in a separate process; yield the device's description with each figure.

    which: see clpt.device.choose; label: of the device if several are measured, else None;
    settings: JSON values for clpt.bench.measure; limit: seconds without a figure.
    A process that dies or hangs yields a refused figure at the end. So does an error of clpt with a
    label; without a label it is raised as ClptError.
    """
    main = f"from {__name__} import main; main(*sys.argv[1:])"
    command = child_processes.command(main, json.dumps(which), json.dumps(dict(settings)))
    about: About = {"device": label or which or "the default device"}
    last = "its start"
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
    """Start a process; kill it with its child processes at the end."""
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
    """Yield a process's messages. Raises TimeoutError after `limit` seconds without any."""
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
        with contextlib.suppress(ValueError):  # a crash cuts a line
            message = json.loads(line)
            yield message


def _ended(why: str, errors: IO[bytes]) -> Figure:
    """Return the figure of a process that ended early."""
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
    """Measure a device; write a JSON line for the device, each figure, an error and the end."""
    from clpt import bench as benchmark
    from clpt.bench import records

    with os.fdopen(os.dup(1), "w", encoding="utf-8") as output:
        os.dup2(2, 1)

        def tell(**message: Any) -> None:
            output.write(json.dumps(message) + "\n")
            output.flush()

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
    os._exit(0)  # skip unloading the driver, which may crash
