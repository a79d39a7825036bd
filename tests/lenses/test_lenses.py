"""Lenses in float64: paraxial quantities, rays, pupils, coatings and files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clpt import lenses, spectra
from clpt.errors import SceneError
from clpt.lenses import Prescription, Surface, tracing
from clpt.lenses.prescription import (
    AIR,
    COATINGS,
    LINE_C,
    LINE_D,
    LINE_F,
    by_name,
    by_number,
    quarter_wave,
    reflectance,
)
from clpt.lenses.tracing import (
    ZONES,
    Rays,
    axis_solid_angle,
    film_distance,
    stop_radius,
    trace,
    zones,
)
from clpt.spectra import Constant

CROWN = Constant(1.5)
STOP = Surface(0.0, 2.0, semi_diameter=6.0, stop=True)


def singlet(first: float, second: float, thickness: float, glass=CROWN, **more):
    return Prescription(
        (
            STOP,
            Surface(first, thickness, glass, 12.0),
            Surface(second, 0.0, semi_diameter=12.0, **more),
        )
    )


def parallel(lens: Prescription, heights, wavelength: float = LINE_D) -> Rays:
    """Rays along the axis, behind the lens."""
    y = np.asarray(heights, np.float64)
    o = np.stack([0.0 * y, y, np.full(len(y), -50.0)], axis=1)
    return trace(lens, Rays.of(o, np.array([[0.0, 0.0, 1.0]])), wavelength)


def crossings(rays: Rays) -> np.ndarray:
    """Where rays cross the axis."""
    return rays.o[:, 2] - rays.o[:, 1] * rays.d[:, 2] / rays.d[:, 1]


def test_the_lensmakers_equation():
    """Hecht 2017, 6.2: 1 / f = (n - 1) (1 / R1 - 1 / R2 + (n - 1) d / (n R1 R2))."""
    n, r1, r2, d = 1.5, 40.0, -65.0, 8.0
    f = 1.0 / ((n - 1.0) * (1.0 / r1 - 1.0 / r2 + (n - 1.0) * d / (n * r1 * r2)))
    found = lenses.cardinal(singlet(r1, r2, d))
    assert found.focal_length == pytest.approx(f, rel=1e-12)
    assert found.back_focus == pytest.approx(f * (1.0 - (n - 1.0) * d / (n * r1)), rel=1e-12)
    assert found.entrance == 0.0 and found.entrance_radius == 6.0
    assert found.f_number == pytest.approx(f / 12.0)


def test_rays_near_the_axis_meet_the_paraxial_quantities():
    lens = lenses.library("double_gauss")
    for wavelength in (450.0, LINE_D, 650.0):
        found = lenses.cardinal(lens, wavelength)
        rays = parallel(lens, [0.01], wavelength)
        assert crossings(rays)[0] - lens.length == pytest.approx(found.back_focus, rel=1e-6)
        assert -0.01 * rays.d[0, 2] / rays.d[0, 1] == pytest.approx(found.focal_length, rel=1e-6)
        # A ray to the middle of the entrance pupil leaves from that of the exit pupil.
        d = np.array([[0.0, 0.001, 1.0]])
        rays = trace(
            lens, Rays.of(np.array([[0.0, 0.0, found.entrance]]) - 60.0 * d, d), wavelength
        )
        assert crossings(rays)[0] - lens.length == pytest.approx(found.exit, rel=1e-5)


@pytest.mark.parametrize("name", lenses.names())
def test_library(name):
    """Each lens has the focal length that its file tells, and brings light to a point."""
    lens = lenses.library(name)
    told = next(
        line.split("\t")[1]
        for line in (lenses.files.ROOT / f"{name}.txt").read_text("utf-8").splitlines()
        if line.startswith("Focal Length")
    )
    found = lenses.cardinal(lens)
    assert found.focal_length == pytest.approx(float(told), rel=0.02)
    assert lens.name and any(word in lens.source for word in ("US ", "DE ", "Smith"))
    radius = stop_radius(lens, max(8.0, found.f_number)) / lens.surfaces[lens.stop].semi_diameter
    y = np.linspace(0.1, 1.0, 8) * radius * found.entrance_radius
    rays = parallel(lens, y)
    assert rays.alive.all()
    at = (lens.length + found.back_focus - rays.o[:, 2]) / rays.d[:, 2]
    assert np.abs(rays.o[:, 1] + at * rays.d[:, 1]).max() < 1.5e-3 * found.focal_length


def peer_of(lens, wavelength, field=0.0, film=0.0, rims=False):
    """A lens in optiland, for one wavelength; film: behind the last surface; rims: these stop rays.
    Skips where that lens design program is not installed."""
    optic = pytest.importorskip("optiland.optic", reason="a lens design program, not installed")
    materials = pytest.importorskip("optiland.materials")
    peer = optic.Optic()
    peer.surfaces.add(index=0, radius=np.inf, thickness=np.inf)
    for i, surface in enumerate(lens.surfaces, 1):
        n = float(surface.glass.sample(wavelength))
        last = i == len(lens.surfaces)
        peer.surfaces.add(
            index=i,
            radius=surface.radius or np.inf,
            thickness=film if last and film else surface.thickness,
            material=materials.IdealMaterial(n=n, k=0),
            is_stop=surface.stop,
            conic=surface.conic,
            aperture=2.0 * surface.semi_diameter if rims else None,
        )
    peer.surfaces.add(index=len(lens.surfaces) + 1)
    pupil = lenses.cardinal(lens, wavelength if not rims else LINE_D).entrance_radius
    peer.set_aperture("EPD", 2.0 * pupil)
    peer.fields.set_type("angle")
    for y in (0.0, field)[: 1 + (field > 0.0)]:
        peer.fields.add(y=y)
    peer.wavelengths.add(value=wavelength * 1e-3, is_primary=True)
    return peer


@pytest.mark.parametrize("name", ["double_gauss", "planar", "sonnar"])
def test_spots_beside_optiland(name):
    """Root mean square radii at f/8, within a percent: the rims cut some of the light at 14
    degrees. The line d agrees to 1e-4; at others optiland's pupil is that of the wavelength."""
    lens = lenses.library(name)
    lens = lens.with_stop(stop_radius(lens, 8.0))
    back = lenses.cardinal(lens).back_focus
    x, y = tracing.pupil_points().T
    for angle in (0.0, 7.0, 14.0):
        for wavelength in (486.1, LINE_D, 656.3):
            peer = peer_of(lens, wavelength, angle, back, rims=True)
            rays = peer.trace_generic(0.0, float(angle > 0.0), x, y, wavelength * 1e-3)
            alive = np.isfinite(rays.x) & (np.asarray(rays.i) > 0.0)
            points = np.stack([np.asarray(rays.x), np.asarray(rays.y)], 1)[alive]
            theirs = tracing.Spot(points, float(alive.mean()))
            ours = tracing.spot(lens, angle, wavelength)
            assert ours.through == pytest.approx(theirs.through, abs=0.01)
            close = 1e-4 if wavelength == LINE_D else 0.01
            assert ours.radius == pytest.approx(theirs.radius, rel=close)


