"""Tables of MERL: their files, what kernels make of them, how they are sampled."""

from __future__ import annotations

import struct

import numpy as np
import pytest

import clpt
from clpt import measured
from clpt.errors import SceneError
from clpt.scene import materials
from clpt.spectra.spectrum import primaries
from clpt.testing import checks
from clpt.testing.probe import LAMBDAS
from tests.kernels.harness import Probe
from tests.measured.surfaces import directions, metal

COLOUR = (0.9, 0.6, 0.3)
STEPS = (45, 30, 60)


@pytest.fixture(scope="module")
def table():
    return measured.tabulate(metal(0.3, colour=COLOUR), STEPS)


def test_files_give_back_what_was_written(tmp_path, table):
    measured.write_merl(tmp_path / "a.binary", table)
    np.testing.assert_array_equal(measured.read_merl(tmp_path / "a.binary").values, table.values)
    (tmp_path / "a.json").write_text(
        '{"camera": {"type": "perspective"}, "shapes": [{"type": "sphere", "material":'
        ' {"type": "merl", "data": "a.binary"}}]}'
    )
    found = clpt.load(tmp_path / "a.json").shapes[0].material.data
    np.testing.assert_array_equal(found.values, table.values)


def test_a_file_has_the_published_layout(tmp_path):
    """Red, green and blue one after the other, azimuths fastest; the numbers times 1, 1.15, 1.66
    over 1500."""
    numbers = np.arange(3 * 2 * 3 * 4, dtype=float)
    (tmp_path / "a.binary").write_bytes(struct.pack("<3i", 2, 3, 4) + numbers.tobytes())
    found = measured.read_merl(tmp_path / "a.binary").values
    assert found[1, 2, 3].tolist() == pytest.approx([23 / 1500, 1.15 * 47 / 1500, 1.66 * 71 / 1500])
    assert found[0, 1, 2, 0] == pytest.approx(6 / 1500)


@pytest.mark.parametrize(
    "content, message",
    [
        (b"", "cannot be 0 x 0 x 0"),
        (struct.pack("<3i", -90, 90, 180), "cannot be -90 x 90 x 180"),
        (struct.pack("<3i", 1 << 30, 1 << 30, 1 << 30), "no table of MERL"),
        (struct.pack("<3i", 90, 90, 180), "must have 34,992,012 bytes by its header, found 12"),
        (struct.pack("<3i24d", 2, 2, 2, *[np.nan] * 24), "a number that is not finite"),
        (struct.pack("<3i24d", 2, 2, 2, *[1e300] * 24), "a number that is not finite"),
        (struct.pack("<3i24d", 2, 2, 2, *[-1.0] * 24), "no number from 0 on"),
    ],
)
def test_damaged_files_are_refused(tmp_path, content, message):
    (tmp_path / "bad.binary").write_bytes(content)
    with pytest.raises(SceneError, match=message) as caught:
        measured.read_merl(tmp_path / "bad.binary")
    assert caught.value.file == tmp_path / "bad.binary"


@pytest.mark.parametrize("mode", ["rgb", "spectral"])
def test_kernels_have_the_function_again(table, mode):
    rng = np.random.default_rng(4)
    wo, wi = directions(rng, 2000, 0.3), directions(rng, 2000, 0.2)
    probe = Probe(materials.Merl, mode)
    found = probe({"data": table}, wo, wi, wo)["eval"]
    expected = metal(0.3, colour=COLOUR)(wo, wi) * wi[:, 2:]
    if mode == "spectral":
        expected = expected @ np.array([one.sample(LAMBDAS) for one in primaries()])
    assert np.abs(found - expected).sum() < 0.03 * expected.sum()


@pytest.mark.parametrize("mode", ["rgb", "spectral"])
def test_light_is_sampled_by_the_table(table, mode):
    """By chi-square, and with weights of little spread where a metal shines."""
    rng, probe = np.random.default_rng(7), Probe(materials.Merl, mode)
    checks.samples_follow_the_pdf(probe, {"data": table}, rng, 1e-4)
    for degrees in (5.0, 45.0, 75.0):
        theta = np.radians(degrees)
        wo = np.array([[np.sin(theta), 0.0, np.cos(theta)]])
        made = probe({"data": table}, wo, wo, rng.random((20_000, 3)))
        weight = made["weight"].mean(axis=1) * (made["sampled_pdf"] > 0.0)
        assert weight.std() < 0.35 * weight.mean(), degrees
