"""`clpt merge`: films of ranges of samples, added to the bit, without a device."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from clpt import images
from clpt.__main__ import run
from clpt.render.film import film_file
from tests.cli import killing

LAYERS = ["--mode", "rgb", "--alpha", "--layers", "albedo,crypto_object,variance"]
FORMATS = (".exr", ".png", ".hdr", ".pfm", ".npy")


def render(output, *more: str) -> int:
    common = ["-o", str(output), "--size", "24x16", "--quiet"]
    return run(["render", killing.SCENE, *common, *more])


def outputs(paths: list[Path]) -> list[str]:
    return [word for path in paths for word in ("-o", str(path))]


def pixels(path: Path) -> dict[str, np.ndarray]:
    """What a picture's file holds, by the names of its channels."""
    if path.suffix != ".exr":
        return {path.suffix: np.load(path) if path.suffix == ".npy" else images.read(path)}
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return {name: channel.pixels for name, channel in file.channels().items()}


def check_same(paths: list[Path], others: list[Path]) -> None:
    """Check that files hold the same pixels, to the bit."""
    for path, other in zip(paths, others, strict=True):
        own, given = pixels(path), pixels(other)
        assert own.keys() == given.keys()
        for name, values in own.items():
            np.testing.assert_array_equal(values, given[name], f"{path.name} {name}")


def test_ranges_add_to_one_render(tmp_path):
    """Films of other kinds are added in tests/cluster/test_film_algebra.py."""
    for name, given in (("a", "0:5"), ("b", "5:6"), ("c", "6:12")):
        assert render(tmp_path / f"{name}.film", "--samples", given, *LAYERS) == 0
    whole, *direct = (tmp_path / f"whole{one}" for one in (".film", *FORMATS))
    made, *merged = (tmp_path / f"sum{one}" for one in (".film", *FORMATS))
    assert render(whole, *outputs(direct), "--spp", "12", *LAYERS) == 0
    films = [str(tmp_path / f"{name}.film") for name in "cab"]
    assert run(["merge", *films, *outputs([made, *merged]), "--quiet"]) == 0
    one, other = (film_file.read(path).film for path in (made, whole))
    for name, words in one.arrays.items():
        np.testing.assert_array_equal(words, other.arrays[name])
    assert one.taken == other.taken == ((0, 12),)
    check_same(merged, direct)


@pytest.mark.parametrize(
    "more", [["--noise", "0.5"], ["--denoise", "statistical"]], ids=["noise", "denoised"]
)
def test_the_picture_of_a_film_is_that_of_its_render(tmp_path, more):
    """Also where pixels differ in their numbers of samples, and where it is denoised."""
    film, *direct = (tmp_path / f"whole{one}" for one in (".film", *FORMATS))
    merged = [tmp_path / f"merged{one}" for one in FORMATS]
    assert render(film, *outputs(direct), "--spp", "40", "--mode", "spectral", *more) == 0
    denoised = more if "--denoise" in more else []
    assert run(["merge", str(film), *outputs(merged), *denoised, "--quiet"]) == 0
    check_same(merged, direct)
    assert ("samples.X" in pixels(merged[0])) == ("--noise" in more)


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
        ("none", "no such file"),
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
