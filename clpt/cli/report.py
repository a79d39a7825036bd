"""What `clpt render --verbose` tells, on stderr."""

from __future__ import annotations

import click

from ..render.renderer import Renderer


def before(renderer: Renderer, loading: float) -> None:
    """Tell what the scene became and what that took; `loading` is what its file did [s]."""
    first, facts = renderer.wavefronts[0], renderer.facts
    _line("device", renderer.device.info.label)
    parts = [f"{facts.triangles:,} triangles"]
    if facts.instances:
        seen = f"{facts.triangles_instanced:,} triangles seen"
        parts += [f"{facts.instances:,} instances", seen]
    if facts.analytic:
        parts.append(f"{facts.analytic:,} shapes as they are")
    _line("geometry", ", ".join(parts))
    _line("lights", f"{facts.lights:,}")
    for name, size in facts.trees.items():
        layout = f"{first.tree.layout}, " if name == "triangles" else ""
        _line(f"tree {name}", layout + _bytes(size))
    for name, size in sorted(facts.tables.items(), key=lambda item: -item[1]):
        _line(f"table {name}", _bytes(size))
    _line("paths", f"{first.slots:,} in flight, {first.lanes} to a work-item")
    _line("device memory", _bytes(facts.memory))
    others = facts.programs - facts.programs_kept
    kept = f"{facts.programs_kept} from clpt's cache, {others} from the driver or its cache"
    _line("programs", f"{facts.programs} in {facts.seconds['programs']:.2f} s: {kept}")
    _line("seconds to load", f"{loading:.2f}")
    for name in ("lower", "trees", "ready"):
        _line(
            f"seconds {'until ' if name == 'ready' else 'for '}{name}", f"{facts.seconds[name]:.2f}"
        )


def after(renderer: Renderer) -> None:
    """Tell how long the first sample and each stage took."""
    _line("seconds until a sample", f"{renderer.facts.seconds.get('first_sample', 0.0):.2f}")
    if renderer.scene.noise is not None:
        samples = renderer.film.get()[..., 3]
        done = 1.0 - renderer.active
        _line("noise", f"below {renderer.scene.noise:g} in {done:.1%} of the pixels")
        _line(
            "samples",
            f"{samples.mean():.1f} in the mean, {samples.min():.0f} to {samples.max():.0f}",
        )
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
