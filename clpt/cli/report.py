"""What `clpt render --verbose` tells, on stderr."""

from __future__ import annotations

import click

from ..render.renderer import Renderer


def before(renderer: Renderer, seconds: float) -> None:
    """Tell what the scene became: triangles, tables, tree, programs. seconds: all of it took."""
    first = renderer.wavefronts[0]
    lowered, tree, builds = first.lowered, first.tree, renderer.device.builds
    _line("device", renderer.device.info.label)
    analytic = len(lowered.boxes)
    shapes = f", {analytic:,} shapes as they are" if analytic else ""
    _line("geometry", f"{len(lowered.faces):,} triangles{shapes}")
    took = tree.stats.get("seconds", 0.0)
    _line("tree", f"{tree.layout}, {_bytes(tree.bytes)}, built in {took:.2f} s")
    tables = {**lowered.tables, "vertices": lowered.vertices, "faces": lowered.faces}
    for name, table in sorted(tables.items(), key=lambda item: -item[1].nbytes):
        if table.size > 1:  # of what a scene does not have, a word stands there
            _line(f"table {name}", _bytes(table.nbytes))
    _line("paths", f"{first.slots:,} in flight, {first.lanes} to a work-item")
    _line("device memory", _bytes(sum(w.buffers.used for w in renderer.wavefronts)))
    _line("programs", f"{builds.programs}, {builds.seconds:.2f} s over all threads")
    _line("ready", f"in {seconds:.2f} s")


def after(renderer: Renderer) -> None:
    """Tell how long each stage took."""
    for wavefront in renderer.wavefronts:
        timings = wavefront.timings.collect()
        whole = sum(timing.seconds for timing in timings.values())
        for name, timing in timings.items():
            share = timing.seconds / max(whole, 1e-9)
            _line(f"stage {name}", f"{timing.seconds:.3f} s, {share:.0%}, {timing.calls:,} calls")


def _line(what: str, text: str) -> None:
    click.echo(f"{what:<24} {text}", err=True)


def _bytes(n: int) -> str:
    return f"{n / 2**20:.1f} MiB" if n >= 2**20 else f"{n / 2**10:.1f} KiB"
