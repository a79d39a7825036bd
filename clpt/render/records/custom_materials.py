"""Material kinds from outside of the package: their OpenCL text and their valid names.

A scene carries its classes itself: nothing is registered, and two scenes may have different kinds
with the same name.
"""

from __future__ import annotations

import re
import sys
from functools import cache
from itertools import pairwise
from pathlib import Path
from textwrap import dedent

from clpt import device
from clpt.errors import SceneError
from clpt.geometry import shape_records
from clpt.records import INSTANCE, LIGHT, SETTINGS, SHAPE, SLABS
from clpt.render.records import lights as light_records
from clpt.scene import KINDS
from clpt.scene.materials import LEAVES, Material
from clpt.scene.scatterer import Scatterer

MOST = 255  # kinds in a scene: what the upper bits of a material word count, but for mixtures
CONTRACT = ("sample", "eval", "pdf", "albedo")  # what each has, see kernels/materials/bsdf.cl
VERBS = (*CONTRACT, "pdfs", "load", "colour")
# what else tables keep sources under, see clpt.render.records.tables
INNER = ("perturbation", "emission", "factor", "layer", "mixture")


def ordered(kinds: dict[type[Material], str]) -> tuple[type[Material], ...]:
    """Return the leaf kinds of a scene in their order: clpt's as they are listed, then the others.

    kinds: each with where the scene has it. Raises SceneError for a kind without valid kernels.
    """
    outside = sorted(kinds.keys() - set(LEAVES), key=lambda cls: cls.kind)
    for cls in outside:
        check(cls, kinds[cls])
    for cls, other in pairwise(outside):
        if cls.kind == other.kind:
            raise SceneError(
                f"two classes are called {cls.__name__!r}; rename one, or, if its definition was "
                "run twice, make the materials anew",
                where=kinds[other],
            )
    if len(kinds) > MOST:
        raise SceneError(f"a scene can have {MOST} kinds of materials, not {len(kinds)}")
    return (*(cls for cls in LEAVES if cls in kinds), *outside)


def check(cls: type[Material], where: str | None = None) -> None:
    """Raise SceneError for a class without its functions, or with a name that kernels have."""
    if cls.source is None:
        raise SceneError(
            f"the material class {cls.__name__!r} has no `source`: the text or the path of its "
            "OpenCL functions",
            where=where,
        )
    kinds = {*INNER, *(cls.kind for listed in KINDS.values() for cls in listed)}
    names = {cls.__name__, *(f"{cls.kind}_{verb}" for verb in VERBS)}
    if taken := sorted({cls.kind} & kinds | names & _identifiers()):
        raise SceneError(
            f"the material class {cls.__name__!r} cannot have this name: clpt has {taken[0]!r}",
            where=where,
        )
    if cls.__eq__ is not Material.__eq__:
        raise SceneError(
            f"declare {cls.__name__!r} with eq=False: materials are told apart by identity",
            where=where,
        )
    if not cls.__name__.isascii():
        raise SceneError(f"{cls.__name__!r} is no name in OpenCL: use a to z", where=where)
    part, verbs = text(cls), (*CONTRACT, *(("pdfs",) if cls.chromatic else ()))
    missing = {f"{cls.kind}_{verb}" for verb in verbs} - set(re.findall(r"\w+", part.text))
    if missing:
        raise SceneError(f"has no {', '.join(sorted(missing))}", file=part.file, where=where)


def text(cls: type[Scatterer]) -> device.Part:
    """Return a kind's OpenCL text, with its file and line for compilers' messages.

    Raises SceneError for a file that cannot be read.
    """
    owner = next(base for base in cls.__mro__ if "source" in vars(base))
    module = getattr(sys.modules.get(owner.__module__), "__file__", None)
    if isinstance(cls.source, Path):
        path = Path(module).parent / cls.source if module else cls.source
        try:
            return device.Part(path.read_text(encoding="utf-8"), path.as_posix())
        except (OSError, UnicodeDecodeError) as error:
            raise SceneError(f"{cls.__name__}.source cannot be read: {error}", file=path) from error
    source = str(cls.source)
    if "{" not in source:
        raise SceneError(
            f"{cls.__name__}.source is {source!r}, which is no OpenCL; a file is a pathlib.Path"
        )
    file, line = _place(source, Path(module)) if module else (f"{cls.__name__}.source", 1)
    return device.Part(dedent(source), file, line)  # functions begin at the beginnings of lines


def _place(source: str, module: Path) -> tuple[str, int]:
    """The file and line of a text, if the Python file holds it unchanged."""
    try:
        before, match, _ = module.read_text(encoding="utf-8").partition(source)
    except (OSError, UnicodeDecodeError):
        match = ""
    return (module.as_posix(), before.count("\n") + 1) if match else (f"{module.name}:source", 1)


@cache
def _identifiers() -> frozenset[str]:
    """Types and functions of the kernels."""
    files = device.kernels_folder().rglob("*.cl")
    kernels = "\n".join(path.read_text(encoding="utf-8") for path in files)
    records = [SETTINGS, *SLABS, SHAPE, INSTANCE, LIGHT]
    records += [*shape_records.VALUES, *light_records.VALUES]
    return frozenset(
        [
            *(record.name for record in records),
            *re.findall(r"\}\s*(\w+);", kernels),
            *re.findall(r"^(?:inline )?\w+ (\w+)\(", kernels, re.MULTILINE),
        ]
    )
