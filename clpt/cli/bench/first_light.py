"""`clpt bench --first-light`: the checks of a new device, told as they end, and their report."""

from __future__ import annotations

from pathlib import Path

from rich.text import Text

from clpt.bench import first_light
from clpt.files import output_files

from ..printing.console import output_console
from .settings import check_writable

WRONG = 3  # the exit status if a check is wrong
LONGEST = 300.0  # seconds that a check may take without a figure, whatever --limit says


def tell_of_first_light(device: str | None, target: Path, limit: float) -> int:
    """Run all checks, print a row of each, write the report; return the exit status."""
    check_writable(target)
    console = output_console()
    checks = first_light.checks()
    results: list[first_light.Result] = []
    with console.status("checking") as status:
        status.update(checks[0].name)
        for result in first_light.run(device, min(limit, LONGEST), checks):
            results.append(result)
            row = f"{result.check.name:18} {result.seconds:4.0f} s  {result.summary}"
            console.print(Text(row, style="red" if result.wrong else ""))
            if len(results) < len(checks):
                status.update(checks[len(results)].name)
    output_files.write_text(target, first_light.report(results, len(checks)))
    console.print(Text(f"{target} tells what to report, and to whom"))
    return WRONG if any(result.wrong for result in results) else 0
