"""First light: what to run on a device that nobody has tried, and the report of it.

Each check is a process of its own, so that a crash or a hang is a row. The report is one Markdown
file: what works, what is wrong, how fast it is, what to report and to whom, and the records.
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from clpt.bench import agreement, apart, pictures, records
from clpt.bench.figures import Figure
from clpt.bench.picture_scenes import PICTURES

MOST_HANGS = 2  # after which nothing else is tried
TRACKERS = {  # of drivers, by a word of the platform's, the device's or the version's name
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
    """The end of a check: figures, some of which may be refused, the device, and seconds."""

    check: Check
    about: apart.About
    figures: Sequence[Figure]
    seconds: float

    @property
    def wrong(self) -> list[Figure]:
        """The figures that are refused."""
        return [figure for figure in self.figures if figure.refused]

    @property
    def told(self) -> str:
        """Say what became of it, in a line."""
        if self.wrong:
            more = f" (and {len(self.wrong) - 1} more)" if len(self.wrong) > 1 else ""
            return f"{self.wrong[0].name}: {self.wrong[0].refused}{more}"
        return "right" if self.figures else "nothing was measured"


def checks() -> list[Check]:
    """Return all checks, in their order: what others rest on comes first."""
    alone: dict[str, Any] = {"rounds": 1}
    found = [
        Check("memory and clock", {**alone, "parts": ["bandwidth"]}),
        Check("rays and trees", {**alone, "parts": ["rays"], "scene": "cornell", "count": 4096}),
    ]
    for name, kept in PICTURES.items():
        stages = {"parts": [agreement.PART], "scene": name, "mode": kept.mode}
        found.append(Check(f"stages of {name}", {**alone, **stages}))
    for name in PICTURES:
        own = {"parts": [pictures.PART], "scene": name, "size": "quick"}
        found.append(Check(f"picture of {name}", {**alone, **own}))
    found.append(Check("building trees", {**alone, "parts": ["build"], "scene": "atrium"}))
    found.append(Check("first picture", {**alone, "parts": ["start"], "scene": "cornell"}))
    return found


def run(which: str | int | None, limit: float, given: Iterable[Check]) -> Iterator[Result]:
    """Run checks on a device; yield each result. Stop where no device opens, or all hangs.

    which: as clpt.device.choose takes it; limit: seconds that may pass without a figure.
    """
    hangs = 0
    for check in given:
        start = time.monotonic()
        label = str(which) if which is not None else "the default device"
        told = list(apart.measured(which, label, check.settings, limit))
        about = told[-1][0] if told else {"device": label}
        figures = [figure for _, figure in told]
        result = Result(check, about, figures, time.monotonic() - start)
        yield result
        hangs += any(figure.part == apart.PART and apart.HANGS in figure.refused
                     for figure in figures)  # fmt: skip
        if hangs >= MOST_HANGS or (figures and "opencl" not in about):
            return


def tracker(about: Mapping[str, Any]) -> str:
    """Return where faults of a device's driver are reported."""
    words = f"{about.get('device', '')} {about.get('opencl', '')}".casefold()
    return next((to for word, to in TRACKERS.items() if word in words), NOBODY)


def report(results: Sequence[Result], total: int) -> str:
    """Return the report, as Markdown; total: how many checks there are."""
    about = next((one.about for one in results if "opencl" in one.about), results[0].about)
    host = records.circumstances()
    rows = [f"# First light of {about['device']}", ""]
    facts = {**about, **{name: host[name] for name in ("processor", "cores", "clpt", "commit")}}
    rows += ["| | |", "| --- | --- |", f"| date | {host['date']} |"]
    rows += [f"| {name} | {value} |" for name, value in facts.items() if value != ""]
    rows += _works(results, total) + _speeds(results)
    rows += ["", "## What to report, and to whom", ""]
    rows += advice([one for one in results if one.wrong], about)
    rows += ["", "## Records", "", "```json"]
    for one in results:
        for figure in one.figures:
            record = {**host, **figure.record(), **one.about}
            rows.append(json.dumps({"bench": figure.part, **record}))
    return "\n".join([*rows, "```", ""])


def _works(results: Sequence[Result], total: int) -> list[str]:
    """Return the rows of what works, and what is wrong."""
    right = sum(not one.wrong for one in results)
    rows = ["", "## What works, and what is wrong", ""]
    rows.append(f"{right} of {total} checks are right; {total - len(results)} were not tried.")
    rows += ["", "| check | | seconds |", "| --- | --- | --- |"]
    rows += [f"| {one.check.name} | {_cell(one.told)} | {one.seconds:.0f} |" for one in results]
    return rows


def _speeds(results: Sequence[Result]) -> list[str]:
    """Return the rows of how fast it is."""
    rows = ["", "## How fast", "", "| figure | | |", "| --- | --- | --- |"]
    for figure in (figure for one in results for figure in one.figures):
        if figure.rounds and not figure.refused and figure.part != agreement.PART:
            scene = f" of {figure.scene}" if figure.scene and figure.scene != figure.name else ""
            named = f"{figure.part}{scene}: {figure.name}"
            rows.append(f"| {named} | {figure.value:.4g} | {figure.unit} |")
    return rows


def advice(bad: Sequence[Result], about: Mapping[str, Any]) -> list[str]:
    """Return what to do about results that are wrong, a row of a list each."""
    if not bad:
        return ["- Nothing is wrong. Send this file to clpt with an issue: the device is new."]
    to = tracker(about)
    rows: dict[str, None] = {}
    for one in bad:
        scene, wrong = one.check.settings.get("scene", "cornell"), one.wrong[0]
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
        rows[f"- {one.check.name}: {todo}."] = None
    return [*rows, "- Send this file to clpt with an issue, in any case."]


def _cell(text: str) -> str:
    return text.replace("|", "\\|")
