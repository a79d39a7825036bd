"""What a scene takes after it is loaded, until its first sample: from the budget of its load."""

from __future__ import annotations

import io
import json
import pickle
import time
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import clpt
from clpt.errors import LONGEST, SceneError
from clpt.files import budget
from clpt.formats.native.shape_files import FILES
from clpt.geometry import polygons
from clpt.images import pillow
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import materials
from clpt.scene.shapes import Mesh

QUAD = """v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1
f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"""
MEBI = 1 << 20


def scene(folder: Path, **mesh: Any) -> Path:
    """A scene of one mesh, with a picture beside it."""
    (folder / "quad.obj").write_text(QUAD)
    Image.new("RGB", (64, 64), (90, 10, 30)).save(folder / "a.png")
    path = folder / "scene.json"
    made = {"camera": {"type": "perspective"}, "film": {"width": 8, "height": 8}}
    path.write_text(json.dumps({**made, "shapes": [{"type": "mesh", "file": "quad.obj", **mesh}]}))
    return path


HEIGHTS = {"displacement": {"type": "bitmap", "image": "a.png"}}
SHOWN = {"material": {"type": "diffuse", "reflectance": {"type": "bitmap", "image": "a.png"}}}
LARGE: dict[str, dict[str, Any]] = {  # what a small file makes large
    "displacement": {**HEIGHTS, "displacement_edge": 0.01},
    "subdivision": {"subdivision": 7},
    "both": {**HEIGHTS, "displacement_edge": 0.02, "subdivision": 5},
    "image": SHOWN,
}


@pytest.mark.parametrize("which", LARGE)
def test_its_memory_is_that_of_the_load(tmp_path: Path, which: str) -> None:
    path = scene(tmp_path, **LARGE[which])
    limit = 9000 if which == "image" else 8 * MEBI
    loaded = clpt.load(path, budget=clpt.Budget(memory=limit))
    with pytest.raises(SceneError, match=r"the limit is .*raise --load-memory") as raised:
        lower(replace(loaded, spp=2))
    assert len(str(raised.value)) <= LONGEST
    assert len(lower(clpt.load(path)).faces) >= 2


@pytest.mark.parametrize("which", LARGE)
def test_its_time_is_that_of_the_load(tmp_path: Path, which: str) -> None:
    """What loading has spent counts; the time between loading and rendering does not."""
    loaded = clpt.load(scene(tmp_path, **LARGE[which]), budget=clpt.Budget(seconds=50.0))
    account = loaded.account
    assert account is not None and 0.0 < account.spent < 50.0
    account.began -= 1000.0  # as if it was loaded long ago
    lower(replace(loaded, shapes=[]))
    account.spent = 51.0
    for other in (loaded, pickle.loads(pickle.dumps(loaded)), replace(loaded, seed=3)):
        with pytest.raises(SceneError, match=r"takes more than 50 s: .*raise --load-seconds"):
            lower(other)


def stretched(kind: str, count: int) -> dict[str, Any]:
    """Spheres or cylinders that an instance stretches, so that they become triangles."""
    group = [{"type": kind, "to_world": {"translate": [3 * i, 0, 0]}} for i in range(count)]
    instance = {"type": "instance", "group": "g", "to_world": {"scale": [1, 2, 3]}}
    return {"groups": {"g": group}, "shapes": [instance]}


CURVES = [[np.cos(i), np.sin(i), 0.01 * i, 1e-5] for i in range(3000)]
MANY: dict[str, dict[str, Any]] = {  # many shapes of few words, that become many triangles
    "spheres": stretched("sphere", 60),
    "cylinders": stretched("cylinder", 700),
    "curves": {
        "shapes": [{"type": "curves", "basis": "bspline", "points": CURVES, "lengths": [3000]}]
    },
}


@pytest.mark.parametrize("which", MANY)
def test_shapes_of_few_words_draw_from_it(tmp_path: Path, which: str) -> None:
    path = tmp_path / "s.json"
    path.write_text(json.dumps({"camera": {"type": "perspective"}, **MANY[which]}))
    loaded = clpt.load(path, budget=clpt.Budget(memory=6 * MEBI))
    with pytest.raises(SceneError, match=r"the limit is 6\.0 MiB.*raise --load-memory"):
        lower(loaded)
    lower(clpt.load(path))


def test_each_time_draws_from_what_the_load_has_left(tmp_path: Path) -> None:
    """A page makes a scene ready hundreds of times: that adds nothing up."""
    loaded = clpt.load(scene(tmp_path, **LARGE["both"]), budget=clpt.Budget(memory=16 * MEBI))
    for _ in range(4):
        lower(loaded)
    (mesh,) = loaded.shapes
    alike = replace(loaded, shapes=[replace(mesh, displacement_scale=i) for i in range(1, 40)])
    with pytest.raises(SceneError, match="--load-memory"):
        lower(alike)


def test_a_scene_of_no_file_has_no_budget() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    mesh = Mesh(vertices=vertices, faces=np.array([[0, 1, 2]], np.uint32), subdivision=6)
    made = clpt.Scene(camera=clpt.scene.cameras.Perspective(), shapes=[mesh])
    assert made.account is None and len(lower(made).faces) == 4**6


# polygons


def obj(folder: Path, outline: np.ndarray) -> Path:
    rows = [f"v {x:.6f} {y:.6f} 0\n" for x, y in outline]
    face = "f " + " ".join(str(i + 1) for i in range(len(outline)))
    (folder / "p.obj").write_text("".join(rows) + face + "\n")
    return folder / "p.obj"


