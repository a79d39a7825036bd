"""Functions that shading has in common for several kinds of materials, compiled once for the loop.

In a program of its own a kind has them inline. In the loop they are a part of its own, which no
kind's flags reach: `common.cl`. Shading calls `common_<name>` in both.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from clpt.render.flow import flags
from clpt.render.records import Features
from clpt.scene.scatterer import Scatterer


@dataclass(frozen=True)
class Common:
    """A function: its type, name and parameters (types and names), and which kinds call it."""

    returns: str
    name: str
    parameters: tuple[tuple[str, str], ...]
    calls: Callable[[Features, type[Scatterer]], object]

    def shared(self, features: Features) -> bool:
        """Whether several kinds of a scene call it."""
        return sum(bool(self.calls(features, cls)) for cls in features.materials.leaves) > 1


def _parameters(text: str) -> tuple[tuple[str, str], ...]:
    """Split declared parameters into types and names."""
    found = []
    for one in text.split(", "):
        name = one.split(" ")[-1].lstrip("*")
        found.append((one.removesuffix(name), name))
    return tuple(found)


# What is short or called often stays inline: a call keeps structs in memory.
FUNCTIONS = (
    Common(
        "Surface",
        "surface_load",
        _parameters("Scene scene, Slab hit, uint at, mask active, vec3 o, vec3 d, mask *front"),
        lambda f, cls: not cls.is_phase,
    ),
    Common(
        "LightSample",
        "light_sample",
        _parameters(
            "Scene scene, vec3 p, Receiver receiver, real pick, vec2 u, Wavelengths lambdas"
        ),
        lambda f, cls: f.lights.kinds and not cls.delta,
    ),
    Common(
        "real",
        "light_begins_pdf",
        _parameters(
            "Scene scene, integer row, vec3 p, Receiver receiver, vec3 wi, real t, vec3 n, "
            "real *found"
        ),
        lambda f, cls: f.transport.balanced and not flags.is_null(f, cls),
    ),
    Common(
        "real",
        "light_tree_pmf",
        _parameters("Scene scene, integer row, vec3 p, Receiver receiver"),
        flags.asks_chance,
    ),
)


def shared(features: Features, lanes: int) -> list[Common]:
    """Return the functions that several kinds of a scene call: none in one lane, as on GPUs."""
    return [one for one in FUNCTIONS if lanes > 1 and one.shared(features)]


def calls_text(elsewhere: Sequence[Common] = ()) -> str:
    """Return what shading calls: functions of the part, where they are `elsewhere`, or its own."""
    rows = []
    for one in FUNCTIONS:
        if one in elsewhere:
            declared = ", ".join(f"{type_}{name}" for type_, name in one.parameters)
            rows.append(f"{one.returns} loop_{one.name}({declared});")
        called = f"loop_{one.name}" if one in elsewhere else one.name
        rows.append(f"#define common_{one.name} {called}")
    return "\n".join([*rows, ""])


def part_text(functions: Sequence[Common]) -> str:
    """Return the functions of the part."""
    rows = []
    for one in functions:
        declared = ", ".join(f"{type_}{name}" for type_, name in one.parameters)
        passed = ", ".join(name for _, name in one.parameters)
        rows.append(f"COMMON({one.returns}, {one.name})({declared})")
        rows.append(f"{{\n    return {one.name}({passed});\n}}")
    return "\n".join([*rows, ""])
