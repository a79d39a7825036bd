"""`clpt devices`: the OpenCL devices, the one that would be used, and why."""

from __future__ import annotations

import json

import click

from ..errors import DeviceError
from .options.verbosity import verbose_option
from .process import terminal


@click.command()
@click.option("--json", "json_wanted", is_flag=True, help="Write JSON instead of a table.")
@verbose_option("Show full names and drivers; log more, twice for everything.")
def devices(json_wanted: bool, verbose: int) -> None:
    """List the OpenCL devices, with the one that would be used and why.

    Each is tried with a trivial kernel. Choose another one by --device NAME-OR-INDEX or by the
    environment variable CLPT_DEVICE; a part of the name is enough.
    """
    from .. import device  # here: help needs no OpenCL
    from ..device import runtimes
    from ..device.context import selection, trial
    from .printing.console import output_console, shown
    from .printing.devices import as_json, table
    from .printing.names import device_name

    listed = device.devices()
    if not listed:
        raise DeviceError(f"no OpenCL device: {runtimes.advice()}")
    failures = {info.index: trial(info) for info in listed}
    if json_wanted:
        terminal.write(json.dumps(as_json(listed, failures), indent=2))
        return
    console = output_console()
    try:
        choice = selection()
    except DeviceError:
        console.print(table(listed, failures, None, bool(verbose)))
        raise
    console.print(table(listed, failures, choice.info.index, bool(verbose)))
    name = choice.info.label if verbose else device_name(choice.info)
    console.print(shown(f"Taken: [{choice.info.index}] {name} ({choice.reason})"))
