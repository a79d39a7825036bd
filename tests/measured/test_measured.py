"""Measured materials: their files, how one is made of a function, and what kernels make of it."""

from __future__ import annotations

import contextlib
import dataclasses
import struct

import numpy as np
import pytest

import clpt
from clpt import measured
from clpt.errors import SceneError
from clpt.formats.pbrt.materials import material as pbrt_material
from clpt.measured import measurement
from clpt.scene import materials
from clpt.testing.probe import LAMBDAS
from tests.formats.pbrt.test_pbrt_materials import params, state
from tests.kernels.harness import Probe
from tests.measured.surfaces import directions, facets, metal

NODES = np.array([400.0, 450.0, 520.0, 560.0, 620.0, 700.0])
COLOURS = np.linspace(0.3, 0.9, len(NODES))


def coarse(*alphas, **given):
    """The measurement of a rough metal at few directions."""
    made = {"normals": 32, "size": 16} | given
    return measured.fit(metal(*alphas, colour=COLOURS), NODES, **made)


@pytest.fixture(scope="module")
def metals():
    quarter = np.linspace(-np.pi, -0.5 * np.pi, 3)
    return {
        "isotropic": coarse(0.4),
        "quarter": coarse(0.4, 0.2, phi_i=quarter),
        "half": coarse(0.4, 0.2, phi_i=np.linspace(-np.pi, 0.0, 5)),
    }


def same(a, b):
    names = [one.name for one in dataclasses.fields(a)]
    return all(np.array_equal(getattr(a, name), getattr(b, name)) for name in names)


def test_files_give_back_what_was_written(tmp_path, metals):
    path = tmp_path / "a.bsdf"
    rgb = measured.fit(metal(0.5), normals=16, size=8, description="of three colours: öd")
    for data in (*metals.values(), rgb):
        measured.write(path, data)
        assert same(measured.read(path), data)


def test_other_programs_read_and_write_tensor_files(tmp_path):
    other = pytest.importorskip("mitsuba.python.tensor_io")
    rng = np.random.default_rng(1)
    given = {"a": rng.random((2, 3)).astype(np.float32), "bc": np.arange(5, dtype=np.int16)}
    ours, theirs = tmp_path / "ours", tmp_path / "theirs"
    measurement.write_tensors(ours, given)
    other.write(str(theirs), **given)
    for found in (
        other.read(str(ours)),
        measurement.read_tensors(ours),
        measurement.read_tensors(theirs),
    ):
        assert found.keys() == given.keys()
        assert all(np.array_equal(found[name], given[name]) for name in given)


def _field(name=b"a", axes=1, kind=10, offset=0, shape=(1,)):
    head = struct.pack("<H", len(name)) + name + struct.pack("<HBQ", axes, kind, offset)
    return head + struct.pack(f"<{len(shape)}Q", *shape)


HEAD = b"tensor_file\0\1\0"


@pytest.mark.parametrize(
    "content, message",
    [
        (b"", "no tensor file"),
        (b"PNG" * 50, "no tensor file"),
        (b"tensor_file\0\2\0\1\0\0\0", "version 2.0"),
        (HEAD, "ends within its list of fields"),
        (HEAD + b"\xff\xff\xff\xff", "4,294,967,295 fields"),
        (HEAD + b"\2\0\0\0" + _field(), "ends within its list of fields"),
        (HEAD + b"\1\0\0\0" + _field(axes=9999), "cannot have 9999 axes"),
        (HEAD + b"\1\0\0\0" + _field(kind=99), "unknown type"),
        (HEAD + b"\1\0\0\0" + _field(shape=(1 << 40,)), "'a' goes beyond its end"),
        (HEAD + b"\1\0\0\0" + _field(axes=2, shape=(1 << 63, 1 << 63)), "goes beyond its end"),
        (HEAD + b"\1\0\0\0" + _field(axes=2, shape=(1 << 62, 0)), "goes beyond its end"),
        (HEAD + b"\1\0\0\0" + _field(offset=1 << 62), "goes beyond its end"),
        (HEAD + b"\1\0\0\0" + _field(), "no field 'phi_i'; it has 'a'"),
    ],
)
def test_damaged_files_are_refused(tmp_path, content, message):
    path = tmp_path / "bad.bsdf"
    path.write_bytes(content)
    with pytest.raises(SceneError, match=message) as caught:
        measured.read(path)
    assert caught.value.file == path