def test_paraxial_quantities_beside_optiland():
    for name in lenses.names():
        lens = lenses.library(name)
        if any(any(surface.aspheric) for surface in lens.surfaces):
            continue
        for wavelength in (450.0, 650.0):
            found = lenses.cardinal(lens, wavelength)
            peer = peer_of(lens, wavelength)
            theirs = [
                float(np.ravel(value)[0])
                for value in (peer.paraxial.f2(), peer.paraxial.F2(), peer.paraxial.EPL(),
                              peer.paraxial.XPL(), peer.paraxial.XPD())
            ]  # fmt: skip
            ours = [
                found.focal_length, found.back_focus, found.entrance, found.exit,
                2.0 * found.exit_radius,
            ]  # fmt: skip
            np.testing.assert_allclose(ours, theirs, rtol=1e-4, atol=1e-6)


def test_focus_by_distance():
    lens = lenses.library("double_gauss")
    distance = film_distance(lens, 700.0)
    d = np.array([[0.0, 1e-4, 1.0]])
    o = np.array([[0.0, 0.0, lens.length + distance - 700.0]])
    rays = trace(lens, Rays.of(o, d))
    assert crossings(rays)[0] == pytest.approx(lens.length + distance, rel=1e-6)
    assert film_distance(lens, 1e9) == pytest.approx(lenses.cardinal(lens).back_focus, rel=1e-6)
    with pytest.raises(SceneError, match="cannot focus nearer than 196 mm"):
        film_distance(lens, 150.0)
    with pytest.raises(SceneError, match=r"opens to f/2\.03 at most"):
        stop_radius(lens, 1.4)


