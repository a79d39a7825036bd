"""Paints painting.exr, a spectral picture of the sea with a whale that daylight does not show.

    python scenes/hidden_whale/generate.py

Sea and whale are painted in metamers: of all smooth reflectances that have the sea's X, Y and Z
under D65, close to the one that reflects least of an amber lamp's light, and the one that reflects
most. Needs scipy.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw
from scipy.optimize import linprog

from clpt.images import spectral_exr
from clpt.images.spectral_exr import SpectralImage
from clpt.spectra import LED, RGB, cie_xyz, illuminant

Array = NDArray[np.float64]

SIZE, FINER = (400, 300), 4  # texels; times that, before edges are smoothed
NM = np.arange(400.0, 701.0, 10.0)
AMBER, WIDTH = 594.0, 16.0  # [nm] of the lamp that shows the whale
BEND = 0.22  # the sharpest bend of a paint's curve: its second difference
DARKEST, BRIGHTEST = 0.02, 0.92
PURE = 0.85  # share of that paint; the rest is the plain one, so that waves stay apart

# sRGB
SKY = ["#f3c9a0", "#efb392", "#e39b8a", "#c98590"]
SUN, SAIL, HULL = "#fbe9c4", "#f6efe0", "#5a3a33"
SEA = ["#7fb1bd", "#679fb1", "#4f8ca3", "#3b7993"]
GULL = "#6d4b58"

# The whale's outline from its nose along the back to the flukes and along the belly; x to the
# right, y down, its length about 1.
BACK = [(0.00, 0.53), (0.03, 0.44), (0.11, 0.37), (0.24, 0.33), (0.40, 0.32), (0.55, 0.345)]
BACK += [(0.63, 0.365), (0.67, 0.345), (0.69, 0.385), (0.79, 0.435), (0.90, 0.465), (0.955, 0.44)]
FLUKES = [(1.01, 0.355), (1.09, 0.315), (1.07, 0.39), (1.035, 0.455), (1.06, 0.53), (1.12, 0.60)]
FLUKES += [(1.03, 0.595), (0.965, 0.54)]
BELLY = [(0.90, 0.525), (0.78, 0.555), (0.64, 0.615), (0.48, 0.665), (0.32, 0.685), (0.16, 0.665)]
BELLY += [(0.05, 0.61)]
FIN = [(0.27, 0.60), (0.33, 0.72), (0.42, 0.83), (0.50, 0.87), (0.49, 0.80), (0.44, 0.70)]
FIN += [(0.40, 0.61)]
MOUTH = [(0.01, 0.54), (0.07, 0.572), (0.14, 0.578), (0.215, 0.558)]
EYE = (0.205, 0.525)


def curve(points: list[tuple[float, float]], closed: bool = True) -> list[tuple[float, float]]:
    """A smooth line through points (Catmull and Rom 1974)."""
    p = np.array(points)
    ends = (p[-1:], p[:2]) if closed else (p[:1], p[-1:])
    p = np.vstack([ends[0], p, ends[1]])
    t = np.linspace(0.0, 1.0, 12, endpoint=False)[:, None]
    made = []
    for a, b, c, d in zip(p, p[1:], p[2:], p[3:], strict=False):
        made.append(
            b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)))
        )
    return [tuple(q) for q in np.vstack(made)]


class Canvas:
    """A mask that is drawn on in units of the painting's height, from its top left."""

    def __init__(self) -> None:
        self.image = Image.new("L", (SIZE[0] * FINER, SIZE[1] * FINER))
        self.draw = ImageDraw.Draw(self.image)
        self.unit = SIZE[1] * FINER

    def fill(self, points, value: int = 255) -> None:
        self.draw.polygon([(x * self.unit, y * self.unit) for x, y in points], fill=value)

    def disk(self, x: float, y: float, radius: float, value: int = 255) -> None:
        ends = [(c + s * radius) * self.unit for s in (-1, 1) for c in (x, y)]
        self.draw.ellipse(ends, fill=value)

    def line(self, points, width: float, value: int = 255) -> None:
        pixels = [(x * self.unit, y * self.unit) for x, y in points]
        self.draw.line(pixels, fill=value, width=round(width * self.unit), joint="curve")

    def cover(self) -> Array:
        """How much of each texel is covered, (h, w, 1)."""
        small = self.image.resize(SIZE, Image.Resampling.BOX)
        return np.asarray(small, np.float64)[..., None] / 255.0


def paint(colour: str) -> Array:
    """A smooth reflectance of an sRGB colour, (n,)."""
    stored = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255.0
    linear = np.where(stored <= 0.04045, stored / 12.92, ((stored + 0.055) / 1.055) ** 2.4)
    return RGB(*linear).sample(NM)


