"""Measurements of polarised light: their unpolarised part, against a formula and Mitsuba."""

from __future__ import annotations

import numpy as np
import pytest

import clpt
from clpt import measured
from clpt.errors import SceneError
from clpt.measured.measurement import write_tensors
from clpt.scene import materials
from tests.kernels.harness import Probe
from tests.measured.surfaces import directions

STEPS = {"phi_d": 37, "theta_d": 31, "theta_h": 61}
LAMBDAS = np.array([450, 500, 550, 600, 650], np.uint16)
SLOPES = np.linspace(0.5, 1.5, 5)  # of the numbers over the wavelengths


def reflection(phi, difference, halfway):
    """An f [1/sr] that is smooth in the angles of halfway and difference, and reciprocal."""
    return 0.1 + 0.2 * np.exp(-6.0 * halfway**2) * (1.0 + 0.3 * np.cos(2.0 * phi) * difference)


def tensors(with_angles=True):
    ends = {"phi_d": (-np.pi, np.pi), "theta_d": (0, np.pi / 2), "theta_h": (0, np.pi / 2)}
    axes = {name: np.linspace(*ends[name], n).astype(np.float32) for name, n in STEPS.items()}
    f = reflection(*np.meshgrid(*axes.values(), indexing="ij"))
    matrices = np.zeros((*f.shape, 5, 4, 4), np.float32)
    matrices[..., 0, 0] = f[..., None] * SLOPES
    matrices[..., 1, 1] = 0.5
    shown = {k: v[None] if with_angles else np.zeros((0, len(v)), "f4") for k, v in axes.items()}
    return {**shown, "wvls": LAMBDAS, "M": matrices}


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("polarized") / "a.pbsdf"
    write_tensors(path, tensors())
    return path


def values(table):
    rng = np.random.default_rng(4)
    wo, wi = directions(rng, 500, 0.3), directions(rng, 500, 0.3)
    return wo, wi, Probe(materials.Merl, "rgb")({"data": table}, wo, wi, wo)["eval"]


@pytest.mark.parametrize("with_angles", [True, False])
def test_the_first_number_of_the_matrices(tmp_path, with_angles):
    path = tmp_path / "a.pbsdf"
    write_tensors(path, tensors(with_angles))
    wo, wi, found = values(measured.read_polarized(path, 575.0))
    h = (wo + wi) / np.linalg.norm(wo + wi, axis=1, keepdims=True)
    halfway, difference = np.arccos(h[:, 2]), np.arccos((wi * h).sum(axis=1))
    b = np.cross([0.0, 0.0, 1.0], h)
    b /= np.linalg.norm(b, axis=1, keepdims=True)
    phi = np.arctan2((wi * b).sum(axis=1), (wi * np.cross(b, h)).sum(axis=1))
    expected = 1.125 * reflection(phi, difference, halfway) * wi[:, 2]
    np.testing.assert_allclose(found, np.repeat(expected[:, None], 3, 1), rtol=0.02)


def test_colours_are_those_of_the_wavelengths(file):
    table = measured.read_polarized(file).values
    lit = table[..., 0] > 0.0
    colour = clpt.spectra.Tabulated(LAMBDAS.tolist(), (SLOPES / 2).tolist(), "hold").to_rgb()
    share = table[lit] / table[lit].mean(axis=1, keepdims=True)
    np.testing.assert_allclose(share, np.broadcast_to(colour / colour.mean(), share.shape), 1e-4)


def test_same_light_as_mitsuba(file):
    mi = pytest.importorskip("mitsuba", reason="the renderer that we compare with is not installed")
    mi.set_variant("scalar_rgb")
    theirs = mi.load_dict(
        {"type": "measured_polarized", "filename": str(file), "wavelength": 550.0}
    )
    wo, wi, found = values(measured.read_polarized(file, 550.0))
    si, expected = mi.SurfaceInteraction3f(), np.empty(len(wo))
    for i, (view, light) in enumerate(zip(wo.tolist(), wi.tolist(), strict=True)):
        si.wi = mi.Vector3f(*view)
        expected[i] = theirs.eval(mi.BSDFContext(), si, mi.Vector3f(*light))[1]
    np.testing.assert_allclose(found[:, 1], expected, rtol=0.02)


def test_mitsubas_material(file):
    scene = file.with_name("scene.xml")
    scene.write_text(
        '<scene version="3.0.0"><shape type="sphere"><bsdf type="measured_polarized"><string '
        'name="filename" value="a.pbsdf"/><float name="alpha_sample" value="0.02"/></bsdf></shape>'
        "</scene>"
    )
    loaded = clpt.load(scene)
    expected = measured.read_polarized(file).values
    np.testing.assert_array_equal(loaded.shapes[0].material.data.values, expected)
    assert any("no polarisation" in warning for warning in loaded.warnings)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("M", np.zeros((2, 2, 2, 5, 4)), "no measurement of polarised light"),
        ("M", np.zeros((2, 2, 2, 4, 4, 4)), "no measurement of polarised light"),
        ("phi_d", np.zeros((1, 37)), "'phi_d' must be 37 angles that ascend"),
    ],
)
def test_damaged_files_are_refused(tmp_path, name, value, message):
    write_tensors(tmp_path / "a.pbsdf", {**tensors(), name: value})
    with pytest.raises(SceneError, match=message) as caught:
        measured.read_polarized(tmp_path / "a.pbsdf")
    assert caught.value.file == tmp_path / "a.pbsdf"
