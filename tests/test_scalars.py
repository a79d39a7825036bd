"""Numbers of NumPy are numbers: of every kind, of the film and of what takes a count."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import clpt
from clpt import arrays
from clpt.errors import SceneError
from clpt.scene import KINDS, cameras, integrators, lights, materials, media, shapes
from clpt.scene.params import Kind, defaults, params
from clpt.spectra import RGB, Cauchy, Constant

WHOLE = (np.int64, np.int32, np.uint8, lambda v: np.array(v), lambda v: np.array(v, np.uint16))
REAL = (np.float64, np.float32, np.float16, np.longdouble, lambda v: np.array(v, np.float32))
FLAGS = (np.bool_, lambda v: np.array(v))
NO_NUMBERS = (
    "3", None, 1j, np.complex64(1), True, np.True_, np.array(True), np.array([1]), np.str_("3"),
    np.timedelta64(3, "s"), np.ma.masked, np.ma.array(3.0, mask=True), [3], b"3",
)  # fmt: skip


def test_what_is_a_number() -> None:
    for value in (3, 3.0, Fraction(3), *(make(3) for make in (*WHOLE, *REAL))):
        assert arrays.number(value) == 3.0 and type(arrays.number(value)) is float
    for value in (3, *(make(3) for make in WHOLE)):
        assert type(arrays.whole(value, 1, 3)) is int
    for value in (True, *(make(True) for make in FLAGS)):
        assert arrays.flag(value) is True


@pytest.mark.parametrize("value", NO_NUMBERS, ids=repr)
def test_what_is_none(value: Any) -> None:
    for check in (arrays.number, arrays.real, arrays.whole):
        with pytest.raises(SceneError, match=r"must be a .*number.*, not"):
            check(value)


@pytest.mark.parametrize("value", [np.nan, np.float32("inf"), 10**400, 1e39, np.array(-np.inf)])
def test_numbers_that_kernels_cannot_hold(value: Any) -> None:
    with pytest.raises(SceneError, match=r"must be finite|beyond"):
        arrays.number(value)


def scalar_parameters() -> Iterator[tuple[type[Kind], str, Any]]:
    """Yield each parameter of each kind whose default is a number or a flag, and that default."""
    kinds = {cls for group in KINDS.values() for cls in group}
    others = {*integrators.KINDS, *integrators.FILTERS, clpt.Film, materials.Layer}
    for cls in sorted(kinds | others, key=lambda one: one.__name__):
        for name, value in defaults(cls).items():
            listed = params(cls)[name].role.name == "number_or_list"
            if isinstance(value, (bool, int, float)) and cls is not shapes.Instance and not listed:
                yield cls, name, value


@pytest.mark.parametrize(
    ("cls", "name", "value"),
    scalar_parameters(),
    ids=lambda one: one.__name__ if isinstance(one, type) else str(one),
)
def test_parameters_of_every_kind(cls: type[Kind], name: str, value: Any) -> None:
    """A number of NumPy, or an array without axes, is what Python's own would be; text is none."""
    plain = getattr(cls(), name)
    numbers = (np.float64, lambda v: np.array(v, np.float64))
    makers: tuple[Callable[[Any], Any], ...] = (
        FLAGS if isinstance(value, bool) else numbers if isinstance(value, float) else WHOLE[:2]
    )
    for make in makers:
        held = getattr(cls(**{name: make(value)}), name)
        assert held == plain and type(held) is type(plain)
    for wrong in ("yes", 1j, np.array([value, value])):
        with pytest.raises(SceneError, match=name):
            cls(**{name: wrong})
    if not isinstance(value, bool):
        with pytest.raises(SceneError, match=name):
            cls(**{name: np.float64("nan")})


def test_numbers_beside_kinds() -> None:
    film = clpt.Film(size=np.array([8, 6]), crop=np.array([1, 1, 2, 2]), bands=np.int8(3))
    assert film.size == (2, 2) and all(type(n) is int for n in (*film.crop, film.width, film.bands))
    camera = cameras.Perspective(origin=np.array([0.0, 0, 5]), target=np.zeros(3))
    scene = clpt.Scene(
        camera=camera, film=film, spp=np.uint8(3), seed=np.int64(5), noise=np.float32(0.5)
    )
    assert (scene.spp, scene.seed, scene.noise) == (3, 5, 0.5)
    assert scene.changed({"film.width": np.int64(9)}).film.width == 9
    with clpt.Renderer(
        scene, slots=np.int64(64), queued=np.False_, first_sample=np.int8(2)
    ) as made:
        made.reset(seed=np.int64(6), first_sample=np.uint8(1))
        assert made.run(np.array(2)) and made.image().shape == (2, 2, 3)
    for wrong in ([1, 2, 3], 5, np.array(5), "abcd", [1.0, 1, 2, 2], [True, 1, 2, 2]):
        with pytest.raises(SceneError, match=r"film\.crop: must be four whole numbers"):
            clpt.Film(size=(8, 6), crop=wrong)


def test_spectra_hold_numbers_of_python() -> None:
    for made in (
        Constant(np.float32(0.5)), RGB(np.float32(0.5), np.array(0.25), np.int64(1)),
        Cauchy(np.float64(1.5), np.array(0.01)),
    ):  # fmt: skip
        assert all(type(value) is float for value in dataclasses.asdict(made).values())
    for wrong in ("1", 1j, None, np.zeros(2)):
        with pytest.raises(SceneError, match="must be a number"):
            Constant(wrong)
    assert materials.Diffuse(reflectance=np.array(0.5)).reflectance == Constant(0.5)
    assert media.Homogeneous.from_albedo(0.5, 1.0, g=np.float32(0.5)).phase.g == Constant(0.5)


@pytest.mark.parametrize("arguments", [{"origin": np.zeros(3)}, {"target": np.ones(3)}])
def test_a_camera_with_one_end(arguments: dict[str, Any]) -> None:
    for form in (np.asarray, tuple):
        given = {name: form(value) for name, value in arguments.items()}
        with pytest.raises(SceneError, match="give origin and target, both"):
            cameras.Perspective(**given)


@pytest.mark.parametrize("answer", [False, np.False_, 0, np.array(False), ""], ids=repr)
def test_what_ends_a_run(answer: Any) -> None:
    scene = clpt.Scene(camera=cameras.Spherical(), film=clpt.Film(size=(8, 8)))
    with clpt.Renderer(scene) as renderer:
        assert renderer.run(64, lambda _: answer) is False
        assert renderer.run(2, lambda _: None) is True


def test_colours_as_codes() -> None:
    """`#rrggbb` is sRGB, as in scene.json, wherever a colour stands."""
    orange = (1.0, 0.21586050, 0.0)
    for held in (
        materials.Diffuse(reflectance="#ff8000").reflectance,
        lights.Point(intensity="#FF8000").intensity,
    ):
        assert (held.r, held.g, held.b) == pytest.approx(orange)
    for wrong in ("#ff80", "ff8000", "#ff80zz", ""):
        with pytest.raises(SceneError, match="reflectance"):
            materials.Diffuse(reflectance=wrong)
    with pytest.raises(SceneError):
        materials.Conductor(eta="#ff8000")


def test_kinds_have_scalars() -> None:
    """The table above is not empty, and holds each of the three sorts."""
    found = [type(value) for _, _, value in scalar_parameters()]
    assert min(found.count(one) for one in (bool, int, float)) > 5
    assert params(shapes.Mesh)["subdivision"].role.name == "integer"