def metamer(colour: str, sign: float) -> Array:
    """The reflectance of an sRGB colour that an amber lamp shows brightest (1) or darkest (-1)."""
    fine = np.arange(360.0, 831.0)
    bands = np.array([np.interp(fine, NM, band) for band in np.eye(len(NM))])
    seen = (bands @ (cie_xyz(fine) * illuminant("D65").sample(fine)[:, None])).T
    lamp = bands @ LED(AMBER, WIDTH).sample(fine)
    bends = np.diff(np.eye(len(NM)), 2, axis=0)
    found = linprog(
        -sign * lamp, np.vstack([bends, -bends]), np.full(2 * len(bends), BEND),
        seen, seen @ paint(colour), (DARKEST, BRIGHTEST),
    )  # fmt: skip
    if not found.success:
        raise SystemExit(f"no smooth paint has the colour {colour}")
    return PURE * found.x + (1.0 - PURE) * paint(colour)


def waves(y: float, swell: float, phase: float) -> list[tuple[float, float]]:
    """What lies below a wavy line."""
    x = np.linspace(-0.05, SIZE[0] / SIZE[1] + 0.05, 200)
    top = y + swell * np.sin(2 * np.pi * (x * 2.3 + phase)) + 0.4 * swell * np.sin(17 * x + phase)
    return [*zip(x, top, strict=True), (x[-1], 1.1), (x[0], 1.1)]


def sea_and_sky(sign: float) -> Array:
    """The painting (h, w, n), its sea such that an amber lamp shows it bright (1) or dark (-1)."""
    picture = np.broadcast_to(paint(SKY[-1]), (SIZE[1], SIZE[0], len(NM)))

    def over(colour: str, canvas: Canvas) -> None:
        nonlocal picture
        cover = canvas.cover()
        reflectance = metamer(colour, sign) if colour in SEA else paint(colour)
        picture = picture * (1.0 - cover) + reflectance * cover

    for i, colour in enumerate(reversed(SKY[:-1])):
        canvas = Canvas()
        canvas.fill(waves(0.11 + 0.085 * i, 0.008, 0.3 * i))
        over(colour, canvas)
    canvas = Canvas()
    canvas.disk(0.98, 0.345, 0.105)
    over(SUN, canvas)
    canvas = Canvas()
    for x, y, s in ((0.28, 0.13, 0.032), (0.38, 0.175, 0.024), (0.21, 0.2, 0.02)):
        wing = [(x - s, y - 0.3 * s), (x - 0.5 * s, y - 0.55 * s), (x, y)]
        wing += [(x + 0.5 * s, y - 0.55 * s), (x + s, y - 0.3 * s)]
        canvas.line(curve(wing, closed=False), 0.0055)
    over(GULL, canvas)
    for i, colour in enumerate(SEA):
        canvas = Canvas()
        canvas.fill(waves(0.40 + (0.0, 0.045, 0.115, 0.21)[i], 0.006 + 0.002 * i, 0.37 * i))
        over(colour, canvas)
        if i == 0:
            boat(over)
    return picture


def boat(over) -> None:
    """A small boat on the first wave."""
    x, y, s = 0.42, 0.425, 0.085
    canvas = Canvas()
    leech, luff = x + 0.03 * s, x - 0.05 * s
    canvas.fill([(leech, y - 1.8 * s), (x + 0.9 * s, y - 0.22 * s), (leech, y - 0.22 * s)])
    canvas.fill([(luff, y - 1.6 * s), (luff, y - 0.22 * s), (x - 0.62 * s, y - 0.22 * s)])
    over(SAIL, canvas)
    canvas = Canvas()
    deck, keel = y - 0.12 * s, y + 0.2 * s
    canvas.fill([(x - 0.85 * s, deck), (x + s, deck), (x + 0.7 * s, keel), (x - 0.6 * s, keel)])
    canvas.line([(x, y - 1.85 * s), (x, y)], 0.006)
    over(HULL, canvas)


def whale() -> Array:
    """How much of each texel is whale, (h, w, 1)."""

    def put(points):
        return [(0.135 + 0.95 * x, 0.385 + 0.62 * y) for x, y in points]

    canvas = Canvas()
    canvas.fill(put(curve(BACK + FLUKES + BELLY)))
    canvas.fill(put(curve(FIN)))
    canvas.line(put(curve(MOUTH, closed=False)), 0.007, 0)
    for k in range(5):
        x, y = 0.06 + 0.025 * k, 0.605 + 0.011 * k
        groove = [(x, y), (x + 0.12, y + 0.018), (x + 0.26, y + 0.006)]
        canvas.line(put(curve(groove, closed=False)), 0.004, 110)
    canvas.line(put(curve([FIN[0], FIN[1], FIN[2]], closed=False)), 0.004, 60)
    ((x, y),) = put([EYE])
    canvas.disk(x, y, 0.011, 0)
    return canvas.cover()


def main() -> None:
    """Write the painting."""
    hidden = whale()
    picture = sea_and_sky(-1.0) * (1.0 - hidden) + sea_and_sky(1.0) * hidden
    made = SpectralImage(picture.astype(np.float32), NM)
    spectral_exr.write(Path(__file__).with_name("painting.exr"), made, half=True)


if __name__ == "__main__":
    main()
