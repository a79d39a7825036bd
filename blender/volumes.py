# SPDX-License-Identifier: GPL-3.0-or-later
"""Volume shaders as media: homogeneous ones, and grids of OpenVDB files."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from .graphs import Json, Site, origin
from .nodes import Tree

Sums = dict[str, np.ndarray]  # what a metre absorbs, scatters and emits, by three colors
NOTHING = (0.0, 0.0, 0.0)


def medium(tree: Tree, node: Any, *, file: str = "") -> Json | None:
    """Return what fills the inside of a material, None for nothing.

    node: the material's output; file: of a grid that multiplies the density.
    """
    site, _ = origin((), node.inputs["Volume"])
    if site is None:
        return None
    sums: Sums = {key: np.zeros(3) for key in ("absorbed", "scattered", "emitted")}
    phases: list[Json] = []
    _add(tree, site, sums, phases, grid=bool(file))
    if not any(part.any() for part in sums.values()):
        return None
    kind = {"type": "grid", "density": file} if file else {"type": "homogeneous"}
    made: Json = {
        **kind, "sigma_a": sums["absorbed"].tolist(), "sigma_s": sums["scattered"].tolist(),
    }  # fmt: skip
    if sums["emitted"].any():
        if (sums["absorbed"][sums["emitted"] > 0.0] <= 0.0).any():
            made["sigma_a"] = np.maximum(sums["absorbed"], 1e-6).tolist()
        made["emission"] = (sums["emitted"] / np.maximum(made["sigma_a"], 1e-6)).tolist()
    if phases:
        made["phase"] = phases[0]
        if any(phase != phases[0] for phase in phases):
            tree.tell("of several phase functions of a volume the first one counts")
    return made


def _add(tree: Tree, at: Site, sums: Sums, phases: list[Json], *, grid: bool) -> None:
    """Add what a volume shader does to the sums, and its phase function."""
    node = at.node
    if node.type in ("ADD_SHADER", "MIX_SHADER"):
        mixed = node.type == "MIX_SHADER"
        share = tree.single(at, "Fac", 0.5) if mixed else 1.0
        for i in (0, 1):
            site = origin(at.groups, node.inputs[i + mixed])[0]
            if site is not None:
                part = {key: np.zeros(3) for key in sums}
                _add(tree, site, part, phases, grid=grid)
                weight = (share if i else 1.0 - share) if mixed else 1.0
                for key, value in part.items():
                    sums[key] += weight * value
        return
    density = node.inputs.get("Density")
    attribute = grid and density is not None and density.is_linked  # which is the grid's own
    density = 1.0 if attribute else tree.single(at, "Density", 1.0)
    if node.type == "VOLUME_ABSORPTION":
        sums["absorbed"] += density * np.maximum(1.0 - _color(tree, at, "Color"), 0.0)
    elif node.type == "VOLUME_SCATTER":
        sums["scattered"] += density * _color(tree, at, "Color")
        phases.append(_phase(tree, at))
    elif node.type == "PRINCIPLED_VOLUME":
        color = _color(tree, at, "Color")
        kept = np.sqrt(np.clip(_color(tree, at, "Absorption Color"), 0.0, 1.0))
        sums["scattered"] += density * color
        sums["absorbed"] += density * np.maximum(1.0 - color, 0.0) * (1.0 - kept)
        strength = tree.single(at, "Emission Strength")
        sums["emitted"] += strength * _color(tree, at, "Emission Color")
        if tree.single(at, "Blackbody Intensity") > 0.0:
            tree.tell("Blackbody Intensity of a volume is left out")
        phases.append(_phase(tree, at))
    elif node.type == "VOLUME_COEFFICIENTS":
        sums["absorbed"] += _color(tree, at, "Absorption Coefficients")
        sums["scattered"] += _color(tree, at, "Scatter Coefficients")
        sums["emitted"] += _color(tree, at, "Emission Coefficients")
        phases.append(_phase(tree, at))
    elif node.type == "EMISSION":
        sums["emitted"] += tree.single(at, "Strength", 1.0) * _color(tree, at, "Color")
    else:
        tree.tell(f"{node.bl_label} as a volume is not read")


def _color(tree: Tree, at: Site, key: str) -> np.ndarray:
    color = tree.made(lambda e: e.input(at, key), wide=True)
    if isinstance(color, dict):
        tree.tell(f"{key} of {at.node.bl_label} cannot vary")
        color = NOTHING if key.startswith("Emission") else [0.5] * 3
    return np.maximum(np.array(color, np.float64), 0.0)


def _phase(tree: Tree, at: Site) -> Json:
    kind = "HENYEY_GREENSTEIN" if at.node.type == "PRINCIPLED_VOLUME" else at.node.phase
    g = min(max(tree.single(at, "Anisotropy"), -0.999), 0.999)
    if kind == "RAYLEIGH":
        return {"type": "rayleigh"}
    if kind == "DRAINE":
        return {"type": "draine", "g": g, "alpha": tree.single(at, "Alpha", 0.5)}
    if kind == "MIE":
        return _mie(tree.single(at, "Diameter", 20.0))
    if kind == "FOURNIER_FORAND":
        tree.tell("the phase function Fournier-Forand is read as Henyey-Greenstein's of .92")
        g = 0.92
    return {"type": "henyey_greenstein", "g": g} if g else {"type": "isotropic"}


def _mie(d: float) -> Json:
    """Return the phase function of fog of drops of a diameter [um]: Jendersie and d'Eon 2023."""
    d = min(max(d, 5.0), 50.0)
    forward = math.exp(-0.0990567 / (d - 1.67154))
    g = math.exp(-2.20679 / (d + 3.91029) - 0.428934)
    alpha = math.exp(3.62489 - 8.29288 / (d + 5.52825))
    share = math.exp(-0.599085 / (d - 0.641583) - 0.665888)
    return {
        "type": "blend", "first": {"type": "henyey_greenstein", "g": min(forward, 0.999)},
        "second": {"type": "draine", "g": g, "alpha": alpha}, "weight": share,
    }  # fmt: skip
