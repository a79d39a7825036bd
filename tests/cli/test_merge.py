"""`clpt merge`: films of ranges of samples, added to the bit, without a device."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import OpenEXR
import pytest

from clpt import images
from clpt.__main__ import run
from clpt.render.film import film_file
from tests.cli import killing

KINDS = {
    "rgb": ["--mode", "rgb"],
    "alpha": ["--mode", "rgb", "--alpha"],
    "bands": ["--mode", "spectral", "--bands", "4"],
    "light": ["--mode", "rgb", "--light-paths", "1"],
}
SUFFIX = {"bands": ".npy"}


def render(output, *more: str) -> int:
    common = ["-o", str(output), "--size", "24x16", "--quiet"]
    return run(["render", killing.SCENE, *common, *more])


@pytest.mark.parametrize(
    "kind",
    KINDS,
)
def test_ranges_add_to_one_render(tmp_path, kind):
    for name, given in (("a", "0:5"), ("b", "5:6"), ("c", "6:12")):
        assert render(tmp_path / f"{name}.film", "--samples", given, *KINDS[kind]) == 0
    suffix = SUFFIX.get(kind, ".exr")
    whole = [tmp_path / f"whole{one}" for one in (".film", suffix)]
    assert render(whole[0], "-o", str(whole[1]), "--spp", "12", *KINDS[kind]) == 0
    films = [str(tmp_path / f"{name}.film") for name in "cab"]
    made = [tmp_path / f"sum{one}" for one in (".film", suffix, ".png")]
    given = [word for path in made for word in ("-o", str(path))]
    assert run(["merge", *films, *given, "--quiet"]) == 0
    one, other = (film_file.read(path).film for path in (made[0], whole[0]))
    np.testing.assert_array_equal(one.words, other.words)
    np.testing.assert_array_equal(one.bands, other.bands)
    assert one.taken == other.taken == ((0, 12),)
    pictures = [images.read(path) for path in (made[1], whole[1])]
    np.testing.assert_allclose(*pictures, rtol=1e-3, atol=1e-6)  # .exr has 11 bits
    assert made[2].exists()


def test_no_device_is_needed(tmp_path):
    """Merging opens no device: it works where OpenCL has none."""
    assert render(tmp_path / "a.film", "--samples", "0:2", "--mode", "rgb") == 0
    code = (
        "import sys, pyopencl\n"
        "pyopencl.get_platforms = lambda: sys.exit('a device was opened')\n"
        "from clpt.__main__ import run\n"
        f"sys.exit(run(['merge', {str(tmp_path / 'a.film')!r}, '-o', {str(tmp_path / 'a.png')!r}]))"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=killing.ROOT)


def test_films_that_do_not_add(tmp_path, capsys):
    paths = {name: tmp_path / f"{name}.film" for name in ("a", "b", "seed", "spectral", "torn")}
    assert render(paths["a"], "--samples", "0:5", "--mode", "rgb") == 0
    assert render(paths["b"], "--samples", "4:6", "--mode", "rgb") == 0
    assert render(paths["seed"], "--samples", "5:6", "--mode", "rgb", "--seed", "3") == 0
    assert render(paths["spectral"], "--samples", "5:6") == 0
    paths["torn"].write_bytes(paths["a"].read_bytes()[:-1])
    for name, message in (
        ("b", "samples 4 to 4 would be taken twice"),
        ("seed", "seed: 0 -> 3"),
        ("spectral", "film.mode: rgb -> spectral"),
        ("torn", "not written to its end"),
        ("none", "No such file"),
    ):
        other = str(paths.get(name, tmp_path / "none.film"))
        assert run(["merge", str(paths["a"]), other, "-o", str(tmp_path / "c.png")]) == 2
        error = capsys.readouterr().err
        assert error.startswith(f"clpt: error: {other}: ") and message in error
        assert error.count("\n") == 1 and not (tmp_path / "c.png").exists()


def test_what_a_film_holds(tmp_path, capsys):
    assert render(tmp_path / "a.film", "--samples", "3:5", "--mode", "rgb") == 0
    assert run(["info", str(tmp_path / "a.film"), "--json"]) == 0
    assert '"3 to 4"' in capsys.readouterr().out
    assert run(["merge", str(tmp_path / "a.film"), "-o", str(tmp_path / "a.exr")]) == 0
    with OpenEXR.File(str(tmp_path / "a.exr")) as file:
        header = dict(file.header())
    assert header["spp"] == 2.0 and header["films"] == 1 and header["sampler"] == "sobol"