def ply(folder: Path, outline: np.ndarray) -> Path:
    head = f"ply\nformat ascii 1.0\nelement vertex {len(outline)}\nproperty float x\n"
    head += "property float y\nproperty float z\nelement face 1\n"
    head += "property list int int vertex_indices\nend_header\n"
    rows = [f"{x:.6f} {y:.6f} 0\n" for x, y in outline]
    face = " ".join(map(str, range(len(outline))))
    (folder / "p.ply").write_text(f"{head}{''.join(rows)}{len(outline)} {face}\n")
    return folder / "p.ply"


def off(folder: Path, outline: np.ndarray) -> Path:
    rows = [f"{x:.6f} {y:.6f} 0\n" for x, y in outline]
    face = " ".join(map(str, range(len(outline))))
    text = f"OFF\n{len(outline)} 1 0\n{''.join(rows)}{len(outline)} {face}\n"
    (folder / "p.off").write_text(text)
    return folder / "p.off"


@pytest.mark.parametrize("write", [obj, ply, off])
def test_a_polygon_of_too_many_corners_is_refused(
    tmp_path: Path, write: Callable[[Path, np.ndarray], Path]
) -> None:
    """Random corners cross each other, which takes clipping a time with their square."""
    count = polygons.MOST_CORNERS + 1
    path = write(tmp_path, np.random.default_rng(1).random((count, 2)))
    with pytest.raises(SceneError, match=r"not convex has 24,001 corners.*triangles"):
        clpt.load(path)
    angle = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    round_one = write(tmp_path, np.stack([np.cos(angle), np.sin(angle)], axis=1))
    (mesh, *_) = (shape for shape in clpt.load(round_one).shapes if isinstance(shape, Mesh))
    assert len(mesh.faces) > count - 10


def test_clipping_ears_asks_for_time() -> None:
    outline = np.random.default_rng(1).random((50, 3))
    with (
        budget.opened(clpt.Budget(seconds=1e-9)),
        pytest.raises(SceneError, match="--load-seconds"),
    ):
        polygons.triangulate(outline, np.array([50]), np.arange(50))


# images


def progressive(side: int, scans: int) -> bytes:
    """A progressive JPEG in which the last scan stands so often."""
    stream = io.BytesIO()
    noise = np.random.default_rng(1).integers(0, 255, (16, 16, 3), np.uint8)
    image = Image.fromarray(noise).resize((side, side), Image.Resampling.NEAREST)
    image.save(stream, "JPEG", progressive=True, quality=30)
    data = stream.getvalue()
    last = data.rindex(pillow.START_OF_SCAN)
    return data[:last] + data[last:-2] * scans + data[-2:]


def test_a_jpeg_of_many_scans_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.jpg"
    path.write_bytes(progressive(2560, 400))
    for source in (path, path.read_bytes()):
        with pytest.raises(SceneError, match="scans of 2560x2560 pixels; at most 20"):
            pillow.decoded(source, ("JPEG",))
    path.write_bytes(progressive(64, 1))
    assert clpt.read_image(path).shape == (64, 64, 3)


@pytest.mark.parametrize("form", ["TIFF", "GIF", "WEBP", "PNG"])
def test_pictures_behind_the_first_are_not_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, form: str
) -> None:
    """To count them takes a time with the square of their number."""
    path = tmp_path / f"a.{form.lower()}"
    pages = [Image.new("RGB", (4, 4), (100 * i, 9, 9)) for i in range(3)]
    pages[0].save(path, form, save_all=True, append_images=pages[1:])
    assert "its first picture of several is taken" in pillow.read(path).notes
    pages[0].save(path, form)
    assert pillow.read(path).notes == ()
    if form == "TIFF":
        many = tmp_path / "many.tif"
        pages[0].save(many, form, save_all=True, append_images=pages[:1] * 3000)
        began = time.process_time()
        pillow.read(many)
        alone = time.process_time() - began
        assert alone < 30.0  # seconds, where counting ten times as many takes minutes


def test_an_unknown_suffix_of_a_mesh(tmp_path: Path) -> None:
    """The known ones are told, for each kind of shape that has a file."""
    for kind in FILES:
        for suffix in (".txt", ".x", ".OBJX", ""):
            if kind.kind in ("curves", "goniometric") and suffix == ".txt":
                continue
            (tmp_path / f"a{suffix}").write_text("hello\n")
            shape = {"type": kind.kind, "file": f"a{suffix}"}
            part = {"lights": [shape]} if kind.kind == "goniometric" else {"shapes": [shape]}
            path = tmp_path / "s.json"
            path.write_text(json.dumps({"camera": {"type": "perspective"}, **part}))
            with pytest.raises(SceneError) as raised:
                clpt.load(path)
            if kind is Mesh:
                assert ".obj, .ply, .stl, .off" in str(raised.value)


HOLDERS = [
    (kind.kind, field.name)
    for kind in materials.KINDS
    for field in fields(kind)
    if field.type == "Material"
]


@pytest.mark.parametrize(("kind", "name"), HOLDERS)
def test_a_material_that_another_needs(tmp_path: Path, kind: str, name: str) -> None:
    assert len(HOLDERS) >= 6
    path = scene(tmp_path, material={"type": kind, name: None})
    with pytest.raises(SceneError, match=f"{kind} needs a material as its '{name}'"):
        clpt.Renderer(clpt.load(path))
