"""Pictures on Mesa's rusticl with llvmpipe, another OpenCL on the same processor.

The driver must be installed (Debian: mesa-opencl-icd). Where its file rusticl.icd is not in the
system's folder, the variable CLPT_RUSTICL names the folder.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import clpt
from tests.test_oclgrind import small_scene

ROOT = Path(__file__).resolve().parents[1]
ICD = Path(os.environ.get("CLPT_RUSTICL", "/etc/OpenCL/vendors")) / "rusticl.icd"
RENDER = """
import sys
import numpy as np
import clpt
from clpt import device
from tests.test_oclgrind import small_scene
name, mode, layout, path = sys.argv[1:]
with clpt.Renderer(small_scene(name, mode), layout=layout, slots=64) as renderer:
    assert "rusticl" in renderer.device.info.label
    renderer.run(16)
    np.save(path, renderer.image())
"""

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not ICD.is_file(), reason="Mesa's rusticl is not installed"),
]


@pytest.mark.parametrize(("name", "mode", "layout"), [("cornell", "rgb", "brute")])
def test_the_same_picture(tmp_path: Path, name: str, mode: str, layout: str) -> None:
    """The same samples: means within 1 %, though single paths may go another way."""
    vendors = tmp_path / "vendors"
    vendors.mkdir()
    (vendors / ICD.name).write_text(ICD.read_text())
    own = {"OCL_ICD_VENDORS": str(vendors), "RUSTICL_ENABLE": "llvmpipe", "PYTHONPATH": str(ROOT)}
    path = tmp_path / "picture.npy"
    environment = {k: v for k, v in os.environ.items() if k != "CLPT_DEVICE"} | own
    done = subprocess.run(
        [sys.executable, "-c", RENDER, name, mode, layout, str(path)],
        capture_output=True, text=True, timeout=900, cwd=tmp_path, env=environment, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    picture, expected = np.load(path), clpt.render(small_scene(name, mode), 16, layout=layout)
    assert picture.shape == expected.shape
    np.testing.assert_allclose(picture.mean((0, 1)), expected.mean((0, 1)), rtol=0.01)
