"""Declarations of OpenCL's built-in functions, for a compiler that reads them anew for each text.

PoCL puts clang's header before each text: 18,000 lines, which take longer than most of clpt's
programs. The header guards itself by a macro. With that macro set it is empty, and clpt's own
declarations (`kernels/core/builtins.cl`) stand before the text. A text that calls something else,
as one of a user may, does not build so, and is built again with the header.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

import pyopencl as cl

from .context import Device
from .source import kernels_folder

_GUARD = "-D_OPENCL_H_"
_Built = TypeVar("_Built")


def forms(device: Device, text: str, flags: Sequence[str]) -> Iterator[tuple[str, list[str]]]:
    """Yield texts and options of a program to try, one after the other."""
    if device.info.is_pocl:
        yield declared() + text, [*flags, _GUARD]
    yield text, [*flags]


def built(
    device: Device, text: str, flags: Sequence[str], build: Callable[[str, list[str]], _Built]
) -> _Built:
    """Return what `build` makes of the first form that builds.

    Raises the pyopencl.Error of the last.
    """
    *others, last = forms(device, text, flags)
    for form in others:
        try:
            return build(*form)
        except cl.Error:
            continue
    return build(*last)


@functools.cache
def declared() -> str:
    """Return the declarations without comments; of their macros none is left defined."""
    text = (kernels_folder() / "core" / "builtins.cl").read_text(encoding="utf-8")
    text = re.sub(r"/\*.*?\*/|\\\n\s*|\n(?=\n)", "", text, flags=re.DOTALL)
    macros = dict.fromkeys(re.findall(r"^#define (\w+)", text, re.MULTILINE))
    return text + "".join(f"#undef {name}\n" for name in macros)