@pytest.mark.parametrize(
    "name, change, message",
    [
        ("vndf", lambda v: v[:, :3], "'vndf' is of 1 x 3 viewers, but .* of 1 x 8"),
        ("vndf", lambda v: v[0], r"'vndf' must be \(phi, theta, rows, columns\)"),
        ("ndf", lambda v: v * np.nan, "'ndf' has a number that is negative or not finite"),
        ("ndf", lambda v: 0.0 * v, "'ndf' and 'sigma' must be above 0"),
        ("sigma", lambda v: v[:1], "'sigma' must have two rows"),
        ("spectra", lambda v: -v, "'spectra' has a number that is negative"),
        ("spectra", lambda v: v[:, :, :2], "'spectra' has 2 colours, not 6"),
        ("spectra", lambda v: v[..., :4], "'luminance' and 'spectra' must have the same rows"),
        ("theta_i", lambda v: v[::-1], "'theta_i' must be finite numbers that ascend"),
        ("theta_i", lambda v: 2.0 * v, "'theta_i' must lie within 0 and pi / 2"),
        ("phi_i", lambda v: v[:0], "'phi_i' and 'theta_i' must have an angle"),
        ("wavelengths", lambda v: v * np.inf, "'wavelengths' must be finite"),
        ("luminance", lambda v: v.astype(np.uint8), "'luminance' must be of floats"),
        ("jacobian", lambda v: np.zeros(2, np.uint8), "'jacobian' must be one number"),
    ],
)
def test_what_does_not_match_is_refused(tmp_path, metals, name, change, message):
    path = tmp_path / "bad.bsdf"
    measured.write(path, metals["isotropic"])
    fields = measurement.read_tensors(path)
    measurement.write_tensors(path, fields | {name: change(fields[name])})
    with pytest.raises(SceneError, match=message):
        measured.read(path)


def test_azimuths_of_a_third_are_refused(metals):
    thirds = np.linspace(0.0, 2.0 * np.pi / 3.0, 5)
    with pytest.raises(SceneError, match="covers 1 / 3 of the circle"):
        dataclasses.replace(metals["half"], phi_i=thirds)


def test_cut_and_scrambled_files_are_read_or_refused(tmp_path, metals):
    path, rng = tmp_path / "a.bsdf", np.random.default_rng(3)
    measured.write(path, metals["isotropic"])
    whole = path.read_bytes()
    for _ in range(100):
        bad = bytearray(whole[: rng.integers(len(whole))] if rng.integers(2) else whole)
        for at in rng.integers(0, min(len(bad), 400) or 1, 4):
            bad[at : at + 1] = bytes([rng.integers(256)]) * bool(bad)
        path.write_bytes(bad)
        with contextlib.suppress(SceneError):
            measured.read(path)


def test_the_distribution_of_facets_is_found():
    """But for masking, which is not taken for the same both ways where light is sent back."""
    made = measured.fit(metal(0.4), normals=64, size=4)
    theta = 0.5 * np.pi * np.linspace(0.0, 1.0, 64) ** 2
    h = np.stack([np.sin(theta), 0.0 * theta, np.cos(theta)], axis=1)
    expected = facets(h, 0.4, 0.4)
    np.testing.assert_allclose(made.ndf[0], expected, rtol=0.0, atol=0.04 * expected.max())


def test_what_cannot_be_measured_is_refused():
    with pytest.raises(SceneError, match="nothing is sent back"):
        measured.fit(lambda wo, wi: 0.0 * wi)
    with pytest.raises(SceneError, match="negative or not finite"):
        measured.fit(lambda wo, wi: np.where(wi == wo, 1.0, np.nan), normals=8, size=4)


