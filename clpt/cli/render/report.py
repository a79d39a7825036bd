"""The figures that `clpt render --verbose` prints on stderr."""

from __future__ import annotations

from ...render.resumable import ResumableRenderer
from ..process import terminal
from .passes import End

TIMES = {  # of RenderStats.seconds
    "lower": "time to encode the scene",
    "trees": "time to build trees",
    "ready": "time until it is ready",
}


def header(name: str, renderer: ResumableRenderer, where: str) -> str:
    """Return the line that says what is rendered, how and where."""
    film, asked, chosen = renderer.scene.film, renderer.scene.integrator.kind, renderer.stats
    how = asked if asked == chosen.integrator else f"{asked} -> {chosen.integrator}"
    size = f"{film.size[0]}x{film.size[1]}"
    return "  ".join((name, size, film.mode, how, where))


def ending(renderer: ResumableRenderer, end: End, seconds: float) -> str:
    """Return the line that says how far the render came, in so many seconds of all."""
    mean = renderer.counts.samples / renderer._wavefront.paths.pixels
    samples = f"{mean:.0f}" if mean >= 10 or mean == int(mean) else f"{mean:.2g}"
    if not end.stopped:
        return f"{samples} spp, {seconds:.1f} s in all"
    of = "" if end.samples is None else f" of {end.samples - renderer.first_sample}"
    return f"stopped at {samples}{of} spp, with the picture so far; {seconds:.1f} s in all"


def before(renderer: ResumableRenderer, loading: float) -> None:
    """Print what was made of the scene, and the time; loading: seconds for its file."""
    first, stats = renderer._wavefront, renderer.stats
    for on in renderer.devices:
        _line("device", on.info.label)
    parts = [f"{stats.triangles:,} triangles"]
    if stats.instances:
        seen = f"{stats.triangles_instanced:,} triangles seen"
        parts += [f"{stats.instances:,} instances", seen]
    if stats.analytic:
        shapes = "shape" if stats.analytic == 1 else "shapes"
        parts.append(f"{stats.analytic:,} {shapes} without triangles")
    _line("geometry", ", ".join(parts))
    _line("lights", f"{stats.lights:,}")
    if stats.reason:
        paths = f", {stats.light_paths:g} light paths a sample" if stats.light_paths else ""
        _line("integrator", f"{stats.integrator}{paths}: {stats.reason}")
    if stats.light_paths_end:
        left = "what follows is left to paths from the camera"
        _line("light paths end", f"at {', '.join(stats.light_paths_end)}; {left}")
    if stats.photons:
        disk = f"within {stats.photon_radius:.3g} m at first"
        _line("photons", f"up to {stats.photons:,} a pass, {_bytes(stats.photon_memory)}; {disk}")
    for name, size in stats.trees.items():
        layout = f"{first.scene.strategy.layout}, " if name == "triangles" else ""
        _line(f"tree {name}", layout + _bytes(size))
    for name, size in sorted(stats.tables.items(), key=lambda item: -item[1]):
        _line(f"table {name}", _bytes(size))
    _line("paths", f"{first.paths.slots:,} at a time, {first.lanes} in each vector")
    _line("device memory", _bytes(stats.memory))
    others = stats.programs - stats.programs_cached
    kept = f"{stats.programs_cached} from clpt's cache, {others} by the driver or from its cache"
    _line("programs", f"{stats.programs} in {stats.seconds['programs']:.2f} s: {kept}")
    _line("time to read the file", f"{loading:.2f} s")
    for name, what in TIMES.items():
        _line(what, f"{stats.seconds[name]:.2f} s")


def after(renderer: ResumableRenderer) -> None:
    """Print the time of the first sample, what each device did, and each stage of the first."""
    from ...cluster.multi_renderer import MultiRenderer  # here: one device has no use for it

    if isinstance(renderer, MultiRenderer):
        for one in renderer.shares:
            lost = f", failed: {one.failure}" if one.failure else ""
            _line(f"share {one.share:.1%}", f"{one.rate * 1e-6:.3g} Mpaths/s, {one.name}{lost}")
    _line("time to the first sample", f"{renderer.stats.seconds.get('first_sample', 0.0):.2f} s")
    if renderer.scene.noise is not None:
        samples = renderer.film.get()[..., 3]
        done = 1.0 - renderer.active
        _line("noise", f"below {renderer.scene.noise:g} in {done:.1%} of the pixels")
        _line(
            "samples",
            f"{samples.mean():.1f} in the mean, {samples.min():.0f} to {samples.max():.0f}",
        )
    timings = renderer._wavefront.timings.collect()
    whole = sum(timing.seconds for timing in timings.values())
    for name, timing in timings.items():
        share = timing.seconds / max(whole, 1e-9)
        _line(f"stage {name}", f"{timing.seconds:.3f} s, {share:.0%}, {timing.calls:,} calls")


def _line(what: str, text: str) -> None:
    terminal.say(f"{what:<24} {text}")


def _bytes(n: int) -> str:
    return f"{n / 2**20:.1f} MiB" if n >= 2**20 else f"{n / 2**10:.1f} KiB"
