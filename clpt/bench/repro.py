"""A launch as a standalone program, which shows a driver's fault without clpt.

The folder has the kernel's text, its input words, the expected output words, and a host program in
C and in Python.
"""

from __future__ import annotations

import re
from pathlib import Path
from string import Template

import numpy as np

from clpt import device, version
from clpt.bench.launches import MOST_OFF, Launch
from clpt.device.building import OPTIONS
from clpt.errors import SceneError
from clpt.files import output_files

DATA = Path(__file__).parent / "data"
HOSTS = ("launch.c", "launch.py")  # stored as .txt: they are no part of clpt
_ROW = re.compile(r"^#line \d+.*$", re.MULTILINE)
README = Template("""A launch of an OpenCL kernel, written by clpt $version.

    python launch.py [PLATFORM [DEVICE]]
    cc -std=c99 launch.c -lOpenCL -lm -o launch && ./launch [PLATFORM [DEVICE]]

Each builds kernel.cl, gives the kernel the words of *.before, runs it once, and compares what it
wrote with *.expected. The exit status is 0 for words that are right, 1 for wrong ones, 2 where
nothing ran. launch.txt has the numbers of work-items and the arguments in their order.

scene       $scene
stage       $stage
expected    by $witness
device      $result
on          $label, $opencl, driver $driver

All files hold words of 32 bits in the host's order. *.margins has a float for each word, by which
it may differ. A margin m of 0 or more: the words are floats, and may differ by m. Below 0: they are
whole numbers, and may differ by -1 - m. Infinite: the word is not compared.
""")


def write(
    folder: Path, launch: Launch, scene: str, on: device.DeviceInfo, witness: str, result: str
) -> None:
    """Write a launch as a standalone program that expects the launch's output words.

    scene, witness, result: for its README. Raises SceneError if it cannot be written.
    """
    rows, files = _described(launch)
    readme = README.substitute(
        version=version.described(), scene=scene, stage=launch.stage, witness=witness,
        result=result, label=on.label, opencl=on.version, driver=on.driver,
    )  # fmt: skip
    texts = {"launch.txt": "\n".join([*rows, ""]), "README.txt": readme}
    texts["kernel.cl"] = _ROW.sub("", launch.text.text)
    texts |= {name: (DATA / f"{name}.txt").read_text(encoding="utf-8") for name in HOSTS}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in texts.items():
            output_files.write_text(folder / name, text)
        for name, content in files.items():
            output_files.write(folder / name, content)
    except OSError as error:
        raise SceneError(f"cannot be written: {error}", file=folder) from error


def _described(launch: Launch) -> tuple[list[str], dict[str, bytes]]:
    """Return the rows of launch.txt, and the content of files of words."""
    rows = [" ".join(["options", *OPTIONS]), f"kernel {launch.kernel}"]
    rows.append(" ".join(["size", *map(str, launch.size)]))
    if launch.group:
        rows.append(" ".join(["group", *map(str, launch.group)]))
    changed = sum(
        int(((launch.before[name] != launch.after[name]) & np.isfinite(margins)).sum())
        for name, margins in launch.margins.items()
    )
    rows += [f"allowed {int(MOST_OFF * changed)}", " ".join(["compare", *launch.margins])]
    files: dict[str, bytes] = {}
    for argument in launch.arguments:
        name, kind = argument.name, "buffer" if argument.name in launch.before else "value"
        data = launch.before[name].tobytes() if kind == "buffer" else launch.values[name]
        rows.append(f"argument {kind if data is not None else 'null'} {name} {len(data or b'')}")
        if data is not None:
            files[f"{name}.before"] = data
    for name, margins in launch.margins.items():
        files[f"{name}.expected"] = launch.after[name].tobytes()
        files[f"{name}.margins"] = margins.tobytes()
    return rows, files
