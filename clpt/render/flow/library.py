"""The kernels as a library: text that an application puts in front of its own OpenCL program."""

from __future__ import annotations

import re

from clpt import bvh, device
from clpt.errors import SceneError, UnknownKindError
from clpt.render.flow.stages import functions_text
from clpt.render.materials import rough_coat_table
from clpt.render.records import custom_materials
from clpt.scene.integrators import PIXELWISE
from clpt.scene.materials import LEAVES, Material

LANES = (1, 8, 16)
_MATH = ("core/lanes.cl", "core/math.cl")
_SPECTRUM = (*_MATH, "generated/spectrum.cl", "core/spectrum.cl")
PARTS: dict[str, tuple[str, ...]] = {
    "lanes": ("core/lanes.cl",),
    "math": _MATH,
    "frame": (*_MATH, "core/frame.cl"),
    "warp": (*_MATH, "core/warp.cl"),
    "mis": ("core/lanes.cl", "core/mis.cl"),
    "random": ("core/lanes.cl", "core/random.cl", "generated/sampler.cl"),
    "spectrum": _SPECTRUM,
    "fresnel": (*_SPECTRUM, "materials/fresnel.cl"),
    "microfacet": (*_MATH, "materials/microfacet.cl"),
    "bvh": ("bvh/library.cl",),
}
_INLINE = """\
#ifdef NOT_INLINED
#define CLPT_INLINE inline
#else
#define CLPT_INLINE __attribute__((always_inline)) inline
#endif
"""
BSDF = (*_SPECTRUM, "core/frame.cl", "core/warp.cl", "materials/bsdf.cl")


def kernel_source(
    *parts: str | type[Material],
    mode: str = "rgb",
    lanes: int = 1,
    layout: str = "wide8",
    sampler: str = "independent",
    lines: bool = True,
) -> str:
    """Return OpenCL C 1.2 to stand in front of an application's own kernels.

    parts: "bvh", "random", "math", "warp" and the others of docs/kernel_library.md, "bsdf/" and the
    name of a material, or a material's class; what they share is put in once. mode: "rgb" or
    "spectral", what a Spectrum is; lanes: 1, 8 or 16, how many values a `real` is; layout: of the
    tree that "bvh" traces, that of the `Accel`; sampler: what "random" is, "independent" or
    "sobol"; lines: whether a compiler is told which of clpt's files a line is from, the lines
    behind the text are then those of "program".

    Raises SceneError for an option that is not there, UnknownKindError for such a part.
    """
    if not parts:
        raise SceneError(f"name a part, such as {', '.join(map(repr, PARTS))}", where="parts")
    options = {"mode": (mode, ("rgb", "spectral")), "lanes": (lanes, LANES)}
    options |= {"layout": (layout, bvh.TREES)}
    options |= {"sampler": (sampler, tuple(cls.kind for cls in PIXELWISE))}
    for name, (value, known) in options.items():
        if value not in known:
            raise SceneError(f"{value!r} is none of {', '.join(map(str, known))}", where=name)
    virtual: dict[str, str | device.Part | tuple[str, ...]] = {
        "generated/spectrum.cl": (f"spectra/{mode}.cl",),
        "generated/sampler.cl": (f"samplers/kinds/{sampler}.cl",),
        "generated/layout.cl": bvh.traversal_text(layout),
        **rough_coat_table.virtual_files(),
    }
    files: list[str] = []
    for part in parts:
        files += PARTS[part] if part in PARTS else _bsdf(part, mode, virtual)
    virtual["library"] = tuple(files)
    source = device.assemble("library", virtual, {"LANES": lanes}, library=True)
    text = _own_inline(source.text)
    if lines:
        return text + '#line 1 "program"\n'
    return re.sub(r"^#line .*\n", "", text, flags=re.MULTILINE)


def _own_inline(text: str) -> str:
    """Return the text with a macro of clpt's name where it redefines `inline` for itself.

    The application's own `inline` then stays what its compiler takes it for.
    """
    text = re.sub(r"^#define inline .*", "", text, flags=re.MULTILINE)
    return _INLINE + re.sub(r"^inline\b", "CLPT_INLINE", text, flags=re.MULTILINE)


def _bsdf(part: str | type[Material], mode: str, virtual: dict) -> tuple[str, ...]:
    """The files of a material kind; those that are not on disk are put into `virtual`."""
    if isinstance(part, str):
        known = {f"bsdf/{cls.kind}": cls for cls in LEAVES}
        if part not in known:
            raise UnknownKindError("part of the kernels", part, (*PARTS, *known))
        part = known[part]
    if part not in LEAVES:
        custom_materials.check(part)
        virtual[f"materials/kinds/{part.kind}.cl"] = custom_materials.text(part)
    virtual[f"generated/{part.kind}.cl"] = functions_text(part, mode)
    return (*BSDF, f"generated/{part.kind}.cl")
