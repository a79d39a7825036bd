"""Every scene file of a folder: does it render, and if not, why? `make assets-report`.

A file is read, lowered and rendered at 64x64 with a sample per pixel, in a process that is killed
when a file takes too long. The folder's expected.json has counts of other programs. The
page goes to bench/results/assets.md, the records beside it.
"""

from __future__ import annotations

import dataclasses
import json
import multiprocessing
import os
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any

import click
import numpy as np
from rich.progress import track

from bench import machine
from bench.report import RESULTS

SCENES = (".gltf", ".glb", ".pbrt", ".xml", ".obj", ".ply", ".stl", ".off")
PATIENCE = 180.0  # seconds for a file, kernels compiled included
SIZE = 64  # of the picture [pixels]
BOUNDS = 1e-3  # largest difference of bounds, over the scene's size

Row = dict[str, Any]


def files(folder: Path, expected: Row) -> Iterator[Path]:
    """Yield the files that stand for a scene: of PBRT's those that others counted, no parts."""
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        part = path.suffix in (".pbrt", ".ply") and name.startswith("pbrt/")
        mesh = path.suffix in (".obj", ".ply") and name.startswith("mitsuba/")
        if path.suffix.lower() in SCENES and (name in expected or not (part or mesh)):
            yield path


def examine(path: Path, film: int) -> Row:
    """Return what is found out about a file; runs in a worker."""
    import clpt
    from clpt.cli.files.scene_contents import summary

    start = time.perf_counter()
    try:
        try:
            scene = clpt.load(path)
        except clpt.SceneError as error:
            if "is not defined" not in str(error):
                raise
            scene = clpt.load(path, integrator="path")
        row: Row = {"load": time.perf_counter() - start, **summary(scene)}
        if not film:
            return {**row, "seconds": row["load"]}
        size = dataclasses.replace(scene.film, width=film, height=film, crop=None)
        renderer = clpt.Renderer(dataclasses.replace(scene, film=size))
        renderer.run(1)
        row["warnings"] = [*row["warnings"], *renderer.warnings]
        row["finite"] = bool(np.isfinite(renderer.image()).all())
        row |= {f"seconds_{name}": value for name, value in renderer.stats.seconds.items()}
        row["seconds"] = time.perf_counter() - start
        return row
    except clpt.ClptError as error:
        return {"refused": str(error).replace(f"{path.parent}{os.sep}", "")}


def verdict(row: Row, expected: Row) -> Row:
    """Return what others counted in the file: triangles, and by how much bounds differ."""
    counted = expected.get("triangles", expected.get("mesh_triangles"))
    if "ply_triangles" in expected:
        counted = expected["ply_triangles"] + expected["inline_triangles"]
    result: Row = {"expected": counted}
    theirs, ours = expected.get("bounds"), row.get("bounds")
    if theirs and ours:
        corners = np.array(theirs), np.array(ours)
        result["bounds_differ"] = float(np.abs(corners[0] - corners[1]).max() / np.ptp(corners[0]))
    return result


def run(folder: Path, names: tuple[str, ...], film: int = SIZE) -> list[Row]:
    """Examine all files in turn; report a file that kills or stalls its process."""
    kinds = json.loads((folder / "expected.json").read_text("utf-8"))
    expected = {k: v for kind in kinds.values() if isinstance(kind, dict) for k, v in kind.items()}
    rows, pool = [], _pool()
    selected = [f for f in files(folder, expected) if not names or any(n in str(f) for n in names)]
    for path in track(selected, description="files"):
        name = path.relative_to(folder).as_posix()
        try:
            row = pool.submit(examine, path, film).result(PATIENCE)
        except (TimeoutError, BrokenProcessPool) as error:
            stalled = isinstance(error, TimeoutError)
            row = {"failed": f"took over {PATIENCE:g} s" if stalled else "killed its process"}
            for process in list(pool._processes.values()):
                process.kill()
            pool = _pool()
        except (
            Exception
        ) as error:  # what is no ClptError is a mistake of ours, and is shown as such
            row = {"failed": f"{type(error).__name__}: {error}"}
        rows.append({"file": name, **row, **verdict(row, expected.get(name, {}))})
    pool.shutdown()
    return rows


def _pool() -> ProcessPoolExecutor:
    return ProcessPoolExecutor(1, multiprocessing.get_context("spawn"))


def page(rows: list[Row]) -> str:
    """Return the rows as a page of Markdown."""
    shown = [r for r in rows if "triangles" in r]
    refused = [r for r in rows if "refused" in r]
    failed = [r for r in rows if "failed" in r]
    wrong = [r for r in shown if r["expected"] not in (None, r["triangles"])]
    far = [r for r in shown if r.get("bounds_differ", 0.0) > BOUNDS]
    about = machine.circumstances()
    counts = sum(r["expected"] is not None for r in shown)
    bounds_known = sum("bounds_differ" in r for r in shown)
    done = "render" if any("finite" in r for r in shown) else "are read (none was rendered)"
    lines = [
        "# Scenes of others\n",
        f"Made by `make assets-report` at {about['commit']} on {about['processor']}, "
        f"{str(about['date'])[:10]}. {len(rows)} files: {len(shown)} {done}, {len(refused)} are "
        f"refused, {len(failed)} fail. Of {counts} counts of triangles that others made "
        f"{len(wrong)} differ, of {bounds_known} bounds {len(far)}.\n",
        "Seconds to load; to build trees; to build programs, over all threads (0: they were in the "
        "cache); from the start to the first picture, 64x64 with one sample per pixel.\n",
        "| file | triangles | expected | bounds | load | trees | programs | picture | warnings |",
        "| --- | ---: | ---: | --- | ---: | ---: | ---: | ---: | --- |",
    ]
    for r in shown:
        bounds = "" if "bounds_differ" not in r else ("same" if r not in far else "differ")
        seconds = [r["load"], *(r.get(f"seconds_{n}", 0.0) for n in ("trees", "programs"))]
        cells = [r["file"], f"{r['triangles']:,}", _count(r["expected"]), bounds]
        cells += [f"{s:.2f}" for s in (*seconds, r["seconds"])]
        notes = "; ".join(_cell(w) for w in r["warnings"][:3])
        more = len(r["warnings"]) - 3
        cells.append(notes + (f"; and {more} more" if more > 0 else ""))
        lines.append(f"| {' | '.join(cells)} |")
    lines += ["\n## Refused\n", "| file | why |", "| --- | --- |"]
    lines += [f"| {r['file']} | {_cell(r['refused'])} |" for r in refused]
    if failed:
        lines += ["\n## Failed\n", "| file | how |", "| --- | --- |"]
        lines += [f"| {r['file']} | {_cell(r['failed'])} |" for r in failed]
    return "\n".join(lines) + "\n"


def _count(n: int | None) -> str:
    return "" if n is None else f"{n:,}"


def _cell(text: str) -> str:
    return " ".join(text.replace("|", "\\|").split())[:200]


@click.command(help=__doc__)
@click.argument("folder", type=click.Path(path_type=Path, file_okay=False, exists=True))
@click.argument("names", nargs=-1)
@click.option("--read-only", is_flag=True, help="Read the files, and render none.")
def main(folder: Path, names: tuple[str, ...], read_only: bool) -> None:
    rows = run(folder.resolve(), names, 0 if read_only else SIZE)
    target = RESULTS / "assets.jsonl"
    if names:
        print(page(rows))
        return
    target.unlink(missing_ok=True)
    machine.append(target, "assets", rows)
    target.with_suffix(".md").write_text(page(rows), "utf-8")
    print(target.with_suffix(".md"))


if __name__ == "__main__":
    main()
