"""The results of bench.gpu_compilers: a row a stage and device, a page of tables, and a picture."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from bench import machine
from bench.gpu_compilers.vendors import VENDORS

Row = dict[str, Any]
RESULTS = machine.ROOT / "bench" / "results"
STAGES = RESULTS / "gpu_compilers.jsonl"
LARGEST = ("stack", "spilled", "size", "memory", "arithmetic", "special", "seconds")
HEAD = """# Programs through the compilers of GPUs that are not here

WHICH of the scenes in `scenes/`, both modes, one lane, along queues; a stage whose text hangs on
the layout of trees stands once for each. `python -m bench.gpu_compilers` measures; how, and what
follows, stands in [docs/gpus.md](../../docs/gpus.md). Rows: [JSON lines](gpu_compilers.jsonl).

![Registers, stage by stage](gpu_compilers.png)

Registers: the least and the most of a stage's programs. Waves: the least that a scheduler runs at
once (NVIDIA: warps a multiprocessor; AMD: waves a SIMD; Intel: work-items a hardware thread, which
has 128 registers of 32 bytes). Stack and spills [bytes; AMD's and Intel's spills: registers], code
[KiB], instructions, and seconds on a machine that other work shared: the most.
"""


def read(path: Path) -> list[Row]:
    """Rows of a file of JSON lines; none where there is no file."""
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def of_stages(rows: Iterable[Row]) -> list[Row]:
    """A row for each device and stage, of the rows of programs.

    scene, mode: of the program with the most registers, the first of equals.
    """
    groups: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        groups.setdefault((row["device"], row["stage"]), []).append(row)
    summaries = []
    for (device, stage), rows_of_stage in sorted(groups.items()):
        built = [row for row in rows_of_stage if "error" not in row]
        failed = (
            {"failed": len(rows_of_stage) - len(built)} if len(rows_of_stage) > len(built) else {}
        )
        row = {"device": device, "stage": stage, "programs": len(rows_of_stage), **failed}
        if built:
            worst = max(built, key=lambda kernel: kernel["registers"])
            row |= {name: worst[name] for name in ("scene", "mode", "registers")}
            row["least"] = min(kernel["registers"] for kernel in built)
            row["occupancy"] = min(kernel["occupancy"] for kernel in built)
            row |= {name: max(kernel[name] for kernel in built) for name in LARGEST}
        summaries.append(row)
    return summaries


def page(rows: list[Row], longest: int | None = None) -> str:
    """The tables, a device each; longest: how many texts of each stage and mode, None for all."""
    few = f"The {longest} longest" if longest and longest > 1 else "The longest program"
    some = f"{few}{'' if longest == 1 else ' programs'} of each stage and mode,"
    some += " and those that took most before,"
    counts = {device: _programs(rows, device) for v in VENDORS for device in v.devices}
    half = max(counts.values()) / 2
    most = [device for device, count in counts.items() if count > half]
    every = f"On {', '.join(most)} all programs, on others the longest of each stage and mode,"
    every = every if any(0 < count <= half for count in counts.values()) else "All programs"
    parts = [HEAD.replace("WHICH", some if longest else every)]
    for vendor in VENDORS:
        for device in vendor.devices:
            rows_of_device = [row for row in rows if row["device"] == device]
            if rows_of_device:
                parts.append(_table(f"{vendor.name} {device}", rows_of_device))
    return "\n".join(parts)


def _programs(rows: list[Row], device: str) -> int:
    """Return how many programs were compiled for a device."""
    return sum(row["programs"] for row in rows if row["device"] == device)


def _table(title: str, rows: list[Row]) -> str:
    count = sum(row["programs"] for row in rows)
    failed = sum(row.get("failed", 0) for row in rows)
    spilling = sum(row.get("spilled", 0) > 0 for row in rows)
    lines = [
        f"## {title}\n",
        f"{count} programs, {failed} refused; stages that spill: {spilling}.\n",
        "| stage | programs | registers | waves | stack | spilled | code "
        "| memory | arithmetic | special | seconds |",
        "| --- " * 11 + "|",
    ]
    for row in rows:
        if "registers" not in row:
            lines.append(f"| {row['stage']} | {row['programs']} | refused |" + " |" * 8)
            continue
        registers = f"{row['least']} to {row['registers']}"
        counts = (
            row[name] if row[name] >= 0 else "" for name in ("memory", "arithmetic", "special")
        )
        cells = (
            row["stage"], row["programs"], registers, row["occupancy"], row["stack"],
            row["spilled"], f"{row['size'] / 1024:.1f}", *counts, f"{row['seconds']:.1f}",
        )  # fmt: skip
        lines.append("| " + " | ".join(map(str, cells)) + " |")
    return "\n".join(lines) + "\n"


def plot(rows: list[Row], path: Path) -> None:
    """Write a picture: the most registers of each stage, on the first devices of NVIDIA and AMD."""
    devices = [vendor.devices[0] for vendor in VENDORS[:2]]
    stages = sorted({row["stage"] for row in rows})
    figure = Figure(figsize=(8, 0.28 * len(stages) + 1))
    axes = figure.subplots()
    for number, device in enumerate(devices):
        rows_by_stage = {row["stage"]: row for row in rows if row["device"] == device}
        places = [i + 0.35 * number for i, stage in enumerate(stages) if stage in rows_by_stage]
        lengths = [
            rows_by_stage[stage].get("registers", 0) for stage in stages if stage in rows_by_stage
        ]
        axes.barh(places, lengths, 0.35, label=device)
    for limit in (64, 96, 128):
        axes.axvline(limit, color="grey", linewidth=0.5, linestyle=":")
    axes.set_yticks([i + 0.17 for i in range(len(stages))], stages, fontsize=7)
    axes.invert_yaxis()
    axes.set_xlabel("registers of a work-item, the most of all programs")
    axes.legend()
    figure.tight_layout()
    figure.savefig(path, dpi=100)


def keep(rows: list[Row], longest: int | None = None) -> None:
    """Write the rows of stages, the page and the picture."""
    lines = (json.dumps(row, separators=(",", ":")) + "\n" for row in rows)
    STAGES.write_text("".join(lines), encoding="utf-8")
    (RESULTS / "gpu_compilers.md").write_text(page(rows, longest), encoding="utf-8")
    plot(rows, RESULTS / "gpu_compilers.png")