def test_an_achromat_brings_two_colours_together():
    """Crown and flint whose powers go as V: f is the same at F and C (Hecht 2017, 6.3.2).

    The shift over 450 to 650 nm is a small part of what a lens of the crown alone has.
    """
    crown, flint = spectra.glass("n-bk7"), spectra.glass("n-sf2")
    f = 100.0

    def abbe(glass):
        return (glass.sample(LINE_D) - 1.0) / (glass.sample(LINE_F) - glass.sample(LINE_C))

    share = abbe(crown) / (abbe(crown) - abbe(flint))
    c1 = share / f / (crown.sample(LINE_D) - 1.0)  # of both sides together
    c2 = (1.0 - share) / f / (flint.sample(LINE_D) - 1.0)
    r1, r2 = 2.0 / c1, -2.0 / c1
    r3 = 1.0 / (1.0 / r2 - c2)
    thin = 1e-6
    doublet = Prescription(
        (
            STOP,
            Surface(r1, thin, crown, 8.0),
            Surface(r2, thin, flint, 8.0),
            Surface(r3, 0.0, AIR, 8),
        )
    )
    lengths = {w: lenses.cardinal(doublet, w).focal_length for w in (LINE_F, LINE_C, LINE_D)}
    assert lengths[LINE_D] == pytest.approx(f, rel=1e-4)
    assert lengths[LINE_F] == pytest.approx(lengths[LINE_C], rel=1e-6)
    waves = np.linspace(450.0, 650.0, 21)
    spread = np.ptp([lenses.cardinal(doublet, w).back_focus for w in waves])
    alone = singlet(2.0 * (crown.sample(LINE_D) - 1.0) * f, -2.0 * (crown.sample(LINE_D) - 1.0) * f,
                    thin, crown)  # fmt: skip
    wide = np.ptp([lenses.cardinal(alone, w).back_focus for w in waves])
    n = crown.sample(waves)
    assert wide == pytest.approx(f * np.ptp((crown.sample(LINE_D) - 1.0) / (n - 1.0)), rel=1e-3)
    thin_lens = 1.0 / (c1 * (n - 1.0) + c2 * (flint.sample(waves) - 1.0))
    assert spread == pytest.approx(np.ptp(thin_lens), rel=1e-3)
    assert spread < 0.09 * wide


def test_conics_and_aspheres_bring_light_to_a_point():
    """A plane and a hyperboloid of k = -n^2 have no spherical aberration (Hecht 2017, 5.2)."""
    lens = singlet(0.0, -50.0, 6.0, conic=-(1.5**2))
    at = crossings(parallel(lens, [1.0, 4.0, 5.9]))
    np.testing.assert_allclose(at, lens.length + 100.0, rtol=1e-12)
    ball = crossings(parallel(singlet(0.0, -50.0, 6.0), [1.0, 4.0, 5.9]))
    assert np.ptp(ball) > 1.0
    # The same surface as a sphere and the difference's series, c^3 (1 - (1 + k)^..) r^4 / 8 ...
    c, k = -1.0 / 50.0, -(1.5**2)
    terms = [
        (f - 1.0) * b * c**p
        for f, b, p in (
            (1.0 + k, 1 / 8, 3), ((1.0 + k) ** 2, 1 / 16, 5), ((1.0 + k) ** 3, 5 / 128, 7),
            ((1.0 + k) ** 4, 7 / 256, 9),
        )
    ]  # fmt: skip
    series = singlet(0.0, -50.0, 6.0, aspheric=tuple(terms))
    np.testing.assert_allclose(
        crossings(parallel(series, [1.0, 4.0, 5.9])), lens.length + 100.0, rtol=1e-7
    )


def test_size_and_focal_length_go_together():
    lens = singlet(40.0, -60.0, 5.0, conic=-0.4, aspheric=(1e-6, -2e-9))
    large = lens.scaled(3.0)
    assert lenses.cardinal(large).focal_length == pytest.approx(
        3.0 * lenses.cardinal(lens).focal_length
    )
    y = np.array([5.0])
    o = np.stack([0.0 * y, y, np.full(1, -50.0)], axis=1)
    small = trace(lens, Rays.of(o, np.array([[0.0, 0.0, 1.0]])))
    big = trace(large, Rays.of(3.0 * o, np.array([[0.0, 0.0, 1.0]])))
    np.testing.assert_allclose(big.d, small.d, rtol=1e-12)


