"""Writes the tables of figures in README.md and docs/*.md: `python -m docs.figures`.

A table stands between <!-- figures: NAME --> and <!-- end of figures -->. NAME is a function of
`TABLES`; its numbers are the newest records of bench/results, or measured in the gallery's files.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from bench.peer_figures import gain
from bench.report import POCL, RESULTS, peer_films, table
from bench.report import newest as report_newest

from .pictures import gallery as pictures

ROOT = Path(__file__).resolve().parents[1]
PLACE = re.compile(r"(<!-- figures: (\w+) -->\n).*?(<!-- end of figures -->)", re.S)
AVX2 = "AMD EPYC avx2"
FILMS = {"preview": AVX2, "final": "Intel(R) Xeon(R) Processor avx512f"}  # and their processors
KINDS = ("noisy", "`oidn`", "`statistical`")
NAMES = {"cornell": "Cornell box", "glass": "glass with caustics"}

Record = dict[str, Any]


def written(page: str) -> str:
    """Return a page with its tables made anew; an unknown name raises KeyError."""
    return PLACE.sub(lambda match: f"{match[1]}\n{TABLES[match[2]]()}\n{match[3]}", page)


def pages() -> list[Path]:
    """Return the pages that may have figures."""
    return [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


@cache
def records() -> list[Record]:
    """Return all records of bench/results, the oldest first."""
    lines = [line for file in sorted(RESULTS.glob("2*.jsonl")) for line in file.open("rb")]
    return sorted(map(json.loads, lines), key=lambda record: str(record["date"]))


def newest(bench: str, **about: object) -> Record:
    """Return the newest record of a bench with these values; raises KeyError if there is none."""
    for record in reversed(records()):
        if record["bench"] == bench and about.items() <= record.items():
            return record
    raise KeyError(f"bench/results has no {bench} with {about}")


def names(bench: str, name: str, **about: object) -> list[str]:
    """Return the values that a name has in the records of a bench, in the order of their coming."""
    found = [r[name] for r in records() if r["bench"] == bench and about.items() <= r.items()]
    return list(dict.fromkeys(found))


def shown(value: float) -> str:
    """Return two or three digits."""
    return f"{value:.3g}" if value >= 10 else f"{value:.2f}"


def efficiency() -> str:
    """Return clpt's efficiency over Mitsuba's on scenes of others, each as `clpt render` does."""
    every = [row for row in records() if row["bench"] == "peers" and row["mode"] == "rgb"]
    columns: dict[str, dict[str, float]] = {}
    for name, processor in FILMS.items():
        rows = [row for row in every if row["processor"] == processor]
        films = peer_films(report_newest(rows))
        for scene, group in films.get((name, "rgb", POCL, False), {}).items():
            by_name = {row["contender"]: row for row in group}
            ratio, _ = gain(by_name["file"], by_name["mitsuba"])
            columns.setdefault(name, {})[scene] = ratio
    scenes = sorted({scene for column in columns.values() for scene in column})
    body = [
        [s.replace("_", " "), *(f"{c[s]:.1f}" if s in c else "" for c in columns.values())]
        for s in scenes
    ]
    means = (float(np.exp(np.mean(np.log([*c.values()])))) for c in columns.values())
    body.append(["geometric mean", *(f"{mean:.1f}" for mean in means)])
    return table(["clpt : Mitsuba 3", *columns], body)


def samplers() -> str:
    """Return the errors of 64 samples by each sampler."""
    about = {"processor": AVX2, "mode": "rgb", "renderer": "clpt", "threads": 1}
    kinds = ("sobol", "independent")
    body = [
        [
            NAMES.get(scene, scene),
            *(f"{newest('renders', scene=scene, sampler=k, **about)['relmse']:.4f}" for k in kinds),
        ]
        for scene in ("cornell", "atrium", "glass")
    ]
    return table(["scene", *(f"`{kind}`" for kind in kinds)], body)


def modes() -> str:
    """Return what wavelengths cost beside RGB."""
    body = []
    for name, what in (("time_ratio", "time"), ("relmse_ratio", "error")):
        for scene in ("cornell", "atrium"):
            value = newest("spectral", processor=AVX2, scene=scene)[name]
            body.append([f"{what}, {NAMES.get(scene, scene)}", "1", f"{value:.2f}"])
    for name, what in (("cold", "without"), ("warm", "with")):
        own = [newest("startup", renderer="clpt", mode=mode)[name] for mode in ("rgb", "spectral")]
        body.append([f"start {what} caches", *(f"{seconds:.1f} s" for seconds in own)])
    return table(["", "`rgb`", "`spectral`"], body)


def effects() -> str:
    """Return what effects of wavelengths cost."""
    found = [newest("effects", effect=effect) for effect in names("effects", "effect")]
    return table(
        ["effect", "time", "variance"],
        ([r["effect"], shown(r["time_ratio"]), shown(r["variance_ratio"])] for r in found),
    )


def layouts() -> str:
    """Return rates of rays by the layout of the tree."""
    kinds = ("wide8", "compact", "binary")
    about = {"processor": AVX2, "scene": "atrium", "rays": "diffuse", "query": "closest"}
    rates = [newest("rays", layout=kind, **about)["value"] for kind in kinds]
    return table(
        ["layout", *(f"`{kind}`" for kind in kinds)],
        [["million rays a second", *(f"{rate:.1f}" for rate in rates)]],
    )


def sizes() -> str:
    """Return time and memory by the number of triangles."""
    found = [newest("sizes", triangles=count) for count in sorted(names("sizes", "triangles"))]
    return table(
        ["triangles", "time of a ray [µs]", "memory at the peak [GiB]"],
        (
            [f"{r['triangles']:,}", f"{r['us_per_ray']:.2f}", f"{r['peak'] / 2**30:.2f}"]
            for r in found
        ),
    )


def denoisers() -> str:
    """Return how much less error denoised pictures have: both denoisers, by samples."""
    body = []
    for scene in names("denoising", "scene"):
        cells = [f"`{scene}`"]
        for figure in ("gain", "bands_gain"):
            for spp in (16, 64):
                figures = [f"{kind}, {spp} spp" for kind in ("oidn", "statistical")]
                own = [newest("denoising", scene=scene, figure=f)[figure] for f in figures]
                cells.append(" : ".join(f"{value:.3g}" for value in own))
        body.append(cells)
    heads = ["gain, `oidn` : `statistical`", "16 samples", "64 samples", "bands, 16", "bands, 64"]
    return table(heads, body)


def bands() -> str:
    """Return errors of bands and of their colours, noisy and denoised."""
    body = []
    for scene in names("denoising", "scene"):
        cells = [f"`{scene}`"]
        for spp in (16, 64):
            both = [
                newest("denoising", scene=scene, figure=f"{kind}, {spp} spp")
                for kind in ("oidn", "statistical")
            ]
            pairs = [(both[0]["noisy_rms"], both[0]["noisy_delta_e"])]
            pairs += [(record["rms"], record["delta_e"]) for record in both]
            cells += [f"{rms:.3f}, {delta:.1f}" for rms, delta in pairs]
        body.append(cells)
    heads = ["rms of bands, then CIEDE2000 of their colours"]
    heads += [
        f"noisy, {spp}" if k == 0 else kind for spp in (16, 64) for k, kind in enumerate(KINDS)
    ]
    return table(heads, body)


def queries() -> str:
    """Return rates of ray queries beside the bare kernel's and embreex's."""
    body = []
    for rays in ("primary", "diffuse", "shadow"):
        for query, shown in (("closest", "closest"), ("occluded", "any")):
            found = newest("queries", rays=rays, query=query)
            over = f"{found['overhead']:.2f}, {found['overhead_host']:.2f}"
            rates = (f"{found[name]:.1f}" for name in ("mrays", "mrays_embreex"))
            body.append([rays, shown, over, *rates])
    heads = ["rays", "query", "time over the bare kernel's: on the device, from numpy"]
    return table([*heads, "Mrays/s a core", "embreex"], body)


def media() -> str:
    """Return clpt's efficiency in media over the better of Mitsuba's integrators."""
    about = {"renderer": "clpt"}
    body = []
    both = [set(names("media", "scene", mode=mode, **about)) for mode in ("rgb", "spectral")]
    for scene in sorted(set.intersection(*both)):
        own = [newest("media", scene=scene, mode=m, **about) for m in ("rgb", "spectral")]
        body.append([scene, *(f"{record['efficiency_ratio']:.1f}" for record in own)])
    return table(["scene", "RGB", "spectral"], body)


def gallery() -> str:
    """Return sizes and noise of the gallery's pictures."""
    body = (
        [
            f"`{p.name}`",
            "x".join(map(str, p.size)),
            f"{p.grain:.0f}",
            f"{p.mean:.2f}",
            f"{p.sparks:.3%}".replace("%", " %"),
        ]
        for p in pictures.pictures()
    )
    return table(["picture", "pixels", "median", "mean", "bright pixels"], body)


TABLES: dict[str, Callable[[], str]] = {
    one.__name__: one
    for one in (
        efficiency,
        samplers,
        modes,
        effects,
        layouts,
        sizes,
        denoisers,
        bands,
        queries,
        media,
        gallery,
    )
}


def main() -> None:
    for page in pages():
        text = page.read_text("utf-8")
        if (new := written(text)) != text:
            page.write_text(new, "utf-8")
            print(page.relative_to(ROOT))


if __name__ == "__main__":
    main()
