"""A preparation ends soon after the time of its load is spent, whatever a scene has many of.

Scenes are drawn: kinds of parts, their numbers, and the kinds of their values.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.random import Generator
from PIL import Image

import clpt
from clpt.errors import LONGEST, SceneError
from clpt.render.flow.scene_to_tables import lower

LEFT = 0.05  # of the time of the load [s]
SOON = 0.6  # from then to the error at most [s of the processor]
LAMP = {"lights": [{"type": "constant"}]}
Parts = dict[str, Any]


def point(rng: Generator) -> list[float]:
    return [float(x) for x in rng.normal(size=3)]


def value(rng: Generator) -> Any:
    """A colour, a number, or a spectrum."""
    colour = [float(x) for x in rng.uniform(0.1, 0.9, 3)]
    lambdas = [float(x) for x in np.sort(rng.choice(np.arange(380, 720), 24, replace=False))]
    values = [float(x) for x in rng.uniform(0.1, 0.9, 24)]
    spectrum = {"type": "tabulated", "lambdas": lambdas, "values": values, "outside": "hold"}
    return [colour, {"type": "rgb", **dict(zip("rgb", colour, strict=True))}, spectrum][
        int(rng.integers(3))
    ]


def lamps(rng: Generator, folder: Path) -> Parts:
    count = int(rng.integers(3000, 6000))
    return {
        "lights": [
            {"type": "point", "position": point(rng), "intensity": value(rng)} for _ in range(count)
        ]
    }


def shining(rng: Generator, folder: Path) -> Parts:
    emissions = [{"type": "area", "radiance": value(rng)} for _ in range(2000)]
    place = [{"center": point(rng), "radius": 1e-3} for _ in emissions]
    return {
        "shapes": [
            {"type": "sphere", **at, "emission": light}
            for at, light in zip(place, emissions, strict=True)
        ]
    }


def coloured(rng: Generator, folder: Path) -> Parts:
    kinds = ["diffuse", "principled", "plastic", "rough_plastic"]
    names = {"principled": "base_color", "diffuse": "reflectance"}
    shapes = []
    for _ in range(int(rng.integers(2500, 3500))):
        kind = kinds[int(rng.integers(4))]
        material = {"type": kind, names.get(kind, "diffuse_reflectance"): value(rng)}
        shapes.append({"type": "cube", "to_world": {"translate": point(rng)}, "material": material})
    return {"shapes": shapes, **LAMP}


def instances(rng: Generator, folder: Path) -> Parts:
    kind = ["sphere", "cube", "disk"][int(rng.integers(3))]
    placed = [
        {"type": "instance", "group": "g", "to_world": {"translate": point(rng)}}
        for _ in range(12000 if kind != "cube" else 40000)
    ]
    return {"groups": {"g": [{"type": kind}]}, "shapes": placed, **LAMP}


def bricks(rng: Generator, folder: Path) -> Parts:
    side = int(rng.integers(250, 300))
    np.save(folder / "d.npy", rng.random((side, side, side), np.float32))
    medium = {"type": "grid", "density": "d.npy", "sigma_t": 3.0, "albedo": value(rng)}
    medium |= {"emission": 1.0} if rng.random() < 0.5 else {}
    null = {"type": "null"}
    return {
        "media": {"m": medium}, "shapes": [{"type": "cube", "material": null, "interior": "m"}],
        **LAMP,
    }  # fmt: skip


def picture(rng: Generator, folder: Path) -> dict[str, Any]:
    side = int(rng.integers(3500, 4500))
    Image.fromarray(rng.integers(0, 255, (side, side, 3), np.uint8)).save(folder / "a.tif")
    return {"type": "bitmap", "image": "a.tif", "filter": "trilinear"}


def mip_maps(rng: Generator, folder: Path) -> Parts:
    material = {"type": "diffuse", "reflectance": picture(rng, folder)}
    return {"shapes": [{"type": "rectangle", "material": material}], **LAMP}


def sky(rng: Generator, folder: Path) -> Parts:
    return {"lights": [{"type": "envmap", "image": picture(rng, folder)["image"]}]}


PARTS: tuple[Callable[[Generator, Path], Parts], ...] = (
    lamps, shining, coloured, instances, bricks, mip_maps, sky,
)  # fmt: skip


def drawn(parts: Callable[[Generator, Path], Parts], seed: int, folder: Path) -> Path:
    rng = np.random.default_rng(seed)
    film = {"width": 8, "height": 8, "mode": ["spectral", "rgb"][int(rng.integers(2))]}
    if parts in (mip_maps, sky):
        film["mode"] = "spectral"
    path = folder / "scene.json"
    made = {"camera": {"type": "perspective"}, "film": film, **parts(rng, folder)}
    path.write_text(json.dumps(made))
    return path


def seconds_to_error(act: Callable[[], object]) -> float:
    """The time to the error of a spent budget [s of the processor, of this thread]."""
    begun = time.thread_time()
    with pytest.raises(SceneError, match=r"takes more than .* s: .*raise --load-seconds") as raised:
        act()
    took = time.thread_time() - begun
    assert len(str(raised.value)) <= LONGEST and str(raised.value).isprintable()
    return took


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.slow)])
@pytest.mark.parametrize("parts", PARTS, ids=lambda parts: parts.__name__)
def test_a_preparation_ends_soon(
    parts: Callable[[Generator, Path], Parts], seed: int, tmp_path: Path
) -> None:
    """Each would take seconds more."""
    scene = clpt.load(drawn(parts, seed, tmp_path), budget=clpt.Budget(seconds=600.0))
    assert scene.account is not None
    scene.account.spent = 600.0 - LEFT
    assert seconds_to_error(lambda: lower(scene)) < LEFT + SOON


@pytest.mark.parametrize("parts", [lamps, coloured, instances], ids=lambda parts: parts.__name__)
def test_a_load_ends_soon(parts: Callable[[Generator, Path], Parts], tmp_path: Path) -> None:
    path = drawn(parts, 3, tmp_path)
    assert seconds_to_error(lambda: clpt.load(path, budget=clpt.Budget(seconds=LEFT))) < LEFT + SOON
