"""`clpt.save` and `clpt.load`: every parameter of every kind comes back as it was."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyopencl.array as cl_array
import pytest

import clpt
from clpt import device, measured, spectra
from clpt.errors import SceneError
from clpt.scene import (
    KINDS,
    Scene,
    cameras,
    integrators,
    lights,
    materials,
    media,
    phases,
    shapes,
    textures,
)
from clpt.scene.motion import Deformation, Keys, Shutter
from clpt.scene.params import Kind, defaults, params
from clpt.scene.roles import Param
from clpt.spectra import reradiation

RNG = np.random.default_rng(5)
POINTS = RNG.random((4, 3)).astype(np.float32)
ROWS = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
TEXELS = RNG.random((2, 3, 3)).astype(np.float32)
COLOURS = RNG.random((4, 3)).astype(np.float32)
CURVE = spectra.Tabulated((400.0, 700.0), (0.25, 0.75))
SENSOR = spectra.Sensor((CURVE, CURVE, CURVE))
PAINT = reradiation.Fluorophore(CURVE, CURVE, 0.5)
GROUP = shapes.Group((shapes.Sphere(radius=0.5),), "group")

NEEDED: dict[type, dict[str, Any]] = {
    textures.Graph: {"nodes": {"vertex_named": {"type": "noise3d"}, "b": {"type": "sin"}}},
    shapes.Mesh: {"vertices": POINTS, "faces": ROWS},
    shapes.Curves: {"points": RNG.random((4, 4)).astype(np.float32), "lengths": (4,)},
    shapes.Spheres: {"centers": POINTS, "radii": np.full(4, 0.5, np.float32)},
    shapes.Instance: {"group": GROUP},
    textures.Bitmap: {"image": TEXELS},
    media.Grid: {"density": TEXELS},
    lights.Envmap: {"image": TEXELS},
    lights.CubeMap: {"image": [TEXELS + i for i in range(6)]},
}
# Some value of a form or role that is not the default, whatever that is.
VALUES: dict[str, Any] = {
    "lens": "planar",
    "optional_number": 3000.0,
    "reflectance": (0.25, 0.5, 0.125),
    "emission": (2.0, 3.0, 4.0),
    "index": "diamond",
    "factor": (1.5, 2.0, 0.5),
    "coefficient": (0.5, 0.25, 2.0),
    "reradiation": PAINT,
    "orders": (0.25, 0.5, 0.125),
    "layers": (materials.Layer(eta=1.25),),
    "vector": (0.5, 0.25, -1.0),
    "direction": (0.0, 0.6, 0.8),
    "matrix3": np.diag([2.0, 3.0, 1.0]),
    "matrix4": np.diag([2.0, 2.0, 2.0, 1.0]),
    "number": 0.375,
    "integer": 7,
    "numbers": (0.5, 0.25, 0.125),
    "names": ("depth",),
    "material": materials.Diffuse(reflectance=(0.1, 0.2, 0.3)),
    "texture": textures.Bitmap(image=TEXELS),
    "textures": (textures.Checkerboard(),),
    "nodes": {"a": {"type": "mix", "fg": [0.1, 0.2, 0.3], "mix": "b"}, "b": {"type": "noise2d"}},
    "filter": integrators.Tent(radius=1.5),
    "area_light": lights.Area(radiance=3.0),
    "medium": media.Homogeneous(sigma_s=2.0, phase=phases.HenyeyGreenstein(g=0.4), name="fog"),
    "media": (media.Homogeneous(sigma_a=0.5), media.Grid(sigma_s=2.0, name="smoke")),
    "phase": phases.Rayleigh(),
    "keys": Keys([0.0, 1.0], [np.eye(4), np.diag([2.0, 2.0, 2.0, 1.0])]),
    "deformation": Deformation([0.5, 1.5], np.arange(18.0).reshape(2, 3, 3)),
    "shutter": Shutter(0.5, 1.5, "triangle"),
    "crop": (1, 2, 3, 4),
    "sensor": SENSOR,
    "white_balance": (0.3, 0.35),
    "attributes": {"vertex_color": COLOURS},
    "normals": "smooth",
    "rows2": POINTS[:, :2].copy(),
    "rows3": POINTS,
    "grid": RNG.normal(size=(3, 4, 2)).astype(np.float32),
    "rows4": NEEDED[shapes.Curves]["points"],
    "triangles": ROWS,
    "lengths": (4,),
    "number_or_list": 0.5,
    "number_or_auto": "auto",
    "image": TEXELS,
    "volume": TEXELS,
    "colour_volume": np.full((1, 1, 1, 3), 0.25, np.float32),
    "cube_images": NEEDED[lights.CubeMap]["image"],
    "group": GROUP,
    "text": "vertex_named",
    "quantity": 0.4,
    "angular": (1.0, 3.0, 2.0),
    "measurement": measured.grey(),
    "merl": measured.MerlTable(values=np.full((2, 2, 2, 3), 0.25)),
}


def other(param: Param, default: Any) -> Any:
    """A value of a parameter that is not its default."""
    form = param.role.name
    if form in ("flag", "boolean"):
        return not default
    if form == "choice":
        return next(name for name in param.choices if name != default)
    if form == "real":
        low = max(param.low, 0.0)
        high = min(param.high, low + 2.0)
        return next(v for k in (3, 5) if (v := low + (high - low) * k / 8) != default)
    return VALUES[form]


def variants(cls: type[Kind]) -> Iterator[Kind]:
    """A kind with its defaults, and for each parameter with another value of that alone."""
    needed, default = NEEDED.get(cls, {}), defaults(cls)
    yield cls(**needed)
    for name, param in params(cls).items():
        try:
            yield cls(**{**needed, name: other(param, default[name])})
        except SceneError:  # it does not go with the defaults of the others
            beside = (
                cameras.Matrix,
                integrators.Film,
                lights.Spot,
                phases.Tabulated,
                media.Mixture,
            )
            assert cls in beside or (issubclass(cls, media.Grid) and name == "bits"), (cls, name)


def same(a: Any, b: Any) -> bool:
    """Whether two values have the same content; an image may be in a file."""
    if isinstance(a, Path) or isinstance(b, Path):
        a, b = (np.load(one) if isinstance(one, Path) else one for one in (a, b))
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return np.array_equal(np.asarray(a), np.asarray(b))
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if isinstance(a, (list, tuple)):
        return len(a) == len(b) and all(map(same, a, b))
    if dataclasses.is_dataclass(a) and type(a) is type(b):
        return all(same(getattr(a, f.name), getattr(b, f.name)) for f in dataclasses.fields(a))
    return a == b


def scene_of(category: str, one: Kind) -> Scene:
    """A scene that holds a kind where it may stand."""
    made = Scene(camera=cameras.Perspective())
    if category == "material":
        made.shapes = [shapes.Sphere(material=one)]
    elif category == "texture":
        made.shapes = [shapes.Sphere(material=materials.Diffuse(reflectance=one))]
    elif category == "shape":
        made.shapes = [one]
    elif category == "light" and isinstance(one, lights.ON_SHAPES):
        made.shapes = [shapes.Sphere(emission=one)]
    elif category == "light":
        made.lights = [one]
    elif category == "medium":
        made.shapes = [shapes.Sphere(interior=one)]
    elif category == "filter":
        made.film = integrators.Film(filter=one)
    else:
        setattr(made, category, one)
    return made


EVERY = [(category, cls) for category, kinds in KINDS.items() for cls in kinds]


@pytest.mark.parametrize(
    ("category", "cls"), [*EVERY, ("film", integrators.Film)], ids=lambda v: getattr(v, "kind", v)
)
def test_every_parameter_of_every_kind(tmp_path: Path, category: str, cls: type[Kind]) -> None:
    for one in variants(cls):
        made = scene_of(category, one)
        clpt.save(made, tmp_path)
        found = clpt.load(tmp_path)
        assert not found.warnings
        for part in ("camera", "film", "integrator", "sampler", "shapes", "lights"):
            assert same(getattr(found, part), getattr(made, part)), (part, one)


def test_arrays_on_a_device_come_to_the_host(tmp_path: Path) -> None:
    queue = device.choose().queue
    points = cl_array.to_device(queue, POINTS)
    mesh = shapes.Mesh(vertices=points, faces=cl_array.to_device(queue, ROWS))
    clpt.save(Scene(camera=cameras.Perspective(), shapes=[mesh]), tmp_path)
    (found,) = clpt.load(tmp_path).shapes
    assert np.array_equal(found.vertices, POINTS)
    assert np.array_equal(found.faces, ROWS)
    buffer = shapes.Mesh(vertices=points.data, faces=ROWS)
    with pytest.raises(SceneError, match=r"mesh\.vertices: a buffer has no shape"):
        clpt.save(Scene(camera=cameras.Perspective(), shapes=[buffer]), tmp_path)


def test_numbers_of_the_scene(tmp_path: Path) -> None:
    made = Scene(camera=cameras.Spherical(), spp=3, noise=0.25, seed=9, name="named")
    clpt.save(made, tmp_path / "other.json")
    found = clpt.load(tmp_path / "other.json")
    assert (found.spp, found.noise, found.seed, found.name) == (3, 0.25, 9, "named")


def test_what_cannot_be_saved(tmp_path: Path) -> None:
    made = Scene(camera=cameras.Perspective())
    with pytest.raises(SceneError, match=r"saved as \.json, .*, not '\.xml'"):
        clpt.save(made, tmp_path / "scene.xml")
    with pytest.raises(SceneError, match="cannot be written"):
        clpt.save(made, tmp_path / "no" / "scene.json")
    with pytest.raises(TypeError, match=r"writes a clpt\.Scene, not str"):
        clpt.save("scene", tmp_path)


def test_smooth_normals_of_a_file_and_of_arrays(tmp_path: Path) -> None:
    """The scene says `smooth`, and the normals follow from the triangles."""
    mesh = shapes.Mesh(vertices=POINTS, faces=ROWS)
    clpt.save(Scene(camera=cameras.Perspective(), shapes=[mesh]), tmp_path)
    file = next(tmp_path.glob("*.ply")).name
    arrays = f'"vertices": {POINTS.tolist()}, "faces": {ROWS.tolist()}'
    (tmp_path / "scene.json").write_text(
        f"""{{"camera": {{"type": "perspective"}}, "shapes": [
            {{"type": "mesh", "file": "{file}", "normals": "smooth"}},
            {{"type": "mesh", {arrays}, "normals": "smooth"}}]}}"""
    )
    assert [shape.normals for shape in clpt.load(tmp_path).shapes] == ["smooth", "smooth"]
    text = (tmp_path / "scene.json").read_text().replace('"smooth"', "[[0, 0, 1]]", 1)
    (tmp_path / "scene.json").write_text(text)
    with pytest.raises(SceneError, match="stands in the 'file' already"):
        clpt.load(tmp_path)
