"""The pages of documentation: on the site, with links that lead somewhere and code that runs."""

from __future__ import annotations

import ast
import dataclasses
import importlib
import importlib.util
import json
import logging
import re
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

import clpt
from clpt.cli import cli
from clpt.scene import roles
from docs import figures
from tests import pages

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
PAGES = sorted(DOCS.glob("*.md"))
LINK = re.compile(r"\]\((?!\w+:)([^)#\s]+)(?:#[^)\s]*)?\)")
SMALLER = {
    "width=320, height=240": "width=40, height=30",
    '"width": 320, "height": 240': '"width": 40, "height": 30',
}

Run = Callable[[str], dict]


def test_every_page_is_in_the_navigation():
    text = (ROOT / "mkdocs.yml").read_text("utf-8")
    places = re.findall(r": (\S+\.md)$", text[text.index("nav:") : text.index("theme:")], re.M)
    assert len(set(places)) == len(places)
    assert {page.name for page in PAGES} <= set(places)


def texts_beside_python() -> Iterator[tuple[str, str]]:
    """Yield the pages, the Makefile and the settings, which no import checks: names, texts."""
    patterns = ("*.md", "docs/*.md", "bench/**/*.md", "scenes/**/*.md", "Makefile", ".ci/run")
    for pattern in (*patterns, ".github/**/*.yml", "pyproject.toml"):
        for path in sorted(ROOT.glob(pattern)):
            if path.name != "CHANGELOG.md":
                yield str(path.relative_to(ROOT)), path.read_text("utf-8")


def test_names_that_texts_import_exist():
    absent = []
    for file, text in texts_beside_python():
        for module, names in re.findall(r"from (clpt[\w.]*) import ([\w, ]+)", text):
            for name in (part.split(" as ")[0].strip() for part in names.split(",")):
                try:
                    if not hasattr(importlib.import_module(module), name):
                        importlib.import_module(f"{module}.{name}")
                except ModuleNotFoundError:
                    absent.append(f"{file}: from {module} import {name}")
    assert absent == []


def test_modules_that_texts_run_exist():
    command = re.compile(r"-m ((?:clpt|docs|bench|scenes|tests)(?:\.\w+)*)")
    absent = [
        f"{file}: {module}"
        for file, text in texts_beside_python()
        for module in command.findall(text)
        if importlib.util.find_spec(module) is None
    ]
    assert absent == []


def test_links_lead_somewhere():
    links = [(page, link) for page in PAGES for link in LINK.findall(page.read_text("utf-8"))]
    assert [f"{page.name}: {link}" for page, link in links if not (DOCS / link).exists()] == []


def test_notes_are_indexed_and_linked():
    notes = ROOT / "bench/notes"
    index = (notes / "README.md").read_text("utf-8")
    pages = {page.name for page in notes.glob("*.md")} - {"README.md"}
    assert set(LINK.findall(index)) >= pages
    links = [(page, link) for page in notes.glob("*.md") for link in LINK.findall(page.read_text())]
    assert [f"{page.name}: {link}" for page, link in links if not (notes / link).exists()] == []


def test_the_site_has_the_pictures_of_scenes():
    pytest.importorskip("mkdocs")
    from docs.theme.pages import pictures

    for page in (ROOT / "README.md", DOCS / "gallery.md"):
        shown = re.findall(r"\]\((?:\.\./)?(scenes/[^)]+\.\w+)\)", page.read_text("utf-8"))
        assert {name for name in shown if not name.endswith(".json")} <= {*pictures()}


def test_commands_and_options_exist():
    lines = [(page.name, line) for page in PAGES for line in pages.commands(page)]
    unknown = [(name, line, pages.unknown(line)) for name, line in lines]
    assert [": ".join(told) for told in unknown if told[-1]] == []


SHOWN = re.compile(r"!\[[^\]]*\]\((\S+?)\)\n.*?\n`([^`]*clpt render [^`]*)`\n", re.S)


