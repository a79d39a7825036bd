"""A picture that is white or black explains itself: what to do stands in one line."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ... import images
from ...arrays import Floats32
from ...render.analysis.lights import light_power
from ...render.analysis.lights.sources import emissions_of
from ...render.analysis.look import Look
from ...render.pictures import DevicePictures
from ...scene import Scene
from ...scene.lights import Light
from ..options.grading import Grading, for_screens

MOSTLY_WHITE = 0.5  # of the lit pixels
NEARLY_BLACK = 0.98  # of all pixels
DARK = 2.0  # stops by which a picture that is nearly black would have to be brightened
OUTSHINING = 1000.0  # times as strong as any other lamp
ADVICE = "docs/lighting.md has a list: Why is it black?"


def exposure_found(renderer: DevicePictures) -> float:
    """Return the stops of `--exposure auto`."""
    return images.auto_exposure(_pixels(renderer))


def remarks(renderer: DevicePictures, grading: Grading, targets: tuple[Path, ...]) -> Iterator[str]:
    """Yield sentences of a picture in which little is seen, with what mends it."""
    scene, pixels = renderer.scene, _pixels(renderer)
    exposure = images.stops(grading.exposure, pixels)
    found = images.levels(pixels, exposure, grading.tone, grading.view)
    mended = images.auto_exposure(pixels)
    advice = f"--exposure auto, {mended:+.1f} stops, shows it"
    if not found.lit:
        yield f"the picture is black: no path has found a light; {ADVICE}"
        return
    if grading.exposure != "auto" and for_screens(targets):
        if found.white > MOSTLY_WHITE:
            yield f"{found.white:.0%} of what is lit is white: {advice}"
        elif found.black > NEARLY_BLACK and mended > exposure + DARK:
            yield f"{found.black:.0%} of the picture is black: {advice}"
    yield from _outshone(scene)


def _pixels(renderer: DevicePictures) -> Floats32:
    """The picture so far in linear Rec. 709, (h, w, c)."""
    colours = renderer.colours() if renderer._form.bands else renderer.image()
    return images.to_rec709(images.straight(colours), renderer.scene.film.output_space)


def _outshone(scene: Scene) -> Iterator[str]:
    """Yield a sentence where one lamp with a place is far stronger than any other."""
    look = Look.of(scene.film)
    powers = [
        (light_power.power(lamp, _strength(lamp, look), 1.0, look), f"lights[{i}] ({lamp.kind})")
        for i, lamp in enumerate(scene.lights)
        if lamp.reach == "placed"
    ]
    if len(powers) < 2:
        return
    (next_best, _), (best, name) = sorted(powers)[-2:]
    if best > OUTSHINING * next_best:
        times = f"{best / next_best:,.0f} times as strong as" if next_best else "stronger than"
        yield f"{name} is {times} any other lamp: little is seen of what the others light"


def _strength(lamp: Light, look: Look) -> float:
    """The mean of the emissions of a lamp."""
    values = [light_power.brightness(value, look) for value in emissions_of(lamp).values()]
    return float(np.mean(values)) if values else 0.0