def test_pupils_hold_all_light():
    """What comes from any place of the film goes through its ring's ellipse, at any wavelength."""
    lens = lenses.library("double_gauss")
    rng = np.random.default_rng(4)
    n, distance, radius = 20000, 38.0, 22.0
    rows = zones(lens, distance, radius)
    place = np.sqrt(rng.random(n)) * radius * 0.999
    size = lens.surfaces[-1].semi_diameter
    x, y = rng.uniform(-size, size, (2, n))
    o = np.stack([place, 0.0 * place, np.full(n, lens.length + distance)], axis=1)
    d = np.stack([x - place, y, np.full(n, -distance)], axis=1)
    for wavelength in (400.0, LINE_D, 700.0):
        alive = trace(lens, Rays.of(o, d), wavelength, backwards=True).alive
        assert 0.2 < alive.mean() < 0.9
        middle, along, across = rows[(place / radius * ZONES).astype(int)].T
        inside = ((x - middle) / along) ** 2 + (y / across) ** 2
        assert inside[alive].max() <= 1.0
        assert (inside <= 1.0).sum() < 1.35 * alive.sum()  # and little else does
    hole = singlet(100.0, -100.0, 1.0).with_stop(0.5)
    assert axis_solid_angle(hole, 100.0) == pytest.approx(np.pi * 0.005**2, rel=0.05)


def test_coatings():
    """A quarter wave: R = ((n0 ns - n1^2) / (n0 ns + n1^2))^2 (Macleod 2010, 4.1)."""
    at = np.array([550.0])
    assert reflectance(1.0, 1.5, (), at)[0] == pytest.approx(0.04)
    single = (quarter_wave(1.38),)
    expected = ((1.6 - 1.38**2) / (1.6 + 1.38**2)) ** 2
    assert reflectance(1.0, 1.6, single, at)[0] == pytest.approx(expected, rel=1e-9)
    assert reflectance(1.6, 1.0, single, at)[0] == pytest.approx(expected, rel=1e-9)
    waves = np.linspace(430.0, 670.0, 25)
    means = [reflectance(1.0, 1.6, coats, waves).mean() for coats in COATINGS.values()]
    assert means[0] > 3.0 * means[1] > 6.0 * means[2]
    lens = lenses.library("double_gauss").with_coating(single)
    coated = [bool(surface.coating) for surface in lens.surfaces]
    # Not between glasses, and not at the stop.
    assert coated == [True, True, True, False, True, False, True, False, True, True, True]


def test_glasses():
    found = by_number(1.5168, 64.17)
    assert found.sample(LINE_D) == pytest.approx(1.5168)
    assert 0.5168 / (found.sample(LINE_F) - found.sample(LINE_C)) == pytest.approx(64.17)
    assert by_name("N-BK7").sample(LINE_D) == pytest.approx(1.5168, abs=1e-5)
    assert by_name("Nonsuch", 1.7, 40.0) == by_number(1.7, 40.0)
    with pytest.raises(SceneError, match="'Nonsuch' is not known"):
        by_name("Nonsuch")


ROWS = """# a doublet, f/8
# radius thickness index diameter
60 4 1.6 20
-60 1 1.0 20
0 2 0 8   # the stop
-100 2 1.5 20
100 0 1 20
"""
BENCH = """[descriptive data]
title\tA triplet
[variable distances]
d2\t3.5\t4.5
Aperture Diameter\t8
[lens data]
1\t40\t4\t1.6\t20\t60.3
2\t-60\td2\t\t20
3\tAS\t2\t\t
4\t-50\t2\t1.7\t16\t30
5\tInfinity\tBf\t\t16
[aspherical data]
5\tInfinity\t0\t1E-5\t-2E-8
[coating]
1\t1.38\t99.6
"""
ZMX = """VERS 140124
MODE SEQ
NAME A singlet
UNIT MM X W X CM MR CPMM
SURF 0
  TYPE STANDARD
  CURV 0.0 0 0 0 0
  DISZ INFINITY
SURF 1
  STOP
  TYPE STANDARD
  CURV 0.02 0 0 0 0 ""
  CONI -0.5
  DISZ 5
  GLAS N-BK7 0 0 1.5 40 0 0 0 0 0 0
  DIAM 10 1 0 0 1 ""
SURF 2
  TYPE EVENASPH
  CURV -0.01 0 0 0 0
  PARM 1 0
  PARM 2 1e-6
  DISZ 90
  DIAM 10
SURF 3
  TYPE STANDARD
  CURV 0
  DISZ 0
"""


