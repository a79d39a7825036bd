"""`python -m bench.report` makes bench/results/README.md from the JSON lines beside it.

It makes a section of gpus.md too, see `bench.gpu_page`.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np

from bench import gpu_page
from bench.peer_figures import gain, rate

RESULTS = Path(__file__).parent / "results"
POCL = "Portable Computing Language"  # its platform's name
WHICH = (
    "scene", "mode", "renderer", "sampler", "threads", "layout", "rays", "query", "effect",
    "figure", "triangles", "builder", "bent", "as_file", "size", "benchmark_version", "way",
    "runtime", "film", "contender",
)  # fmt: skip

HEAD = """# What was measured

Made by `python -m bench.report` from the JSON lines beside it, which `make bench` writes; the
newest record of each figure. What the figures mean: the first lines of `bench/*.py`. What was
tried: `bench/notes`.
"""

Row = dict[str, object]


def newest(records: Iterable[Row]) -> list[Row]:
    """Return the last record of each figure, in the order of first records."""
    kept = {
        json.dumps([r["bench"], r.get("device"), *(r.get(name) for name in WHICH)]): r
        for r in records
    }
    return list(kept.values())


def table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [headings, ["---"] * len(headings), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def renders(rows: Sequence[Row]) -> str:
    """Pictures against Mitsuba's."""

    def cells(row: Row) -> list[str]:
        off = (np.array(row["mean_ratio"]) - 1) * 100
        worst = int(np.abs(off).argmax())
        ratios = (row.get(f"{name}_ratio") for name in ("speed", "cpu", "efficiency"))
        return [
            *(str(row[name]) for name in ("scene", "mode", "renderer", "sampler", "threads")),
            f"{row['msamples']:.3f}",
            f"{row['relmse']:.4f} / {row['relmse_trimmed']:.4f}",
            f"{row['efficiency']:.2f}",
            *("" if ratio is None else f"**{ratio:.2f}**" for ratio in ratios),
            f"{off[worst]:+.2f} ± {row['mean_ratio_se'][worst] * 100:.2f} %",
        ]

    headings = [
        *("scene", "mode", "renderer", "sampler", "threads", "Msamples/s"),
        *("relMSE / trimmed", "efficiency", "speed : Mitsuba", "by CPU time"),
        "efficiency : Mitsuba",
        "mean - reference",
    ]
    return table(headings, map(cells, rows)) + "\n" + stages(rows)


def stages(rows: Sequence[Row]) -> str:
    """Where clpt's time goes, milliseconds per million closest-hit rays."""
    with_stages = [row for row in rows if "stages" in row]
    names = list(
        dict.fromkeys(name for row in with_stages for name in row["stages"]["milliseconds"])
    )

    def cells(row: Row) -> list[str]:
        taken = row["stages"]["milliseconds"]
        million = row["stages"]["rays"]["closest"] * 1e-6
        each = (f"{taken[name] / million:.1f}" if name in taken else "" for name in names)
        return [row["scene"], row["mode"], row["stages"]["layout"], *each]

    text = "Milliseconds per million closest-hit rays, by the device's clock:\n\n"
    return text + table(["scene", "mode", "layout", *names], map(cells, with_stages))


def starting(rows: Sequence[Row]) -> str:
    """Whole processes: processor time with all children; in brackets by the clock."""
    names = ("cold", "another", "warm")

    def cells(row: Row) -> list[str]:
        times = (
            f"{row[name]:.2f} s ({row[f'{name}_clock']:.2f} s)" if name in row else ""
            for name in names
        )
        memory = (f"{row[f'{name}_memory'] / 2**20:.0f} MiB" for name in ("cold", "warm"))
        ours = row["renderer"] == "clpt"
        device = str(row.get("device", "")) if ours else ""
        return [str(row["scene"]), str(row["renderer"]), device, *times, *memory]

    newest = {(row["scene"], row["renderer"], row.get("device")): row for row in rows}
    heads = ["scene", "renderer", "device", *names, "peak cold", "peak warm"]
    return table(heads, map(cells, newest.values()))


def plain(rows: Sequence[Row]) -> str:
    """Records as they are, without what is the same for all."""
    about = {"bench", "date", "clpt", "commit", "processor", "cores", "load", "device"}
    if len({row.get("device") for row in rows}) > 1:
        about.remove("device")
    names = [
        name for name in dict.fromkeys(key for row in rows for key in row) if name not in about
    ]

    def cell(value: object) -> str:
        return f"{value:.4g}" if isinstance(value, float) else str(value)

    return table(names, ([cell(row.get(name, "")) for name in names] for row in rows))


