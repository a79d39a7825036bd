"""First light: checks of an untried device, and their report.

Each check runs in a separate process, so that a crash or a hang becomes a row. The report is a
Markdown file: results, speeds, faults to report with the right tracker, and the records.
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from clpt.bench import agreement, apart, pictures, records
from clpt.bench.figures import Figure
from clpt.bench.scenes import PICTURES

MOST_HANGS = 2  # no further check is tried after these
TRACKERS = {  # by a word of the platform, the device or the version
    "pocl": "PoCL: https://github.com/pocl/pocl/issues",
    "rusticl": "Mesa: https://gitlab.freedesktop.org/mesa/mesa/-/issues",
    "clover": "Mesa: https://gitlab.freedesktop.org/mesa/mesa/-/issues",
    "oclgrind": "Oclgrind: https://github.com/jrprice/Oclgrind/issues",
    "nvidia": "NVIDIA: https://developer.nvidia.com/bugs (needs an account)",
    "intel": "Intel: https://github.com/intel/compute-runtime/issues for GPUs, else "
    "https://community.intel.com",
    "amd": "AMD: https://github.com/ROCm/clr/issues",
    "apple": "Apple: https://feedbackassistant.apple.com",
    "qualcomm": "Qualcomm: https://developer.qualcomm.com/support",
    "arm platform": "Arm: https://community.arm.com",
}
NOBODY = "the maker of the driver"


@dataclass(frozen=True)
class Check:
    """A check: its name, and the arguments of `clpt.bench.measure`."""

    name: str
    settings: Mapping[str, Any]


@dataclass(frozen=True)
class Result:
    """The result of a check: figures, perhaps refused, the device, and seconds."""

    check: Check
    about: apart.About
    figures: Sequence[Figure]
    seconds: float

    @property
    def wrong(self) -> list[Figure]:
        """The figures that are refused."""
        return [figure for figure in self.figures if figure.refused]

    @property
    def summary(self) -> str:
        """The result as a line."""
        if self.wrong:
            more = f" (and {len(self.wrong) - 1} more)" if len(self.wrong) > 1 else ""
            return f"{self.wrong[0].name}: {self.wrong[0].refused}{more}"
        return "right" if self.figures else "nothing was measured"


def checks() -> list[Check]:
    """Return all checks in their order: basic checks first."""
    alone: dict[str, Any] = {"rounds": 1}
    all_checks = [
        Check("memory and clock", {**alone, "parts": ["bandwidth"]}),
        Check("rays and trees", {**alone, "parts": ["rays"], "scene": "cornell", "count": 4096}),
    ]
    for name, kept in PICTURES.items():
        stages = {"parts": [agreement.PART], "scene": name, "mode": kept.mode}
        all_checks.append(Check(f"stages of {name}", {**alone, **stages}))
    for name in PICTURES:
        settings = {"parts": [pictures.PART], "scene": name, "size": "quick"}
        all_checks.append(Check(f"picture of {name}", {**alone, **settings}))
    all_checks.append(Check("building trees", {**alone, "parts": ["build"], "scene": "atrium"}))
    all_checks.append(Check("first picture", {**alone, "parts": ["start"], "scene": "cornell"}))
    return all_checks


def run(which: str | int | None, limit: float, checks: Iterable[Check]) -> Iterator[Result]:
    """Run checks on a device; yield results. Stop if no device opens, or after MOST_HANGS.

    which: see clpt.device.choose; limit: seconds without a figure.
    """
    hangs = 0
    for check in checks:
        start = time.monotonic()
        label = str(which) if which is not None else "the default device"
        measured = list(apart.measured(which, label, check.settings, limit))
        about = measured[-1][0] if measured else {"device": label}
        figures = [figure for _, figure in measured]
        result = Result(check, about, figures, time.monotonic() - start)
        yield result
        hangs += any(figure.part == apart.PART and apart.HANGS in figure.refused
                     for figure in figures)  # fmt: skip
        if hangs >= MOST_HANGS or (figures and "opencl" not in about):
            return


def tracker(about: Mapping[str, Any]) -> str:
    """Return the tracker for faults of a device's driver."""
    words = f"{about.get('device', '')} {about.get('opencl', '')}".casefold()
    return next((to for word, to in TRACKERS.items() if word in words), NOBODY)


def report(results: Sequence[Result], total: int) -> str:
    """Return the report as Markdown; total: the number of checks."""
    about = next((r.about for r in results if "opencl" in r.about), results[0].about)
    host = records.circumstances()
    rows = [f"# First light of {about['device']}", ""]
    facts = {**about, **{name: host[name] for name in ("processor", "cores", "clpt", "commit")}}
    rows += ["| | |", "| --- | --- |", f"| date | {host['date']} |"]
    rows += [f"| {name} | {value} |" for name, value in facts.items() if value != ""]
    rows += _works(results, total) + _speeds(results)
    rows += ["", "## What to report, and to whom", ""]
    rows += advice([result for result in results if result.wrong], about)
    rows += ["", "## Records", "", "```json"]
    for result in results:
        for figure in result.figures:
            record = {**host, **figure.record(), **result.about}
            rows.append(json.dumps({"bench": figure.part, **record}))
    return "\n".join([*rows, "```", ""])


def _works(results: Sequence[Result], total: int) -> list[str]:
    """Return the rows of checks with their results."""
    right = sum(not result.wrong for result in results)
    rows = ["", "## What works, and what is wrong", ""]
    rows.append(f"{right} of {total} checks are right; {total - len(results)} were not tried.")
    rows += ["", "| check | | seconds |", "| --- | --- | --- |"]
    rows += [f"| {r.check.name} | {_cell(r.summary)} | {r.seconds:.0f} |" for r in results]
    return rows


def _speeds(results: Sequence[Result]) -> list[str]:
    """Return the rows of speeds."""
    rows = ["", "## How fast", "", "| figure | | |", "| --- | --- | --- |"]
    for figure in (figure for result in results for figure in result.figures):
        if figure.rounds and not figure.refused and figure.part != agreement.PART:
            scene = f" of {figure.scene}" if figure.scene and figure.scene != figure.name else ""
            named = f"{figure.part}{scene}: {figure.name}"
            rows.append(f"| {named} | {figure.value:.4g} | {figure.unit} |")
    return rows


def advice(bad: Sequence[Result], about: Mapping[str, Any]) -> list[str]:
    """Return advice on wrong results, a list item each."""
    if not bad:
        return ["- Nothing is wrong. Send this file to clpt with an issue: the device is new."]
    to = tracker(about)
    rows: dict[str, None] = {}
    for result in bad:
        scene, wrong = result.check.settings.get("scene", "cornell"), result.wrong[0]
        if wrong.part == agreement.PART:
            todo = f"`clpt kernels {scene} -o fault --repro {wrong.name}` writes a program that "
            todo += f"shows it without clpt. Send that folder to {to}"
        elif wrong.part == pictures.PART and apart.HANGS not in wrong.refused:
            todo = f"`clpt kernels {scene} -o fault --repro first` writes the first wrong stage "
            todo += f"as a program of its own, if one is found. Send that folder to {to}"
        elif wrong.part == apart.PART:
            todo = "the driver crashed, hung or refused. "
            todo += f"`clpt kernels {scene} -o texts --lanes 1` writes what it got. "
            todo += f"Send that, and the words above, to {to}"
        else:
            todo = "send this file to clpt first: it may be either's fault"
        rows[f"- {result.check.name}: {todo}."] = None
    return [*rows, "- Send this file to clpt with an issue, in any case."]


def _cell(text: str) -> str:
    return text.replace("|", "\\|")
