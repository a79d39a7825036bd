"""The tables of kernels/materials/rough_coat.cl: integrals over a rough coat's normals, in float64.

`python -m clpt.render.materials.rough_coat_table` writes data/rough_coat.npz, which becomes text.
Isotropic microfacets of roughness alpha; eta: index of the coat over that outside, from 1 on.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats
from clpt.scene.facets import (
    BOUNCE,
    bounce,
    diffuse_mean,
    facing,
    fresnel,
    inside_reflectance,
    reflectance,
    thrown_back,
    transmittance,
)
from clpt.scene.materials import DISTRIBUTIONS

Made = Callable[[str, float, float], "Floats | float"]
Kept = dict[str, NDArray[Any]]

FILE = Path(__file__).parent / "data/rough_coat.npz"
LARGEST = 65535  # of a table's numbers, as they are kept
ALPHAS, INDICES, COSINES = 16, 14, 16
STEEPS = 6  # nodes of the incident cosine for light that a coat throws back, even in the root
HIGHEST = 3.0  # the largest index of the tables

NODES_HEAD = "/* Where the tables of rough coats and facets have their nodes. */\n"
HEAD = """\
/* Integrals over the normals of a rough coat, by distribution, roughness and index, made by
 * `python -m clpt.render.materials.rough_coat_table`, which has their formulas. A word holds a
 * number and, in its upper half, the next along the last axis; `_UNIT`: what 1 of them means. */
"""
FACETS_HEAD = """\
/* Integrals over the normals of GGX facets by roughness and index, made as those of coats. */
"""
FACETS = {  # of GGX alone
    "turned": "1, and what facets reflect less what a smooth boundary does, by cosine too",
    "turned_mean": "What facets reflect of diffuse light from outside",
}
DOCS = {
    "passed": "Transmittance over a smooth coat's, by cosine too",
    "inside": "Reflectance for diffuse light below",
    "bounce": f"Of light of cosine {BOUNCE}, what leaves facets that reflect all,"
    " by roughness alone",
    "thrown": "1, and what a smooth coat throws back of light from these less from smooth ones,"
    " by cosine",
}


def alphas() -> Floats:
    """The nodes (ALPHAS,) of roughness: even in its root."""
    return np.maximum(np.linspace(0.0, 1.0, ALPHAS) ** 2, 1e-3)


def indices() -> Floats:
    """The nodes (INDICES,) of the index: even in the root of 1 - 1 / eta."""
    roots = np.linspace(0.0, np.sqrt(1.0 - 1.0 / HIGHEST), INDICES)
    return 1.0 / np.minimum(1.0 - roots**2, 1.0 - 1e-5)


def cosines(alpha: float) -> Floats:
    """The nodes (COSINES,) for a roughness: even in the root of 1 - cos_i / facing(cos_i)."""
    share = np.maximum(1.0 - np.linspace(1.0, 0.0, COSINES) ** 2, 1e-4)
    return np.minimum(share * alpha / np.sqrt(1.0 - share**2 * (1.0 - alpha**2)), 1.0)


def _bounces() -> Floats:
    """A table by distribution and roughness."""
    return np.array([[bounce(d, a) for a in alphas()] for d in DISTRIBUTIONS])


def _rows(make: Made) -> Floats:
    """A table by distribution, roughness and index."""
    return np.array([[[make(d, a, e) for e in indices()] for a in alphas()] for d in DISTRIBUTIONS])


def _passed(distribution: str, alpha: float, eta: float) -> Floats:
    cos_i = cosines(alpha)
    smooth = 1.0 - fresnel(facing(cos_i, alpha), eta)
    return transmittance(distribution, alpha, eta, cos_i) / smooth


def _thrown(distribution: str, alpha: float, eta: float) -> Floats:
    cos_i = np.maximum(np.linspace(0.0, 1.0, STEEPS) ** 2, 1e-4)
    return 1.0 + thrown_back(distribution, alpha, eta, cos_i) - fresnel(cos_i, eta)


def _turned(alpha: float, eta: float) -> Floats:
    """Return 1 and what facets reflect less what a smooth boundary does, (COSINES,)."""
    cos_i = cosines(alpha)
    return 1.0 + reflectance("ggx", alpha, eta, cos_i) - fresnel(facing(cos_i, alpha), eta)


def _turned_mean(alpha: float, eta: float) -> float:
    return diffuse_mean(lambda cosines: reflectance("ggx", alpha, eta, cosines))


def computed() -> Kept:
    """Return the tables by name, in the order of DOCS and FACETS: a minute of work."""
    tables = {
        "turned": np.array([[_turned(a, e) for e in indices()] for a in alphas()]),
        "turned_mean": np.array([[_turned_mean(a, e) for e in indices()] for a in alphas()]),
        "passed": _rows(_passed),
        "inside": _rows(inside_reflectance),
        "bounce": _bounces(),
        "thrown": _rows(_thrown),
    }
    quantised = {}
    for name, table in tables.items():
        most = table.max()
        quantised[name] = np.round(table / most * LARGEST).astype(np.uint16)
        quantised[f"{name}_most"] = most
    return quantised


def kept() -> Kept:
    """Return the tables of FILE by name."""
    with np.load(FILE, allow_pickle=False) as file:
        return dict(file)


def _array(name: str, doc: str, shares: NDArray[np.uint16], most: float) -> str:
    """Return the text of a table: 16-bit shares of its largest number, two in a word.

    The upper half of a word is the next share along the last axis; the last share starts no word.
    """
    words = shares.astype(np.uint32)
    pairs = (words[..., :-1] | words[..., 1:] << np.uint32(16)).reshape(-1).tolist()
    lines = [f"/* {doc}. */", f"#define {name.upper()}_UNIT {most / LARGEST:.9g}f"]
    lines += [f"constant uint {name}[{len(pairs)}] = {{"]
    lines += [",".join(map(str, pairs[i : i + 10])) + "," for i in range(0, len(pairs), 10)]
    return "\n".join([*lines, "};", ""])


def nodes_text() -> str:
    """Return the text of the tables' sizes, as kernels/materials/coat_cell.cl reads them."""
    scale = (INDICES - 1) / np.sqrt(1.0 - 1.0 / HIGHEST)
    numbers = {
        "COAT_ALPHAS": ALPHAS,
        "COAT_INDICES": INDICES,
        "COAT_COSINES": COSINES,
        "COAT_STEEPS": STEEPS,
        "COAT_INDEX_SCALE": f"{scale:.9g}f",
    }
    return NODES_HEAD + "".join(f"#define {name} {value}\n" for name, value in numbers.items())


def _arrays(prefix: str, docs: dict[str, str]) -> str:
    tables = kept()
    rows = (
        _array(f"{prefix}_{name}", doc, tables[name], float(tables[f"{name}_most"]))
        for name, doc in docs.items()
    )
    return "".join(rows)


@functools.cache
def virtual_files() -> dict[str, str]:
    """Return the generated files that coat_cell, rough_coat and facet_reflectance.cl include."""
    return {
        "generated/coat_nodes.cl": nodes_text(),
        "generated/rough_coat_table.cl": HEAD + _arrays("coat", DOCS),
        "generated/facet_reflectance_table.cl": FACETS_HEAD + _arrays("facet", FACETS),
    }


if __name__ == "__main__":
    arrays: dict[str, Any] = computed()
    np.savez_compressed(FILE, **arrays)