def made(tmp_path: Path, name: str, text: str, encoding: str = "utf-8") -> Prescription:
    path = tmp_path / name
    path.write_bytes(text.encode(encoding))
    return lenses.read(path)


def test_files(tmp_path):
    rows = made(tmp_path, "a.dat", ROWS)
    assert rows.stop == 2 and rows.surfaces[2].semi_diameter == 4.0
    assert rows.surfaces[0].glass == Constant(1.6) and rows.source == "a doublet, f/8"
    bench = made(tmp_path, "b.txt", BENCH)
    assert bench.name == "A triplet" and bench.surfaces[1].thickness == 3.5
    assert bench.surfaces[2].semi_diameter == 4.0 and bench.stop == 2
    assert bench.surfaces[4].aspheric == (1e-5, -2e-8)
    assert bench.surfaces[0].coating[0].thickness == 99.6
    for encoding in ("utf-8", "utf-16"):
        zmx = made(tmp_path, "c.zmx", ZMX, encoding)
        assert zmx.name == "A singlet" and zmx.surfaces[0].radius == 50.0
        assert zmx.surfaces[0].conic == -0.5 and zmx.surfaces[1].aspheric == (1e-6,)
        assert zmx.surfaces[0].glass == spectra.glass("n-bk7")


@pytest.mark.parametrize(
    ("name", "text", "old", "new", "message"),
    [
        ("a.dat", ROWS, "-60 1 1.0 20", "-60 1 1.0", r"a\.dat:4: a row has 4 numbers, not 3"),
        ("a.dat", ROWS, "-60 1", "x 1", r"a\.dat:4: a radius must be a number, not 'x'"),
        ("a.dat", ROWS, "-60 1", "nan 1", r"a\.dat:4: a radius must be a number"),
        ("a.dat", ROWS, "60 4 1.6 20", "6 4 1.6 20", r"a\.dat:3: a surface of radius 6 cannot"),
        ("a.dat", ROWS, "1.6", "0.6", r"a\.dat:3: an index lies between 1 and 5, not 0\.6"),
        ("a.dat", ROWS, "0 2 0 8", "9 2 1 8", r"a\.dat: a lens has one stop, not 0"),
        ("a.dat", ROWS, "0 2 0 8", "0 2 0 0", r"a\.dat:5: a semi-diameter must be above 0"),
        ("a.dat", ROWS, "100 0 1 20", "100 0 1.5 20", "behind its last surface"),
        ("a.dat", ROWS, ROWS, "", "1 to 100 surfaces, not 0"),
        ("b.txt", BENCH, "[lens data]", "[data]", r"b\.txt: has no table \[lens data\]"),
        ("b.txt", BENCH, "d2\t\t20", "d7\t\t20", r"b\.txt:8: a thickness must be a number"),
        ("b.txt", BENCH, "\t60.3", "\t0.3", r"b\.txt:7: an Abbe number lies between"),
        ("b.txt", BENCH, "5\tInfinity\t0", "9\tInfinity\t0", r"b\.txt:13: there is no surface '9'"),
        ("b.txt", BENCH, "1.38\t99.6", "1.38", r"b\.txt:15: a coating is pairs"),
        ("b.txt", BENCH, "2\t-60", "1\t-60", r"b\.txt:8: the surface '1' is given twice"),
        ("c.zmx", ZMX, "MODE SEQ", "MODE NSC", r"c\.zmx:2: only sequential"),
        ("c.zmx", ZMX, "EVENASPH", "BICONICX", r"c\.zmx:18: a surface is one of STANDARD"),
        ("c.zmx", ZMX, "N-BK7 0 0 1.5", "MIRROR 0 0 1.5", r"c\.zmx:15: mirrors are not"),
        ("c.zmx", ZMX, "N-BK7 0 0 1.5 40", "NO-GLASS", r"c\.zmx:15: the glass 'NO-GLASS'"),
        ("c.zmx", ZMX, "UNIT MM", "UNIT FURLONG", r"c\.zmx:4: the unit is one of"),
        ("c.zmx", ZMX, "PARM 1 0", "PARM 1 1e-3", r"c\.zmx:17: a term of r\^2"),
        ("d.lens", ROWS, "", "", r"a lens file ends in \.dat, \.zmx, \.txt"),
    ],
)  # fmt: skip
def test_malformed_files_are_refused_with_the_line(tmp_path, name, text, old, new, message):
    assert old in text
    with pytest.raises(SceneError, match=message):
        made(tmp_path, name, text.replace(old, new, 1) if old else text)
