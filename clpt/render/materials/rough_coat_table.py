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
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray

from clpt.arrays import Floats
from clpt.scene.materials import DISTRIBUTIONS

Made = Callable[[str, float, float], "Floats | float"]
Kept = dict[str, NDArray[Any]]

FILE = Path(__file__).parent / "data/rough_coat.npz"
LARGEST = 65535  # of a table's numbers, as they are kept
ALPHAS, INDICES, COSINES = 16, 14, 16
STEEPS = 6  # nodes of the incident cosine for light that a coat throws back, even in the root
HIGHEST = 3.0  # the largest index of the tables
BOUNCE = 0.77  # cosine of light within a coat, see kernels/materials/kinds/coated_conductor.cl
_RADII, _AZIMUTHS = leggauss(40), 48

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


def facing(cos_i: Floats, alpha: float) -> Floats:
    """Return a typical cosine between a direction of cosine cos_i and the facets that it sees."""
    return np.sqrt(cos_i**2 + alpha**2 * (1.0 - cos_i**2))


def cosines(alpha: float) -> Floats:
    """The nodes (COSINES,) for a roughness: even in the root of 1 - cos_i / facing(cos_i)."""
    share = np.maximum(1.0 - np.linspace(1.0, 0.0, COSINES) ** 2, 1e-4)
    return np.minimum(share * alpha / np.sqrt(1.0 - share**2 * (1.0 - alpha**2)), 1.0)


def fresnel(cos_i: Floats, eta: float) -> Floats:
    """Reflectance of a smooth boundary, met at cosines above 0 (Born and Wolf 1999, 1.5.2)."""
    cos2 = 1.0 - (1.0 - cos_i**2) / eta**2
    cos_t = np.sqrt(np.maximum(cos2, 0.0))
    across = (cos_i - eta * cos_t) / np.maximum(cos_i + eta * cos_t, 1e-300)
    along = (eta * cos_i - cos_t) / np.maximum(eta * cos_i + cos_t, 1e-300)
    return np.where(cos2 <= 0.0, 1.0, 0.5 * (across**2 + along**2))


def masking(distribution: str, alpha: float, z: Floats) -> Floats:
    """Smith's G1 of directions with these cosines, as in kernels/materials/microfacet.cl."""
    z = np.clip(z, 0.0, 1.0)
    spread = alpha * np.sqrt(1.0 - z**2)
    if distribution == "ggx":
        return 2.0 * z / np.maximum(z + np.sqrt(z**2 + spread**2), 1e-300)
    a = z / np.maximum(spread, 1e-300)
    near = np.minimum(a, 1.6)
    fit = near * (3.535 + 2.181 * near) / (1.0 + near * (2.276 + 2.577 * near))
    return np.where(a < 1.6, fit, 1.0)


def _mean(distribution: str, alpha: float, cos_i: Floats, value: Callable[..., Floats]) -> Floats:
    """Mean of value(cosine to the normal, normal's z) over the normals that cos_i (n,) sees."""
    nodes, weights = _RADII
    v = 0.5 * (nodes + 1.0)  # 1 - v^2: share of projected area with smaller slopes
    slope = np.sqrt(1.0 - v**2) / v if distribution == "ggx" else np.sqrt(-2.0 * np.log(v))
    radius = (alpha * slope)[:, None]
    turn = np.cos((np.arange(_AZIMUTHS) + 0.5) / _AZIMUTHS * np.pi)
    cos_i = cos_i[:, None, None]
    cos_h = 1.0 / np.sqrt(1.0 + radius**2)
    area = np.maximum(cos_i + np.sqrt(1.0 - cos_i**2) * radius * turn, 0.0)
    cosine = np.minimum(area * cos_h, 1.0)
    area = area * (weights * v)[:, None]
    weighted = area * value(cos_i, np.maximum(cosine, 1e-12), cos_h)
    return weighted.sum((1, 2)) / area.sum((1, 2))


def transmittance(distribution: str, alpha: float, eta: float, cos_i: Floats) -> Floats:
    """Mean of (1 - F) G1(refracted direction) for light from outside: what Mitsuba 3 tabulates."""

    def passed(cos_i: Floats, c: Floats, cos_h: Floats) -> Floats:
        cos_t = np.sqrt(np.maximum(1.0 - (1.0 - c**2) / eta**2, 0.0))
        z = cos_i / eta + (cos_t - c / eta) * cos_h
        return (1.0 - fresnel(c, eta)) * masking(distribution, alpha, z)

    return _mean(distribution, alpha, cos_i, passed)


def reflectance(distribution: str, alpha: float, eta: float, cos_i: Floats) -> Floats:
    """Mean of F(c) G1(reflected direction), for eta behind the facets over that before them."""

    def thrown(cos_i: Floats, c: Floats, cos_h: Floats) -> Floats:
        return fresnel(c, eta) * masking(distribution, alpha, 2.0 * c * cos_h - cos_i)

    return _mean(distribution, alpha, cos_i, thrown)


def inside_reflectance(distribution: str, alpha: float, eta: float) -> float:
    """Return the share of diffuse light from below that a coat reflects, less what facets mask.

    A mean over 64 cosines, ends included, as Mitsuba 3 takes it: of a smooth coat of index 1.5 that
    is 1.5 % less than the integral.
    """
    cos_i = np.maximum(np.linspace(0.0, 1.0, 64), 1e-6)
    return float(2.0 * (cos_i * reflectance(distribution, alpha, 1.0 / eta, cos_i)).mean())


def bounce(distribution: str, alpha: float) -> float:
    """Return the share of light of cosine BOUNCE that leaves facets which reflect all."""

    def kept(cos_i: Floats, c: Floats, cos_h: Floats) -> Floats:
        return masking(distribution, alpha, 2.0 * c * cos_h - cos_i)

    return float(_mean(distribution, alpha, np.array([BOUNCE]), kept)[0])


def within(cos_i: Floats, eta: float) -> Floats:
    """Return the cosines of refracted light within a smooth coat."""
    return np.sqrt(1.0 - (1.0 - cos_i**2) / eta**2)


def thrown_back(distribution: str, alpha: float, eta: float, cos_i: Floats) -> Floats:
    """Return the share of light from white facets below that a smooth coat throws back.

    cos_i (n,): the cosines of the incident light outside of the coat.
    """

    def thrown(cos_i: Floats, c: Floats, cos_h: Floats) -> Floats:
        z = np.clip(2.0 * c * cos_h - cos_i, 1e-12, 1.0)
        return masking(distribution, alpha, z) * fresnel(z, 1.0 / eta)

    return _mean(distribution, alpha, within(cos_i, eta), thrown)


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


def turned_mean(alpha: float, eta: float) -> float:
    """Return the share of diffuse light from outside that GGX facets reflect."""
    nodes, weights = leggauss(32)
    root = 0.5 * (nodes + 1.0)  # of the cosine
    turned = reflectance("ggx", alpha, eta, root**2)
    return float((weights * 2.0 * root**3 * turned).sum())


def computed() -> Kept:
    """Return the tables by name, in the order of DOCS and FACETS: a minute of work."""
    tables = {
        "turned": np.array([[_turned(a, e) for e in indices()] for a in alphas()]),
        "turned_mean": np.array([[turned_mean(a, e) for e in indices()] for a in alphas()]),
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
