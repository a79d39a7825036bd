"""With how many registers a work-item of a GPU each program is to run.

Left alone, compilers take more than a program needs, and fewer work-items run at once. With these
limits no program of the scenes spills any on NVIDIA's sm_75, sm_89 and sm_90, and none has more
than 5 % more instructions: `python -m bench.gpu_compilers` measures it.
"""

from __future__ import annotations

_LIMITS = {
    "generate": 96,
    "emit": 80,
    "flight": 128,
    "intersect": 128,
    "shadow": 112,
    "splat": 112,
    "shade_diffuse": 112,
    "shade_plastic": 128,
    "shade_rough_conductor": 128,
    "shade_rough_plastic": 136,
}
_FEW = 112  # up to which AMD's compilers do with 128


def limit(program: str) -> int | None:
    """Return the most registers of a program; None where its compiler may choose."""
    return _LIMITS.get(program)


def are_few(program: str) -> bool:
    """Return whether AMD's compilers, too, are to take fewer than they would."""
    return _LIMITS.get(program, _FEW + 1) <= _FEW
