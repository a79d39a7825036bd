"""No name of a file, and nothing that a file says, controls the terminal or fakes a line."""

from __future__ import annotations

import ast
import io
import json
import logging
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
from PIL import Image

import clpt
from clpt import errors
from clpt.__main__ import run
from clpt.cli import display as displays
from clpt.cli.options.records import Handler
from clpt.cli.process import ending, terminal
from clpt.errors import ClptError

CLI = Path(clpt.__file__).parent / "cli"
FAKED = "clpt: error: faked"
HOSTILE = f"ZZ\x1b]0;owned\x07\x1b[2J\x9b31m\x9d0;x\u202e\r\n{FAKED}"
NAME = HOSTILE.replace("\r\n", "")[:60]  # of a file
QUAD = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"


def clean(text: str) -> bool:
    """Return whether a text has printable characters and ends of lines alone, and no faked line."""
    rows = text.split("\n")
    return all(row.isprintable() for row in rows) and not any(r.startswith(FAKED) for r in rows)


def test_clean_notices() -> None:
    assert clean("a\nb") and not clean(HOSTILE) and not clean(f"a\n{FAKED}") and not clean("\x9b")


def test_text_has_one_way_out() -> None:
    """No module of the command line prints by itself; rich gets no plain strings."""
    found = []
    for path in sorted(CLI.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if not isinstance(node, ast.Call):
                continue
            called = ast.unparse(node.func)
            plain = called.endswith("console.print") and isinstance(
                node.args[0], (ast.JoinedStr, ast.BinOp)
            )
            outs = ("click.echo", "click.secho", "print", "sys.stdout.write", "sys.stderr.write")
            if plain or called in outs:
                found.append(f"{path.relative_to(CLI).as_posix()}:{node.lineno}")
    assert {one.partition(":")[0] for one in found} == {"process/terminal.py"}


def scene(**parts: Any) -> dict[str, Any]:
    film = {"width": 8, "height": 8}
    return {"camera": {"type": "perspective"}, "film": film, "lights": [], "shapes": [], **parts}


def as_json(**parts: Any) -> Callable[[Path], None]:
    return lambda path: path.write_text(json.dumps(scene(**parts))) and None


def image(path: Path) -> None:
    Image.new("RGB", (4, 4)).save(path, icc_profile=b"x" * 200)


def exr(path: Path) -> None:
    header = {"compression": OpenEXR.NO_COMPRESSION, "type": OpenEXR.scanlineimage}
    part = {NAME: np.ones((4, 4), np.float32), "A": np.ones((4, 4), np.float32)}
    OpenEXR.File({**header, "note": HOSTILE}, part).write(str(path))


def obj(path: Path) -> None:
    path.with_suffix(".mtl").write_text(f"newmtl {NAME}\nmap_Kd {NAME}.png\n{NAME} 1\n", "utf-8")
    library = f"mtllib {path.with_suffix('.mtl').name}\n"
    path.write_text(f"{library}{QUAD}usemtl {NAME}\n{NAME} 1\nf 1 2 3\n", "utf-8")


def gltf(path: Path) -> None:
    camera = {"type": "perspective", "name": HOSTILE, "perspective": {"yfov": 1, "znear": 0.1}}
    named = {"cameras": [{**camera, "extensions": {HOSTILE: {}}}], "extensionsUsed": [HOSTILE]}
    asset = {"version": "2.0", "generator": HOSTILE}
    nodes = [{"name": HOSTILE, "camera": 0}]
    whole = {"asset": asset, "nodes": nodes, "scenes": [{"nodes": [0]}], **named}
    path.write_text(json.dumps(whole))


def pbrt(path: Path) -> None:
    text = f'Option "string {NAME}" "1"\nWorldBegin\nMaterial "diffuse" "float {NAME}" [1]\n'
    path.write_text(f'{text}LightSource "infinite"\nShape "sphere" "string {NAME}" "y"\n', "utf-8")


def xml(path: Path) -> None:
    name = "ZZ&#x9b;2J&#x85;x"
    unused = f'<string name="{name}" value="x"/>'
    bsdf = f'<bsdf type="diffuse" id="{name}">{unused}</bsdf>'
    shape = f'<scene version="3.0.0"><shape type="sphere">{bsdf}</shape></scene>'
    path.write_text(f'<?xml version="1.0"?>{shape}', "utf-8")


def ply(path: Path) -> None:
    counts = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    faces = "element face 1\nproperty list uchar int vertex_indices\n"
    head = f"ply\nformat ascii 1.0\ncomment TextureFile {NAME}.png\n{counts}{faces}"
    other = f"element {NAME.replace(' ', '')} 0\nproperty float x\n"
    path.write_text(f"{head}{other}end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "utf-8")


SCENES: dict[str, Callable[[Path], None]] = {
    "name.json": as_json(name=HOSTILE, shapes=[{"type": "sphere", "name": HOSTILE}]),
    "kind.json": as_json(shapes=[{"type": HOSTILE, "name": HOSTILE}]),
    "key.json": as_json(lights=[{"type": "point", HOSTILE: 1}]),
    "file.json": as_json(shapes=[{"type": "mesh", "file": HOSTILE}]),
    "group.json": as_json(
        groups={HOSTILE: []}, shapes=[{"type": "instance", "group": "Z" + HOSTILE}]
    ),
    f"{NAME}.json": as_json(),
    "m.obj": obj, "g.gltf": gltf, "p.pbrt": pbrt, "x.xml": xml, "t.ply": ply,
}  # fmt: skip
IMAGES: dict[str, Callable[[Path], None]] = {f"{NAME}.png": image, "e.exr": exr}


def told(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    run(words)
    captured = capsys.readouterr()
    return captured.out + captured.err


@pytest.mark.parametrize("name", SCENES, ids=ascii)
def test_what_a_scene_says(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / name
    SCENES[name](path)
    for words in (["info"], ["info", "--json"], ["render", "--device", "none such"]):
        text = told(capsys, words[0], str(path), *words[1:])
        assert clean(text) and text
    shown = displays.Lines(None, name)
    try:
        loaded = clpt.load(path, missing_textures="grey")
    except ClptError as error:
        assert clean(str(error)) and "ZZ" in str(error)
        return
    for warning in loaded.warnings:
        shown.note(f"clpt: warning: {warning}")
        assert clean(warning)
    assert clean(capsys.readouterr().err)


@pytest.mark.parametrize("name", IMAGES, ids=ascii)
def test_what_an_image_says(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / name
    IMAGES[name](path)
    target = str(tmp_path / "made.exr")
    calls = [["info"], ["info", "--json"], ["inspect"], ["inspect", "--pixel", "1,1"]]
    calls += [["convert", target], ["compare", str(path)], ["render"], ["merge"], ["lens"]]
    for command, *more in calls:
        assert clean(told(capsys, command, str(path), *more))


def test_what_a_lens_says(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "l.dat"
    path.write_text(f"# {NAME} [red]\n10 1 1.5 5\n-10 0 1 5\n", "utf-8")
    assert clean(told(capsys, "lens", str(path)))


def test_what_a_display_shows(monkeypatch: pytest.MonkeyPatch) -> None:
    """A bar writes what moves it, and nothing of a name; markup of a name is text."""
    stream = io.StringIO()
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setenv("TERM", "xterm")
    shown = displays.Bar(None, HOSTILE)
    monkeypatch.setattr(displays, "PATIENCE", 0.0)
    shown.begin(HOSTILE)
    shown.note(f"[bold]{HOSTILE}[/bold]")
    with shown.loading(HOSTILE) as tell:
        tell(0.5, HOSTILE)
    with shown.phase(HOSTILE), shown.compiling(HOSTILE) as programs:
        programs.begin("a")
    with shown.rendering():
        pass
    text = stream.getvalue()
    assert "[bold]ZZ" in text.replace("\n", "")
    for bad in ("\x1b]0", "\x07", "\x1b[2J", "\x9b", "\u202e", f"\n{FAKED}"):
        assert bad not in text


def test_what_the_log_says(capsys: pytest.CaptureFixture[str]) -> None:
    """As the command prints it, and as a program's own handler does."""
    stream = io.StringIO()
    handlers = [Handler(), logging.StreamHandler(stream)]
    root, log = logging.getLogger(), logging.getLogger("clpt.images")
    for handler in handlers:
        root.addHandler(handler)
    try:
        log.warning("%s: %s", HOSTILE, HOSTILE * 100)
        try:
            raise ValueError(HOSTILE)
        except ValueError:
            log.exception("of a worker: %s", HOSTILE)
        root.warning("of another library: %s", HOSTILE)
    finally:
        for handler in handlers:
            root.removeHandler(handler)
    text = capsys.readouterr().err
    own = stream.getvalue().partition("of another library")[0]
    assert clean(text) and text.count("clpt: ") >= 3 and "ValueError" in own
    assert clean(own) and max(map(len, own.split("\n"))) < 1100


def test_a_library_prints_nothing_raw() -> None:
    """A program that has set up no log gets warnings of Python's own handler."""
    code = f"import clpt, logging; logging.getLogger('clpt.images').warning({HOSTILE!r})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert clean(done.stdout + done.stderr)


def test_errors_and_tracebacks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """All errors of clpt, those of workers too; a fault's file, which people print."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    for kind in (ClptError, errors.SceneError, errors.DeviceError, errors.ClusterError):
        assert clean(str(kind(HOSTILE))) and len(str(kind(HOSTILE * 1000))) <= errors.LONGEST
    built = errors.KernelBuildError(HOSTILE, HOSTILE, 1, f"error: {HOSTILE}", HOSTILE)
    assert clean(str(built)) and clean(str(errors.MemoryBudgetError(HOSTILE, 1, 1, HOSTILE)))
    try:
        raise KeyError(HOSTILE)
    except KeyError as error:
        ending.complain(ending.message_of(error)[0])
    try:
        raise RuntimeError(HOSTILE)
    except RuntimeError as error:
        ending.complain(ending.message_of(error)[0])
    said = capsys.readouterr().err
    (kept,) = tmp_path.rglob("traceback.txt")
    assert clean(said) and said.count("\n") == 2 and str(kept) in said
    assert clean(kept.read_text("utf-8")) and "RuntimeError" in kept.read_text("utf-8")


def test_lines_are_cut() -> None:
    assert len(terminal.cleaned("x" * 10**7)) == terminal.LONGEST