def test_commands_of_the_gallery_make_pictures_of_the_size_that_is_shown():
    page = (DOCS / "gallery.md").read_text("utf-8").split("## Every kind")[0]
    shown = SHOWN.findall(page)
    assert len(shown) == page.count("![") > 20
    wrong = []
    for picture, command in shown:
        scene, *words = shlex.split(command.split("clpt render ")[1])
        if "--size" in words:
            size = words[words.index("--size") + 1]
        else:
            file = ROOT / scene if scene.endswith(".json") else ROOT / scene / "scene.json"
            film = json.loads(file.read_text("utf-8"))["film"]
            size = f"{film['width']}x{film['height']}"
        if "x".join(map(str, Image.open(DOCS / picture).size)) != size:
            wrong.append(f"{picture}: {command} makes {size}")
    assert wrong == []


UNKNOWN = {"layers.png", "lens_ghosts.png", "denoising.jpg", "candle.jpg"}  # may only become fewer
DRAWN = {"architecture.md"}  # by hand
ELSEWHERE = {"gallery.md", "scene_format.md", "tutorial.md"}  # other tests, and Python that is run


def test_pages_say_what_made_their_pictures():
    """By a command below the picture, Python of its section, or a script for the whole page."""
    found = set()
    for page in (page for page in PAGES if page.name not in DRAWN | ELSEWHERE):
        text = page.read_text("utf-8")
        if re.search(r"`python -m docs\.pictures\S+` makes .* pictures of this page", text):
            continue
        for section in re.split(r"^## ", text, flags=re.MULTILINE):
            for name, below in re.findall(r"!\[[^\]]*\]\(\S*?([^\s/]+)\)\n\n(.*\n.*)", section):
                command = re.match(r"(`|```sh\n)(clpt|python) ", below)
                if not command and f'write_image("{name}"' not in section:
                    found.add(name)
    assert found == UNKNOWN


def test_other_pages_have_the_command_of_the_gallery():
    commands = dict(SHOWN.findall((DOCS / "gallery.md").read_text("utf-8")))
    below = re.compile(r"!\[[^\]]*\]\((\S+)\)\n\n(.*)\n")
    wrong = [
        f"{page.name}: {picture}"
        for page in PAGES
        if page.name != "gallery.md"
        for picture, line in below.findall(page.read_text("utf-8"))
        if picture in commands and line != f"`{commands[picture]}`"
    ]
    assert wrong == []


def test_figures_are_those_of_the_benchmark():
    old = [p.name for p in figures.pages() if figures.written(text := p.read_text("utf-8")) != text]
    assert old == [], "run python -m docs.figures"
    assert figures.PLACE.search((ROOT / "README.md").read_text("utf-8"))


# Words that a reader whose English is second has to look up, or to read twice.
HARD = r"\b(?:but for|tells?|told|calm|dull|whence|thence|(?<!veach-)ajar|lowered|shines?)\b"
OURS = {"architecture.md", "glossary.md", "scene_format.md"}  # the code's words, or generated


def test_pages_use_plain_words():
    found = [
        f"{page.name}:{number}: {match[0]}"
        for page in (*PAGES, ROOT / "README.md")
        if page.name not in OURS
        for number, line in enumerate(page.read_text("utf-8").splitlines(), 1)
        for match in re.finditer(HARD, line)
    ]
    assert found == []


def test_commands_name_files_of_the_repository_that_are_there():
    lines = [(page.name, line) for page in PAGES for line in pages.commands(page)]
    assert [(name, pages.lost(line, ROOT)) for name, line in lines if pages.lost(line, ROOT)] == []


