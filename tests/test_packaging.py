"""The wheel: what is in it, and that it renders from an empty folder."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest
import yaml

from clpt import formats, version
from clpt.errors import SceneError

ROOT = Path(__file__).resolve().parents[1]
LARGEST_WHEEL = 12 << 20  # bytes
FROM_PYPI_ALONE = {"DracoPy", "OpenEXR"}  # no conda package has them
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))


def project(key: str) -> str:
    """Return what stands at a key of pyproject.toml, as text. (tomllib needs Python 3.11.)"""
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    found = re.search(rf"^{key} = (\[.*?^\]|[^\n]+)", text, re.MULTILINE | re.DOTALL)
    assert found, key
    return found[1]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    """A wheel of the checkout."""
    pytest.importorskip("hatchling")
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "-d", str(folder)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    [made] = folder.glob("*.whl")
    return made


def test_the_version_stands_once_and_is_the_same_elsewhere():
    said = project("version").strip('"')
    assert yaml.safe_load((ROOT / "CITATION.cff").read_text())["version"] == said
    recipe = yaml.safe_load((ROOT / "packaging/conda/recipe.yaml").read_text())
    assert recipe["context"]["version"] == said
    assert said == version.VERSION


def test_the_conda_package_needs_what_the_wheel_needs():
    recipe = yaml.safe_load((ROOT / "packaging/conda/recipe.yaml").read_text())
    conda = {line.split()[0].lower() for line in recipe["requirements"]["run"]} - {"python", "pip"}
    wheel = set(re.findall(r'^    "([A-Za-z_]+)', project("dependencies"), re.MULTILINE))
    assert conda == {name.lower() for name in wheel - FROM_PYPI_ALONE}


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.stem)
def test_workflows_can_be_read(path):
    workflow = yaml.safe_load(path.read_text(encoding="utf-8"))
    assert workflow["permissions"] == {"contents": "read"}
    for job in workflow["jobs"].values():
        assert job["runs-on"] and all("uses" in step or "run" in step for step in job["steps"])


def test_own_scenes_are_found_from_anywhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert (
        formats.locate("scenes/cornell_box")
        == formats.own_scenes.scenes_folder() / "cornell_box/scene.json"
    )
    own = tmp_path / "scenes" / "cornell_box" / "scene.json"
    own.parent.mkdir(parents=True)
    own.write_text("{}")
    assert formats.locate("scenes/cornell_box") == Path("scenes/cornell_box/scene.json")
    for path in ("scenes/nothing", "scenes/../pyproject.toml", str(tmp_path / "scenes" / "prism")):
        with pytest.raises(SceneError, match="no such file"):
            formats.locate(path)


def test_what_is_in_the_wheel(wheel):
    assert wheel.stat().st_size < LARGEST_WHEEL
    names = set(zipfile.ZipFile(wheel).namelist())
    for name in ("clpt/kernels/stage/shade.cl", "clpt/spectra/data/LICENSES.md", "clpt/py.typed",
                 "clpt/scenes/cornell_box/scene.json", "clpt/view/static/main.js"):  # fmt: skip
        assert name in names
    assert any(name.endswith("licenses/LICENSE") for name in names)
    strays = [name for name in names if re.search(r"scenes/.*(picture|\.py$)|/tests?/", name)]
    assert strays == []
    every = {f"clpt/{path.relative_to(ROOT)}" for path in (ROOT / "kernels").rglob("*.cl")}
    assert every <= names
    if version.commit():
        assert zipfile.ZipFile(wheel).read("clpt/commit.txt").decode().strip() == version.commit()


@pytest.mark.slow
def test_the_wheel_renders_from_an_empty_folder(wheel, tmp_path):
    """Installed alone, beside the packages that it needs."""
    place, empty = tmp_path / "environment", tmp_path / "empty"
    venv.create(place)
    python = place / ("Scripts" if os.name == "nt" else "bin") / "python"
    pip = [sys.executable, "-m", "pip", "--python", str(python), "install", "--no-deps", "-q"]
    subprocess.run([*pip, str(wheel)], check=True)
    site = next(place.rglob("site-packages"))
    needed = [path for path in sys.path if Path(path).name == "site-packages"]
    (site / "needed.pth").write_text("\n".join(needed))
    empty.mkdir()
    for words in (["--version"], ["render", "scenes/cornell_box", "--size", "8x8", "--spp", "1"]):
        subprocess.run([python, "-m", "clpt", *words], cwd=empty, check=True)
    assert {path.name for path in empty.iterdir()} == {"cornell_box.exr", "cornell_box.png"}
    told = subprocess.run(
        [python, "-c", "import clpt; print(clpt.__file__)"],
        cwd=empty, check=True, capture_output=True, text=True,
    )  # fmt: skip
    assert Path(told.stdout.strip()).is_relative_to(site)
