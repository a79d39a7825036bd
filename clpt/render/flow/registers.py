"""The fewest registers that a work-item of a GPU is to have, by program.

Left alone, compilers take more than some programs need, and fewer work-items run at once. These
limits are tried by `native_programs.with_fewest_registers`. A program within a limit that does not
spill has at most 4 % more instructions: `python -m bench.gpu_compilers` uses them.
"""

from __future__ import annotations

_LIMITS: dict[str, tuple[int, ...]] = {
    "generate": (96, 112),
    "flight": (128, 144),
    "intersect": (96, 128),
    "shadow": (80, 96),
    "splat": (80, 96),
    "shade_diffuse": (80, 96, 112),
    "shade_dielectric": (112,),
    "shade_plastic": (96, 112),
    "shade_rough_conductor": (112, 128),
    "shade_rough_plastic": (112, 128),
    "shade_rough_dielectric": (112, 128),
}
_OF_AMD = {
    **dict.fromkeys(("generate", "emit", "shadow", "splat"), 128),
    "shade_reradiating": 96,
    **dict.fromkeys(("shade_diffuse", "shade_rough_plastic"), 168),
}


def limits(program: str) -> tuple[int, ...]:
    """Return the limits to try for a program; none where its compiler may choose."""
    return _LIMITS.get(program, ())


def of_amd(program: str) -> int | None:
    """Return the registers that a program's text allows AMD's compilers; None: they choose."""
    return _OF_AMD.get(program)