def test_what_one_command_writes_no_other_scene_overwrites():
    """Whoever follows several pages in one folder keeps all pictures."""
    made: dict[str, set[str]] = {}
    for page in (*PAGES, ROOT / "README.md"):
        for line in pages.commands(page):
            _, name, *words = shlex.split(line, comments=True)
            source = words[0] if name == "render" else name
            for option, value in pairwise(words):
                if option in ("-o", "--output"):
                    made.setdefault(value, set()).add(source)
        for code in pages.blocks(page, "python"):
            for value in re.findall(r'(?:write_image|write_layers|save)\(\s*"([^"]+)"', code):
                made.setdefault(value, set()).add(f"Python of {page.name}")
    assert {name: of for name, of in made.items() if len(of) > 1} == {}


TYPED = ("rendering.md", "image_tools.md", "recipes.md", "tutorial.md", "noise.md", "denoising.md")


@pytest.mark.slow
@pytest.mark.parametrize("page", TYPED)
def test_commands_run_as_typed(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    for name in ("scenes", "tests"):
        (tmp_path / name).symlink_to(ROOT / name)
    monkeypatch.chdir(tmp_path)
    for text in pages.blocks(DOCS / page, "json"):
        (tmp_path / "pawn.json").write_text(text, "utf-8")
    (tmp_path / "old.xml").write_text('<scene version="0.6.0"><shape type="sphere"/></scene>')
    for line in pages.commands(DOCS / page):
        words = pages.smaller(line.split(" > ")[0], spp=2)
        done = CliRunner().invoke(cli, words)
        assert done.exit_code == 0, f"{line}: {done.output}"


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Run]:
    """Yield what runs a page's Python in one namespace, films small and RGB; it returns the names.

    The folder looks like the repository's root, but what a page writes stays out of that.
    """
    for name in ("scenes", "tests"):
        (tmp_path / name).symlink_to(ROOT / name)
    monkeypatch.chdir(tmp_path)
    load = clpt.load

    def smaller(path: str, **options: Any) -> clpt.Scene:
        scene = load(path, **options)
        scene.film = dataclasses.replace(scene.film, width=40, height=30, mode="rgb")
        return scene

    monkeypatch.setattr(clpt, "load", smaller)

    def run(page: str) -> dict:
        names: dict = {}
        for i, code in enumerate(pages.blocks(DOCS / page, "python")):
            exec(compile(_smaller(code), f"{page}, block {i + 1}", "exec"), names)
        return names

    level = logging.getLogger("clpt").level
    yield run
    logging.getLogger("clpt").setLevel(level)


def _smaller(text: str) -> str:
    for old, new in SMALLER.items():
        text = text.replace(old, new)
    return text


def test_the_code_of_the_page_on_embedding_runs(run: Run, capsys: pytest.CaptureFixture):
    names = run("embedding.md")
    first = pages.blocks(DOCS / "embedding.md", "python")[0]
    assert first.count("\n") <= 12  # ten lines that work, and a blank one or two
    assert names["pixels"].shape == (30, 40, 4) and 20 < names["pixels"][..., :3].mean() < 235
    assert 0 < names["rows"].get().min() < np.inf
    assert names["whole"] is False
    assert "must be a whole number above zero" in capsys.readouterr().out


def test_the_page_on_films(run: Run):
    names = run("films.md")
    first, later = names["first"], names["later"]
    np.testing.assert_array_equal(names["image"], clpt.render(first.scene, 128))
    assert (first.samples, later.samples) == (128, 256)