@pytest.mark.parametrize("name", ["isotropic", "quarter", "half"])
def test_kernels_have_the_function_again(metals, name):
    """The mean error of f cos, in spectra, of a metal that was measured at few directions."""
    rng = np.random.default_rng(4)
    wo, wi = directions(rng, 2000, 0.3), directions(rng, 2000)
    found = Probe(materials.Measured, "spectral")({"data": metals[name]}, wo, wi, wo)["eval"]
    colour = np.interp(LAMBDAS, NODES, COLOURS)
    alphas = (0.4, 0.4) if name == "isotropic" else (0.4, 0.2)
    expected = metal(*alphas, colour=colour)(wo, wi) * wi[:, 2:]
    assert np.abs(found - expected).sum() < 0.04 * expected.sum()


def test_red_green_and_blue_have_a_mode_each(metals):
    """Of three colours in spectral mode and of spectra in RGB mode the mean is near the other's."""
    rng = np.random.default_rng(5)
    wo, wi = directions(rng, 500), directions(rng, 500)
    even = dataclasses.replace(metals["isotropic"], spectra=metals["isotropic"].spectra * 0 + 0.3)
    grey = dataclasses.replace(even, spectra=even.spectra[:, :, :3], wavelengths=())
    found = [
        Probe(materials.Measured, mode)({"data": data}, wo, wi, wo)["eval"].mean(axis=1)
        for mode in ("rgb", "spectral")
        for data in (even, grey)
    ]
    for one in found[1:]:
        np.testing.assert_allclose(one, found[0], rtol=0.003)


def test_is_read_from_every_format(tmp_path, metals):
    measured.write(tmp_path / "a.bsdf", metals["quarter"])
    (tmp_path / "a.xml").write_text(
        '<scene version="3.0.0"><shape type="sphere"><bsdf type="twosided"><bsdf type="measured">'
        '<string name="filename" value="a.bsdf"/></bsdf></bsdf></shape></scene>'
    )
    (tmp_path / "a.json").write_text(
        '{"camera": {"type": "perspective"}, "shapes": [{"type": "sphere", "material":'
        ' {"type": "measured", "data": "a.bsdf"}}]}'
    )
    found = [clpt.load(tmp_path / name).shapes[0].material for name in ("a.xml", "a.json")]
    at = state()
    at.shared.folder = tmp_path
    found.append(pbrt_material("measured", params(filename=("string", "a.bsdf")), at))
    for one in (found[0].front, found[1], found[2].front):
        assert same(one.data, metals["quarter"]) and one.uses_tangents
    with pytest.raises(SceneError, match=r"there is no file 'b\.bsdf'"):
        pbrt_material("measured", params(filename=("string", "b.bsdf")), at)


@pytest.mark.peers
@pytest.mark.parametrize("name", ["isotropic", "quarter", "half"])
def test_is_what_mitsuba_makes_of_the_file(tmp_path, metals, name):
    mi = pytest.importorskip("mitsuba", reason="the renderer that we compare with")
    mi.set_variant("scalar_spectral")
    measured.write(tmp_path / "a.bsdf", metals[name])
    theirs = mi.load_dict({"type": "measured", "filename": str(tmp_path / "a.bsdf")})
    rng, context = np.random.default_rng(6), mi.BSDFContext()
    wo, wi, u = directions(rng, 200, 0.0), directions(rng, 200, 0.0), rng.random((200, 3))
    ours = Probe(materials.Measured, "spectral")({"data": metals[name]}, wo, wi, u)
    seen = mi.SurfaceInteraction3f()
    seen.wavelengths = list(LAMBDAS)
    near = {"rtol": 1e-3, "atol": 1e-4}
    for i in range(len(wo)):
        seen.wi, other = mi.Vector3f(*map(float, wo[i])), mi.Vector3f(*map(float, wi[i]))
        np.testing.assert_allclose(ours["eval"][i], [*theirs.eval(context, seen, other)], **near)
        np.testing.assert_allclose(ours["pdf"][i], theirs.pdf(context, seen, other), **near)
        sample, weight = theirs.sample(context, seen, 0.5, mi.Point2f(*map(float, u[i, :2])))
        if max(weight) > 0.0:
            np.testing.assert_allclose(ours["wi"][i], [*sample.wo], atol=3e-4)
            np.testing.assert_allclose(ours["sampled_pdf"][i], sample.pdf, rtol=2e-3)
            np.testing.assert_allclose(ours["weight"][i], [*weight], rtol=1e-3)
