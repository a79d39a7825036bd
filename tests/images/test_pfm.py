"""Portable float maps: the scale's value and sign, channels, headers."""

from __future__ import annotations

import numpy as np
import pytest

from clpt import images
from clpt.errors import SceneError


@pytest.mark.parametrize(
    ("scale", "order"), [("-1", "<"), ("2.0", ">"), ("-0.5", "<"), ("1e1", ">")]
)
@pytest.mark.parametrize(("kind", "channels"), [("Pf", 1), ("PF", 3), ("PF4", 4)])
def test_scale_and_channels(tmp_path, scale, order, kind, channels):
    """Rows from the bottom, times the scale's absolute value: Mitsuba and pbrt do so."""
    values = np.arange(6 * channels, dtype=np.float32).reshape(2, 3, channels)
    path = tmp_path / "a.pfm"
    data = values[::-1].astype(f"{order}f4").tobytes()
    path.write_bytes(f"{kind}\n3 2\n{scale}\n".encode() + data)
    np.testing.assert_allclose(images.read(path), values * abs(float(scale)), rtol=1e-6)
    np.testing.assert_allclose(images.read(path, linear=False), images.read(path))
    mi = pytest.importorskip("mitsuba")
    if kind != "PF4":
        mi.set_variant("scalar_rgb")
        theirs = np.array(mi.Bitmap(str(path))).reshape(values.shape)
        np.testing.assert_allclose(images.read(path), theirs, rtol=1e-6)


@pytest.mark.parametrize("head", ["PF 3 2 -1\n", "PF\r\n3 2\r\n-1.0\r\n", "PF\n3\n2\n-1\n"])
def test_headers(tmp_path, head):
    values = np.arange(18, dtype=np.float32)
    (tmp_path / "a.pfm").write_bytes(head.encode() + values.tobytes())
    assert images.read(tmp_path / "a.pfm")[1, 0].tolist() == [0, 1, 2]


@pytest.mark.parametrize("scale", ["0", "-0.0", "1e999", "1.2.3"])
def test_scales_that_are_none(tmp_path, scale):
    (tmp_path / "a.pfm").write_bytes(f"PF\n1 1\n{scale}\n".encode() + bytes(12))
    with pytest.raises(SceneError, match="scale must be a number other than 0"):
        images.read(tmp_path / "a.pfm")
