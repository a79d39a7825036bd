"""Declarations of OpenCL's built-in functions, in place of clang's header.

PoCL puts clang's header before each text: 18,000 lines, which take longer than most of clpt's
programs. With its guard macro defined the header is empty, and clpt's declarations
(`kernels/core/builtins.cl`) precede the text. A text that calls other functions, such as a user's,
fails to build, and is built again with the header.
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
    """Yield the texts and options of a program, in the order of attempts."""
    if device.info.is_pocl:
        yield declarations() + text, [*flags, _GUARD]
    yield text, [*flags]


def built(
    device: Device, text: str, flags: Sequence[str], build: Callable[[str, list[str]], _Built]
) -> _Built:
    """Return the result of `build` for the first form that builds.

    Raises the pyopencl.Error of the last form.
    """
    *others, last = forms(device, text, flags)
    for form in others:
        try:
            return build(*form)
        except cl.Error:
            continue
    return build(*last)


@functools.cache
def declarations() -> str:
    """Return the declarations without comments, followed by #undef of their macros."""
    text = (kernels_folder() / "core" / "builtins.cl").read_text(encoding="utf-8")
    text = re.sub(r"/\*.*?\*/|\\\n\s*|\n(?=\n)", "", text, flags=re.DOTALL)
    macros = dict.fromkeys(re.findall(r"^#define (\w+)", text, re.MULTILINE))
    return text + "".join(f"#undef {name}\n" for name in macros)
