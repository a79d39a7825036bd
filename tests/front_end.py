"""clang's front end for OpenCL C: whether a program is one, for devices that are not here."""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from collections.abc import Iterable
from pathlib import Path

CLANG = shutil.which("clang")
TARGETS = ("nvptx64-nvidia-nvcl", "amdgcn-amd-amdhsa", "spir64-unknown-unknown")
LINE = re.compile(r'^#line \d+ "', re.MULTILINE)
OWNER = re.compile(r"(\d+)\.cl[/:]")
DRIVERS = ("-finclude-default-header", "-fdeclare-opencl-builtins")  # what a driver declares
OURS = ("-include", "opencl-c-base.h")  # types alone: for `clpt.device.building`
LANGUAGE = ("-x", "cl", "-cl-std=CL1.2")
FLAGS = (
    *(*LANGUAGE, "-fsyntax-only", "-Wall", "-Werror"),
    *("-Wno-unused-function", "-Wno-unused-variable", "-Wno-unknown-warning-option"),
    *("-ferror-limit", "0"),  # an error does not end the texts behind it
    "-Wno-bitwise-instead-of-logical",  # masks are integers, in one lane as in eight
)


def errors(
    texts: Iterable[str], target: str = TARGETS[-1], functions: tuple[str, ...] = DRIVERS
) -> list[str]:
    """What is wrong with each text, "" where nothing is. Warnings count.

    functions: DRIVERS, or OURS where each text declares OpenCL's functions itself. One process
    takes all texts: the front end itself, as clang's driver starts one for each.
    """
    found: list[list[str]] = []
    with tempfile.TemporaryDirectory() as folder:
        for number, text in enumerate(texts):
            told = LINE.sub(rf"\g<0>{number}.cl/", text)  # so that an error names its text
            Path(folder, f"{number}.cl").write_text(told, encoding="utf-8")
            found.append([])
        command = [str(CLANG), "-cc1", "-triple", target, *FLAGS, *functions]
        command += [f"{number}.cl" for number in range(len(found))]
        if not found:
            return []
        done = subprocess.run(
            command, cwd=folder, capture_output=True, text=True, timeout=900, check=False
        )
    if done.returncode == 0:
        return [""] * len(found)
    rows = [(OWNER.match(row), row) for row in done.stderr.splitlines()]
    if not any(owner for owner, _ in rows):
        raise RuntimeError(f"clang ended with {done.returncode}: {done.stderr[-2000:]}")
    number = 0
    for owner, row in rows:
        number = int(owner[1]) if owner else number
        found[number].append(row[owner.end() :] if owner else row)
    return ["\n".join(own) for own in found]
