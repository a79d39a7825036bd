"""A picture that is white or black explains itself: what to do stands in one line."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from clpt.render.lights import power as light_power
from clpt.render.lights.find import emissions_of
from clpt.render.spectra.look import Look

from ... import images
from ...arrays import Floats32
from ...geometry import analytic
from ...geometry.lamps import plainly_lit
from ...render.resumable import ResumableRenderer
from ...scene import Scene
from ...scene.lights import Light, PoweredLamp
from ...scene.shapes import Shape
from ...scene.texture_values import mean
from ...spectra import RGBIlluminant, Spectrum, watts
from ..options.grading import Grading, for_screens

MOSTLY_WHITE = 0.5  # of the lit pixels
NEARLY_BLACK = 0.98  # of all pixels
DARK = 2.0  # stops by which a picture that is nearly black would have to be brightened
OUTSHINING = 1000.0  # times as strong as any other lamp
WHITE = watts(RGBIlluminant(1.0, 1.0, 1.0))  # of an emission of 1 [nm]
ADVICE = "docs/lighting.md has a list: Why is it black?"


def exposure_found(renderer: ResumableRenderer) -> float:
    """Return the stops of `--exposure auto`."""
    return images.auto_exposure(_pixels(renderer)) - renderer.scene.film.display_exposure


def display_exposure(renderer: ResumableRenderer) -> str:
    """Return what to say of the exposure that the scene's film has for screens, "" for none."""
    stops = renderer.scene.film.display_exposure
    return f"exposure {stops:+.1f} stops, of the scene: film.display_exposure" if stops else ""


def remarks(
    renderer: ResumableRenderer, grading: Grading, targets: tuple[Path, ...]
) -> Iterator[str]:
    """Yield sentences of a picture in which little is seen, with what mends it."""
    scene, pixels = renderer.scene, _pixels(renderer)
    display = scene.film.display_exposure
    exposure = images.stops(images.raised(grading.exposure, display), pixels)
    found = images.levels(pixels, exposure, grading.tone, grading.view)
    mended = images.auto_exposure(pixels)
    advice = f"--exposure auto, {mended - display:+.1f} stops, shows it"
    if not found.lit:
        yield f"the picture is black: no path has found a light; {ADVICE}"
        return
    if grading.exposure != "auto" and for_screens(targets):
        if found.white > MOSTLY_WHITE:
            yield f"{found.white:.0%} of what is lit is white: {advice}"
        elif found.black > NEARLY_BLACK and mended > exposure + DARK:
            yield f"{found.black:.0%} of the picture is black: {advice}"
    yield from _outshone(scene)


def _pixels(renderer: ResumableRenderer) -> Floats32:
    """The picture so far in linear Rec. 709, (h, w, c)."""
    colours = renderer.picture()
    return images.to_rec709(images.straight(colours), renderer.scene.film.output_space)


def _outshone(scene: Scene) -> Iterator[str]:
    """Yield a sentence where one lamp with a place sends out far more watts than any other lamp."""
    lit, look = plainly_lit(scene), Look.of(scene.film)
    powers = [
        (light_power.power(lamp, _watts(lamp, look), 1.0, look), f"lights[{i}] ({lamp.kind})")
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


def _watts(lamp: Light, look: Look) -> float:
    """The emission of a lamp from 360 to 830 nm, such as its intensity [W/sr]."""
    values = [
        watts(value) if isinstance(value, Spectrum) else WHITE * mean(value, look)
        for value in emissions_of(lamp).values()
    ]
    return float(np.mean(values)) if values else 0.0


def _shape_watts(shape: Shape, look: Look) -> float:
    """The power of a shape's light [W]."""
    emission = shape.emission
    if not isinstance(emission, PoweredLamp):
        return 0.0
    return _watts(emission, look) * emission.extent(analytic.area(shape))
