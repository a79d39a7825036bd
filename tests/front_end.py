"""clang's front end for OpenCL C: whether a program is one, for devices that are not here."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from collections.abc import Iterable
from pathlib import Path

CLANG = shutil.which("clang")
TARGETS = ("nvptx64-nvidia-nvcl", "amdgcn-amd-amdhsa", "spir64-unknown-unknown")
FLAGS = (
    *("-x", "cl", "-cl-std=CL1.2", "-fsyntax-only", "-Wall", "-Werror"),
    *("-finclude-default-header", "-fdeclare-opencl-builtins"),  # as the driver has them
    *("-Wno-unused-function", "-Wno-unused-variable", "-Wno-unknown-warning-option"),
    "-Wno-bitwise-instead-of-logical",  # masks are integers, in one lane as in eight
)


def errors(texts: Iterable[str], target: str = TARGETS[-1]) -> list[str]:
    """What is wrong with each text, "" where nothing is. Warnings count.

    One process takes them all (the front end itself, as the driver starts one for each), and each
    by itself only where one is wrong.
    """
    given = list(texts)
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder, f"{number}.cl") for number in range(len(given))]
        for file, text in zip(files, given, strict=True):
            file.write_text(text, encoding="utf-8")
        if not given or not _run(files, target):
            return [""] * len(given)
        return [_run([file], target) for file in files]


def _run(files: list[Path], target: str) -> str:
    command = [str(CLANG), "-cc1", "-triple", target, *FLAGS, *map(str, files)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
    return (done.stderr or f"clang ended with {done.returncode}") if done.returncode else ""