def test_the_tutorial(run: Run, tmp_path: Path):
    names = run("tutorial.md")
    final, renderer = names["image"], names["renderer"]
    assert final.shape == (30, 40, 3) and renderer.active == 0.0 and renderer.samples > 64
    errors = [np.abs(names[name] - final).mean() for name in ("noisy", "better")]
    assert errors[1] < errors[0] / 2  # of sixteen times the samples
    red = final[..., 0] > 3 * final[..., 2]
    assert 0.05 < red.mean() < 0.3  # the pawn
    assert clpt.read_image("pawn.exr") == pytest.approx(final, rel=1e-3)
    assert clpt.read_image("brighter.png").mean() > clpt.read_image("pawn.png").mean()
    (text,) = pages.blocks(DOCS / "tutorial.md", "json")
    (tmp_path / "pawn.json").write_text(text, "utf-8")
    file, scene = clpt.load("pawn.json"), names["scene"]
    for one, other in zip([file.camera, *file.shapes], [scene.camera, *scene.shapes], strict=True):
        assert one.kind == other.kind
        np.testing.assert_allclose(one.to_world, other.to_world, atol=1e-12)
    assert file.camera.fov == scene.camera.fov
    assert [shape.material.kind for shape in file.shapes] == ["rough_plastic", *["diffuse"] * 2]
    emitted = [each.shapes[2].emission.radiance.to_rgb("emission") for each in (file, scene)]
    assert emitted[0] == pytest.approx(emitted[1])


@pytest.mark.slow
def test_how_to_light_a_scene(run: Run):
    names = run("lighting.md")
    luminances = [names[n].sample(np.array([560.0]))[0] for n in ("lamp_white", "lamp_bright")]
    assert luminances == pytest.approx([1.0, 20.0], rel=0.1)
    studio = names["studio"]
    assert studio[10:14, 15:19].mean() > 1.5 * studio[10:14, 21:25].mean()  # key left, fill right
    ground = names["outdoors"][-1, 0]  # in the sun, far from the ball
    assert ground == pytest.approx([0.45, 0.47, 0.50], rel=0.05)
    exposed = clpt.read_image("exposed.png")
    assert 0.1 < exposed.mean() < 0.4
    assert names["image_sky"].kind == "envmap"


def test_the_code_of_the_page_on_troubleshooting(run: Run, capsys: pytest.CaptureFixture):
    names = run("troubleshooting.md")
    assert names["chosen"].info.label in capsys.readouterr().out
    assert "is not there; there is [0]" in names["message"]
    with pytest.raises(clpt.ClptError):
        names["renderer"].run(1)  # closed


def test_the_code_of_coming_from(run: Run):
    names = run("coming_from.md")
    axes = [names[name].fov_axis for name in ("like_mitsuba", "like_pbrt", "like_blender")]
    assert axes == ["x", "smaller", "larger"]
    assert names["scene"].integrator.max_depth > 0 and names["scene"].sampler.kind == "sobol"


def test_the_code_of_choosing(run: Run):
    names = run("choosing.md")
    assert 0.3 < names["direct"].mean() / names["whole"].mean() < 0.9
    assert 16 <= names["samples"].min() <= names["samples"].max() <= 256


def test_the_code_of_architecture(run: Run, capsys: pytest.CaptureFixture):
    run("architecture.md")
    assert capsys.readouterr().out == "real True\n"


@pytest.mark.slow
def test_the_recipes(run: Run):
    run("recipes.md")
    for name in (
        "object",
        "chrome",
        "glass",
        "golden_pawn",
        "focus",
        "product",
        "outdoors",
        "noon",
    ):
        picture = clpt.read_image(f"{name}.png")
        assert picture.shape == (30, 40, 3) and 0.01 < picture.mean() < 0.95, name


@pytest.mark.slow
def test_the_code_of_media_and_sky(run: Run):
    names = run("media.md")
    assert names["renderer"].samples == 4 and 0.1 < names["renderer"].image().mean() < 1.0
    assert run("sky.md")["body"].interior is not None


def test_the_code_of_colour(run: Run):
    pytest.importorskip("PyOpenColorIO", reason="OpenColorIO is not installed")
    names = run("colour.md")
    assert names["view"].name.startswith("ACES 2.0")
    agx, aces = (clpt.read_image(f"{name}.png").mean() for name in ("graded", "cornell_aces"))
    assert agx > 1.5 * aces > 0.0  # half a stop more, and other curves


def test_the_code_of_layers(run: Run, capsys: pytest.CaptureFixture):
    layers = run("layers.md")["layers"]
    assert [*layers] == ["albedo", "depth"]
    assert layers["albedo"].shape == (30, 40, 3) and layers["depth"].max() > 1.0


