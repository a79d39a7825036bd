"""Circumstances of measurements, and records as JSON lines."""

from __future__ import annotations

import datetime
import json
import math
import os
import platform
import re
import subprocess
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

from clpt import device
from clpt.bench.figures import Figure
from clpt.errors import SceneError
from clpt.files import output_files

ROOT = Path(__file__).parents[2]
Row = Mapping[str, Any]
_KEY = ("bench", "scene", "figure", "unit", "mode", "size", "benchmark_version")


def processor() -> str:
    """Return the name of the host's processor."""
    try:
        model = re.search(r"model name\s*:\s*(.+)", Path("/proc/cpuinfo").read_text())
    except OSError:
        model = None
    return model[1].strip() if model else platform.processor() or platform.machine()


def vectors() -> str:
    """Return the widest vector instructions of an x86 processor, "" for others."""
    try:
        flags = set(Path("/proc/cpuinfo").read_text().split())
    except OSError:
        return ""
    return next((name for name in ("avx512f", "avx2", "avx", "sse2") if name in flags), "")


def commit() -> str:
    """Return the commit of a checkout, with a plus sign after changes; "" if installed."""
    if not (ROOT / ".git").exists():
        return ""

    def git(*arguments: str) -> str:
        command = ["git", "-C", str(ROOT), *arguments]
        try:
            done = subprocess.run(command, capture_output=True, text=True, check=True)
        except (OSError, subprocess.CalledProcessError):
            return ""
        return done.stdout.strip()

    changed = git("status", "--porcelain", "--untracked-files=no", "--", "clpt", "kernels")
    return git("rev-parse", "--short", "HEAD") + ("+" if changed else "")


def version() -> str:
    """Return clpt's installed version; "" if it runs from a checkout that is not installed."""
    try:
        return metadata.version("clpt")
    except metadata.PackageNotFoundError:
        return ""


def circumstances() -> dict[str, Any]:
    """Return the common part of records: date, version, commit, processor, cores and load."""
    busy = {"load": round(os.getloadavg()[0], 1)} if hasattr(os, "getloadavg") else {}
    return {
        "date": datetime.datetime.now(datetime.timezone.utc).isoformat(timespec="seconds"),
        "clpt": version(),
        "commit": commit(),
        "processor": f"{processor()} {vectors()}".strip(),
        "cores": os.cpu_count(),
        **busy,
    }


def of_device(info: device.DeviceInfo) -> dict[str, Any]:
    """Return the part of a record that describes the device."""
    cl_device = info.cl_device
    return {
        "device": info.label,
        "kind": info.kind,
        "opencl": info.version,
        "driver": info.driver,
        "compute_units": info.compute_units,
        "global_mem": info.global_mem,
        "max_alloc": info.max_alloc,
        "local_mem": cl_device.local_mem_size,
        "group": cl_device.max_work_group_size,
        "address_align": cl_device.mem_base_addr_align // 8,
        "doubles": "cl_khr_fp64" in cl_device.extensions.split(),
        "images": bool(cl_device.image_support),
    }


def append(path: str | Path, rows: Iterable[dict[str, Any]]) -> None:
    """Append records to a file of JSON lines; create it if missing. Raises SceneError."""
    about = circumstances()
    try:
        Path(path).parent.mkdir(parents=True, exist_ok=True)
        heads = (({name: row[name] for name in ("bench",) if name in row}, row) for row in rows)
        lines = [json.dumps({**head, **about, **row}) + "\n" for head, row in heads]
        output_files.append_text(path, "".join(lines))
    except OSError as error:
        raise SceneError(f"cannot be written: {error}", file=path) from error


def read(path: str | Path) -> list[dict[str, Any]]:
    """Return the records of a file of JSON lines. Raises SceneError with the line."""
    rows = []
    try:
        lines = Path(path).read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise SceneError(f"cannot be read: {error}", file=path) from error
    for number, line in enumerate(lines, 1):
        try:
            row = json.loads(line)
        except ValueError as error:
            raise SceneError(f"is no JSON: {error}", file=path, line=number) from error
        if not isinstance(row, dict):
            raise SceneError("is no record, an object is wanted", file=path, line=number)
        rows.append(row)
    return rows


@dataclass(frozen=True)
class Ratio:
    """A measured figure beside the same figure in a record.

    ratio: above 1 if the new figure is better, in any unit; noise: relative uncertainty, from the
    spread of both; then: the record.
    """

    figure: Figure
    then: Row
    ratio: float
    noise: float

    def below(self, limit: float) -> bool:
        """Return whether the ratio is below a limit by more than noise."""
        return self.ratio * (1.0 + self.noise) < limit


def key(record: Row) -> tuple[Any, ...]:
    """Return the values of a record that are equal in all records of the same figure."""
    return tuple(record.get(name) for name in _KEY)


def against(figures: Iterable[Figure], records: Iterable[Row], device: str) -> list[Ratio]:
    """Return ratios of the figures to the newest record of each.

    device: label of the measured device, whose records precede other devices'. Raises
    SceneError if no figure has a record.
    """
    then: dict[tuple[Any, ...], Row] = {}
    for record in sorted(records, key=lambda record: record.get("device") == device):
        if isinstance(record.get("value"), (int, float)) and "figure" in record:
            then[key(record)] = record
    ratios = [
        _ratio(figure, then[key(figure.record())])
        for figure in figures
        if figure.rounds and not figure.refused and key(figure.record()) in then
    ]
    if not ratios:
        raise SceneError("the record to compare with has none of the figures that were measured")
    return ratios


def _ratio(figure: Figure, then: Row) -> Ratio:
    now, before = figure.value, float(then["value"])
    ratio = before / now if figure.less_is_better else now / before
    noise = math.hypot(figure.spread, float(then.get("spread", 0.0)))
    return Ratio(figure, then, ratio, noise)