def queries(rows: Sequence[Row]) -> str:
    """Ray queries beside the bare kernel and embreex, then calls with few rays in microseconds."""
    parts = [[row for row in rows if name in row] for name in ("overhead", "python_us")]
    return "\n".join(plain(part) for part in parts if part)


def figures(rows: Sequence[Row]) -> str:
    """By `clpt bench`: medians of rounds; ± is half the distance of their quartiles."""

    def cells(row: Row) -> list[str]:
        moved = (f"{row['gbytes']:.2f}", f"{row['of_copy']:.1%}") if "gbytes" in row else ("", "")
        built = f"{row['build_seconds']:.2f} s" if "build_seconds" in row else ""
        about = (str(row.get(name, "")) for name in ("scene", "mode", "figure"))
        value = row.get("refused") or f"{row['value']:.3g} {row['unit']}"
        return [row["device"], *about, value, f"{row['spread']:.1%}", *moved, built]

    headings = ("device", "scene", "mode", "figure", "", "±", "GB/s", "of a copy", "programs")
    return table(headings, map(cells, rows))


def peers(rows: Sequence[Row]) -> str:
    """Scenes of others as their files are: clpt's efficiency over each contender, and its error."""
    parts = []
    for (film, mode, runtime, as_file), every in peer_films(rows).items():
        names = list(dict.fromkeys(str(r["contender"]) for group in every.values() for r in group))
        body, gains = [], {name: [] for name in names}
        for scene, group in every.items():
            by_name = {str(row["contender"]): row for row in group}
            own = by_name["file"]
            cells = [scene, f"{rate(own):.2f}", f"{np.mean(own['relmse']):.4f}"]
            for name in names:
                if name not in by_name:
                    cells.append("")
                    continue
                ratio, error = gain(own, by_name[name])
                gains[name].append(ratio)
                cells.append("" if name == "file" else f"{ratio:.2f} ± {error:.2f}")
            body.append(cells)
        means = (
            "" if name == "file" else f"{np.exp(np.mean(np.log(gains[name]))):.2f}"
            for name in names
        )
        body.append(["geometric mean", "", "", *means])
        heads = ["scene", "Msamples/s", "relMSE", *names]
        filtered = "the file's filter" if as_file else "box filter"
        parts.append(f"{film}, {mode}, {runtime}, {filtered}:\n\n" + table(heads, body))
    return "\n".join(parts)


def runtime_of(row: Row) -> str:
    """OpenCL's platform; PoCL in rows that do not say so."""
    return str(row.get("runtime", POCL))


def peer_films(rows: Sequence[Row]) -> dict[tuple[object, ...], dict[str, list[Row]]]:
    """The rows of `bench.peers` by film, mode, runtime and filter, and then by scene."""
    films: dict[tuple[object, ...], dict[str, list[Row]]] = {}
    for row in rows:
        film = (row["film"], row["mode"], runtime_of(row), row["as_file"])
        films.setdefault(film, {}).setdefault(str(row["scene"]), []).append(row)
    return films


def hard_light(rows: Sequence[Row]) -> str:
    """Caustics: errors after equal processor time, and the light that was found."""

    def cells(row: Row) -> list[str]:
        texts = [str(row[name]) for name in ("scene", "renderer", "cpu", "samples", "seeds")]
        for part in ("direct", "sharp"):
            part_figures = row.get(part)
            assert part_figures is None or isinstance(part_figures, dict)
            texts += (
                [
                    f"{part_figures['relmse']:.2g}",
                    f"{part_figures['light']:.3f} ({part_figures['light_kept']:.3f})",
                ]
                if part_figures
                else ["", ""]
            )
        return texts

    headings = ["scene", "method", "seconds", "samples", "seeds", "relMSE, direct", "light"]
    return table([*headings, "relMSE, sharp", "light"], map(cells, rows))


def media(rows: Sequence[Row]) -> str:
    """Light in media beside Mitsuba's, without the worst hundredth of the pixels."""

    def cells(row: Row) -> list[str]:
        ratio = row.get("efficiency_ratio")
        return [
            *(str(row[name]) for name in ("scene", "mode", "renderer", "spp")),
            f"{row['msamples']:.3f}",
            f"{row['relmse_99']:.4g}",
            f"{row['efficiency_99']:.3g}",
            "" if ratio is None else f"**{ratio:.2f}**",
            f"{row['bias'] * 100:+.2f} ± {row['bias_se'] * 100:.2f} %",
        ]

    headings = ["scene", "mode", "renderer", "samples", "Msamples/s", "relMSE", "efficiency"]
    return table([*headings, "over the best of Mitsuba's", "bias"], map(cells, rows))


