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
    parameters = []
    for declared in text.split(", "):
        name = declared.split(" ")[-1].lstrip("*")
        parameters.append((declared.removesuffix(name), name))
    return tuple(parameters)


# Functions that are short or called often stay inline: a call keeps structs in memory.
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
    """Return the functions that several kinds of a scene call; none in a single lane."""
    return [function for function in FUNCTIONS if lanes > 1 and function.shared(features)]


def calls_text(elsewhere: Sequence[Common] = ()) -> str:
    """Return the macros of calls: of functions in a part `elsewhere`, or in the same program."""
    rows = []
    for common in FUNCTIONS:
        if common in elsewhere:
            declared = ", ".join(f"{type_}{name}" for type_, name in common.parameters)
            rows.append(f"{common.returns} loop_{common.name}({declared});")
        called = f"loop_{common.name}" if common in elsewhere else common.name
        rows.append(f"#define common_{common.name} {called}")
    return "\n".join([*rows, ""])


def part_text(functions: Sequence[Common]) -> str:
    """Return the functions of the part."""
    rows = []
    for common in functions:
        declared = ", ".join(f"{type_}{name}" for type_, name in common.parameters)
        passed = ", ".join(name for _, name in common.parameters)
        rows.append(f"COMMON({common.returns}, {common.name})({declared})")
        rows.append(f"{{\n    return {common.name}({passed});\n}}")
    return "\n".join([*rows, ""])
