"""Lines that `clpt render` prints: figures, and remarks on a picture that shows little."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np

from clpt.render.lights.find import emissions_of, light_power
from clpt.render.spectra.find import Look

from ... import images
from ...arrays import Floats32
from ...geometry import analytic
from ...geometry.lamps import plainly_lit
from ...render.resumable import ResumableRenderer
from ...scene import Scene
from ...scene.lights import Light, PoweredLamp
from ...scene.shapes import Shape
from ...scene.values import mean
from ...spectra import RGBIlluminant, Spectrum, watts
from ..options.grading import Grading, for_screens
from ..process import terminal
from .passes import End

TIMES = {  # of RenderStats.seconds
    "lower": "time to encode the scene",
    "trees": "time to build trees",
    "ready": "time until it is ready",
}
MOSTLY_WHITE = 0.5  # of the lit pixels
NEARLY_BLACK = 0.98  # of all pixels
DARK = 2.0  # stops: a picture that is nearly black would have to be brightened by more
OUTSHINING = 1000.0  # times as strong as any other lamp
ADVICE = "docs/lighting.md has a list: Why is it black?"


def header(name: str, renderer: ResumableRenderer, where: str) -> str:
    """Return the line with the scene, its size, mode, integrator and device."""
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
    """Print sizes of the encoded scene, and times; loading: seconds for its file."""
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
    for name, label in TIMES.items():
        _line(label, f"{stats.seconds[name]:.2f} s")


def after(renderer: ResumableRenderer) -> None:
    """Print the time of the first sample, shares of devices, and stages of the first device."""
    from ...cluster.multi_renderer import MultiRenderer  # here: a single device has no use for it

    if isinstance(renderer, MultiRenderer):
        for part in renderer.shares:
            lost = f", failed: {part.failure}" if part.failure else ""
            _line(
                f"share {part.share:.1%}",
                f"{part.rate * 1e-6:.3g} Mpaths/s, {part.name}{lost}",
            )
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


def _line(label: str, text: str) -> None:
    terminal.say(f"{label:<24} {text}")


def _bytes(n: int) -> str:
    return f"{n / 2**20:.1f} MiB" if n >= 2**20 else f"{n / 2**10:.1f} KiB"


def exposure_found(renderer: ResumableRenderer) -> float:
    """Return the stops of `--exposure auto`."""
    return images.auto_exposure(_pixels(renderer)) - renderer.scene.film.display_exposure


def display_exposure(renderer: ResumableRenderer) -> str:
    """Return a sentence on the exposure that the scene's film has for screens, "" for none."""
    stops = renderer.scene.film.display_exposure
    return f"exposure {stops:+.1f} stops, of the scene: film.display_exposure" if stops else ""


def remarks(
    renderer: ResumableRenderer, grading: Grading, targets: tuple[Path, ...]
) -> Iterator[str]:
    """Yield sentences on a picture that shows little, with a remedy."""
    scene, pixels = renderer.scene, _pixels(renderer)
    display = scene.film.display_exposure
    exposure = images.stops(images.raised(grading.exposure, display), pixels)
    seen = images.levels(pixels, exposure, grading.tone, grading.view)
    mended = images.auto_exposure(pixels)
    advice = f"--exposure auto, {mended - display:+.1f} stops, shows it"
    if not seen.lit:
        yield f"the picture is black: no path has found a light; {ADVICE}"
        return
    if grading.exposure != "auto" and for_screens(targets):
        if seen.white > MOSTLY_WHITE:
            yield f"{seen.white:.0%} of what is lit is white: {advice}"
        elif seen.black > NEARLY_BLACK and mended > exposure + DARK:
            yield f"{seen.black:.0%} of the picture is black: {advice}"
    if scene.film.time_bins:
        times = renderer.developed("words", "light_layers").times()
        if outside := renderer.form.outside(times):
            yield outside
    yield from _outshone(scene)


def _pixels(renderer: ResumableRenderer) -> Floats32:
    """The picture so far in linear Rec. 709, (h, w, c)."""
    colours = renderer.picture()
    return images.to_rec709(images.straight(colours), renderer.scene.film.output_space)


def _outshone(scene: Scene) -> Iterator[str]:
    """Yield a sentence where a lamp with a place sends out far more watts than any other lamp."""
    lit, look = plainly_lit(scene), Look.of(scene.film)
    powers = [
        (light_power(lamp, _watts(lamp, look), 1.0, look), f"lights[{i}] ({lamp.kind})")
        for i, lamp in enumerate(lit.lights)
        if lamp.reach == "placed"
    ]
    if not powers:
        return
    best, name = max(powers)
    others = [power for power, other in powers if other != name]
    others += [_shape_watts(shape, look) for shape in lit.shapes if shape.emission is not None]
    if others and best > OUTSHINING * max(others):
        next_best = max(others)
        times = f"{best / next_best:,.0f} times as strong as" if next_best else "stronger than"
        yield f"{name} is {times} any other lamp: little is seen of what the others light"


@cache
def _white_watts() -> float:
    """The watts of an emission of 1 [nm]: only scenes with lamps need them."""
    return watts(RGBIlluminant(1.0, 1.0, 1.0))


def _watts(lamp: Light, look: Look) -> float:
    """The emission of a lamp from 360 to 830 nm, such as its intensity [W/sr]."""
    values = [
        watts(value) if isinstance(value, Spectrum) else _white_watts() * mean(value, look)
        for value in emissions_of(lamp).values()
    ]
    return float(np.mean(values)) if values else 0.0


def _shape_watts(shape: Shape, look: Look) -> float:
    """The power of a shape's light [W]."""
    emission = shape.emission
    if not isinstance(emission, PoweredLamp):
        return 0.0
    return _watts(emission, look) * emission.extent(analytic.area(shape))


def refusals(renderer: ResumableRenderer) -> list[str]:
    """Return a sentence for each fault of samples or pixels of a render."""
    sentences = []
    if rejected := renderer.counts.rejected:
        sentences.append(
            f"{rejected} samples were not finite, too bright, in a medium that is far too dense "
            "beside empty cells, or not finished in time; they lack light"
        )
    if renderer.counts.full:
        sentences.append("pixels are too bright for the film: lower film.exposure")
    return sentences