def sizes(rows: Sequence[Row]) -> str:
    """Hilly ground with growing numbers of triangles, the same picture; a ray's time is plotted in
    `sizes.png`.
    """

    def cells(row: Row) -> list[str]:
        count = int(str(row["triangles"]))
        return [
            f"{count:,}",
            *(f"{row[name]:.2f}" for name in ("cpu_load", "seconds_lower", "seconds_build")),
            f"{row['peak'] / 2**20:,.0f}",
            *(f"{row[f'{name}_bytes'] / count:.0f}" for name in ("tree", "table")),
            f"{row['largest_buffer'] / row['max_alloc']:.1%}",
            f"{row['us_per_sample']:.2f}",
            f"{row['us_per_ray']:.3f}",
        ]

    headings = ["triangles", "load [s]", "lower [s]", "build [s]", "peak [MiB]"]
    headings += ["tree [bytes / triangle]", "tables [bytes / triangle]"]
    headings += ["largest buffer of what is allowed", "µs a sample", "µs a ray"]
    return table(headings, map(cells, rows))


def shares(rows: Sequence[Row]) -> str:
    """Milliseconds per million closest-hit rays by stage, and the same rays in a bare kernel."""

    def cells(row: Row) -> list[str]:
        taken = dict(row["ms"])
        named = ("bare closest", "intersect", "bare occluded", "shadow", "generate")
        first = [taken.pop(name, None) for name in named]
        share = row.get("beyond")
        return [
            *(str(row[name]) for name in ("scene", "mode")),
            *("" if ms is None else f"{ms:.0f}" for ms in first),
            ", ".join(f"{name} {ms:.0f}" for name, ms in taken.items()),
            "" if share is None else f"{share:.0%}",
        ]

    headings = ["scene", "mode", "bare closest", "intersect", "bare any", "shadow", "generate"]
    return table([*headings, "other stages", "beyond bare rays"], map(cells, rows))


TABLES: dict[str, Callable[[Sequence[Row]], str]] = {
    **dict.fromkeys(("bandwidth", "rays", "stages", "shading", "build", "start"), figures),
    "renders": renders,
    "peers": peers,
    "sharing": plain,
    "efficiency": plain,
    "hard_light": hard_light,
    "media": media,
    "voxels": plain,
    "colours": plain,
    "lanes": plain,
    "spectral": plain,
    "effects": plain,
    "lights": plain,
    "noise": plain,
    "queries": queries,
    "instancing": plain,
    "embedding": plain,
    "soak": plain,
    "beside": plain,
    "beside_cycles": plain,
    "devices": plain,
    "denoising": plain,
    "layers": plain,
    "lens": plain,
    "measured": plain,
    "motion": plain,
    "hair": plain,
    "starting": starting,
    "viewing": plain,
    "compiling": plain,
    "traversal": plain,
    "building": plain,
    "refit": plain,
    "shares": shares,
    "sizes": sizes,
    "sizes_fit": plain,
}


def page(machines: dict[str, list[Row]]) -> str:
    """The whole page, from the records of each processor."""
    text = HEAD
    for processor, records in machines.items():
        text += f"\n## {processor}\n"
        for bench, show in TABLES.items():
            rows = [row for row in newest(records) if row["bench"] == bench]
            if rows:
                last = max(rows, key=lambda row: str(row["date"]))
                load = max(float(row["load"]) for row in rows)
                text += f"\n### {bench.capitalize()}\n\n{show.__doc__.splitlines()[0]} "
                text += f"{str(last['date'])[:10]}, commit {last['commit']}, load {load}.\n\n"
                text += show(rows)
    return text


def machines() -> dict[str, list[Row]]:
    """All records, by their processor and its cores."""
    by_machine: dict[str, list[Row]] = {}
    for file in sorted(RESULTS.glob("2*.jsonl")):
        for line in file.read_text(encoding="utf-8").splitlines():
            record = json.loads(line)
            by_machine.setdefault(f"{record['processor']}, {record['cores']} cores", []).append(
                record
            )
    return by_machine


def write() -> Path:
    """Write the page; where it is."""
    path = RESULTS / "README.md"
    path.write_text(page(machines()), encoding="utf-8")
    return path


if __name__ == "__main__":
    print(write())
    gpu_page.write()
