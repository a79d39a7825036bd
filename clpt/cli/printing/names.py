"""Short names of devices, for lines that have little room."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Protocol

PLATFORMS = {  # names that people use
    "Portable Computing Language": "PoCL",
    "AMD Accelerated Parallel Processing": "AMD",
    "NVIDIA CUDA": "NVIDIA",
    "Intel(R) OpenCL": "Intel",
    "Intel(R) OpenCL Graphics": "Intel",
}
_MARKS = re.compile(r"\((?:R|TM|C)\)|\bCPU\b|@ ?[\d.]+ ?GHz|\b\d+-Core Processor\b", re.IGNORECASE)
_TARGET = re.compile(r"^(?:pthread|cpu)-(?:[a-z0-9_.-]*-)?(?=[A-Z])")  # PoCL's driver and target


class Info(Protocol):
    """A device: the names that OpenCL gives it."""

    @property
    def platform(self) -> str: ...

    @property
    def name(self) -> str: ...


def device_name(info: Info) -> str:
    """Return platform and device without marks and what says nothing: PoCL AMD EPYC."""
    platform = " ".join(PLATFORMS.get(info.platform, _MARKS.sub("", info.platform)).split())
    name = " ".join(_MARKS.sub("", _TARGET.sub("", info.name)).split())
    return name if name.startswith(platform) else f"{platform} {name}"


def device_names(infos: Sequence[Info]) -> str:
    """Return the names of several devices: 4 x NVIDIA H100 where they are alike."""
    names = [device_name(info) for info in infos]
    found = [(names.count(name), name) for name in dict.fromkeys(names)]
    return " and ".join(name if count == 1 else f"{count} x {name}" for count, name in found)