def test_the_code_of_limits(run: Run):
    messages = run("limits.md")["messages"]
    assert "must be a whole number from 1 to 65536" in messages[0]
    assert "are more than 64 Mi pixels" in messages[1]


LIMITS = (  # on the page, and where the code has them
    ("65 536 pixels", "clpt.cli.options.values", "LARGEST", 65536),
    ("67 108 864 pixels", "clpt.render.film.check", "LARGEST", 67108864),
    ("| 1024 |", "clpt.scene.integrators.film", "MOST_BANDS", 1024),
    ("| 4000 |", "clpt.scene.integrators", "DEEPEST", 4000),
    ("715 827 882", "clpt.bvh.build", "MOST", 715827882),
    ("| 255 |", "clpt.render.records.materials", "MOST", 255),
    ("| 32 |", "clpt.scene.textures", "MOST_OCTAVES", 32),
    ("768 MiB", "clpt.files.budget", "FREE", 768 << 20),
    ("256 bytes for each byte of its files", "clpt.files.budget", "RATIO", 256),
    ("a part for each 256 bytes", "clpt.files.budget", "PER_REPEAT", 256),
    ("| 600 s,", "clpt.files.budget", "SECONDS", 600.0),
    ("| 50 000, and one", "clpt.files.budget", "PARTS", 50_000),
    ("one for each 4 bytes", "clpt.files.budget", "PER_PART", 4),
    ("at most 300 characters", "clpt.errors", "LONGEST", 300),
    ("| 65 536 bytes |", "clpt.formats.meshes.ply", "LONGEST_HEADER", 65536),
    ("| 65 536 corners |", "clpt.formats.meshes.ply", "MOST_CORNERS", 65536),
    ("2^29 pixels", "clpt.images.checks", "PIXELS", 1 << 29),
    ("| 64 |", "clpt.formats.mitsuba.xml", "MAX_NESTING", 64),
    ("| 16 |", "clpt.formats.mitsuba.xml", "MAX_INCLUDES", 16),
    ("1000 parts", "clpt.scene.params", "MOST_PARTS", 1000),
    ("64 deep", "clpt.scene.params", "MOST_NESTED", 64),
    ("| 32 |", "clpt.formats.pbrt.state", "DEEPEST", 32),
    ("65,536 values along an axis", "clpt.formats.volumes.sparse", "MOST_AXIS", 65536),
    ("10 levels", "clpt.formats.pbrt.shapes", "DEEPEST", 10),
)


@pytest.mark.parametrize(("told", "module", "name", "value"), LIMITS, ids=lambda v: str(v)[:30])
def test_limits_are_those_of_the_code(told: str, module: str, name: str, value: int):
    assert told in (DOCS / "limits.md").read_text("utf-8")
    assert getattr(pytest.importorskip(module), name) == value


def test_the_site_describes_every_role_of_a_parameter():
    """Without MkDocs: what the site says of roles is read, not imported."""
    tree = ast.parse((DOCS / "theme/docstrings.py").read_text("utf-8"))
    said = next(
        {ast.unparse(key) for key in node.value.keys if key is not None}
        for node in tree.body
        if isinstance(node, ast.Assign)
        and ast.unparse(node.targets[0]) == "ROLES"
        and isinstance(node.value, ast.Dict)
    )
    every = {f"roles.{name}" for name, role in vars(roles).items() if isinstance(role, roles.Role)}
    assert every - {"roles.CHOICE"} <= said


@pytest.mark.slow
def test_the_site_builds_without_a_warning(tmp_path: Path):
    pytest.importorskip("mkdocstrings", reason="the extra clpt[docs] is not installed")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    api = (tmp_path / "api" / "clpt.html").read_text("utf-8")
    for name in clpt.__all__:
        assert name.startswith("_") or name in api
