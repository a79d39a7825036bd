"""A luminaire's distribution of light, seen from afar, and its photometric files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from clpt import device as dev
from clpt.arrays import Floats
from clpt.errors import SceneError
from clpt.files import output_files
from clpt.instruments.measuring import measure
from clpt.scene import Scene
from clpt.scene.studio import world_bounds

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from clpt.render.options import RenderOptions

VERTICAL, HORIZONTAL = np.arange(0.0, 181.0, 5.0), np.arange(0.0, 361.0, 22.5)  # [degrees]


@dataclass(frozen=True)
class Distribution:
    """Luminous intensities of a luminaire.

    vertical (v,): angles from straight down, -y; horizontal (h,): about the vertical, from +z to
    +x [degrees]. candela, errors (h, v) [cd]. size (3,): width, height and length of the
    luminaire's box [m].
    """

    vertical: Floats
    horizontal: Floats
    candela: Floats
    errors: Floats
    size: Floats

    @property
    def lumens(self) -> float:
        """Luminous flux [lm], by zones: each angle stands for the zone around it."""
        edges = np.radians(np.concatenate([
            self.vertical[:1], (self.vertical[1:] + self.vertical[:-1]) / 2, self.vertical[-1:]
        ]))  # fmt: skip
        zones = 2.0 * np.pi * (np.cos(edges[:-1]) - np.cos(edges[1:]))
        return float(self.candela[: max(len(self.candela) - 1, 1)].mean(axis=0) @ zones)


def goniophotometer(
    scene: Scene,
    vertical: ArrayLike = VERTICAL,
    horizontal: ArrayLike = HORIZONTAL,
    *,
    rays: int = 256,
    samples: int = 64,
    device: dev.Device | str | int | None = None,
    **options: Unpack[RenderOptions],
) -> Distribution:
    """Return the distribution of a luminaire, the only content of a scene.

    vertical, horizontal: angles, see `Distribution`; a single horizontal angle is of a luminaire
    with an axis, else they go from 0 to 360. rays: parallel rays of a direction, over a disk around
    the luminaire. samples: paths of each ray. device, options: see `clpt.Renderer`.

    A direction's intensity is the luminance along its rays, times the area of the disk. Lights
    without an extent are not seen by rays: give them a small radius. Raises SceneError.
    """
    v, h = (np.atleast_1d(np.asarray(angles, np.float64)) for angles in (vertical, horizontal))
    if not scene.shapes:
        raise SceneError("has no shapes: rays see no luminaire", where="scene")
    low, high = world_bounds(scene.shapes)
    middle, radius = (low + high) / 2.0, 1.001 * float(np.linalg.norm(high - low)) / 2.0
    origins, directions = _parallel_rays(v, h, radius, rays, np.random.default_rng(scene.seed))
    measured = measure(
        scene, "luminance", middle + origins, directions, samples=samples, device=device, **options
    )
    area = np.pi * radius**2
    scatter = measured.values.std(axis=2, ddof=1) / np.sqrt(rays)
    return Distribution(v, h, area * measured.values.mean(axis=2), area * scatter, high - low)


def _parallel_rays(
    vertical: Floats, horizontal: Floats, radius: float, rays: int, rng: np.random.Generator
) -> tuple[Floats, Floats]:
    """Return origins and directions (h, v, rays, 3) of rays from all angles [degrees].

    They fill a disk of a radius [m] about the origin: one in each of as many rings of one area.
    """
    polar, azimuth = np.radians(vertical), np.radians(horizontal)[:, None]
    sine = np.sin(polar)
    parts = sine * np.sin(azimuth), -np.cos(polar), sine * np.cos(azimuth)
    away = np.stack(np.broadcast_arrays(*parts), axis=-1)[:, :, None]  # (h, v, 1, 3)
    shape = (len(horizontal), len(vertical), rays)
    side = np.cross(away, np.where(np.abs(away[..., 1:2]) < 0.9, [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]))
    side /= np.linalg.norm(side, axis=-1, keepdims=True)
    ring = radius * np.sqrt((np.arange(rays) + rng.random(shape)) / rays)[..., None]
    turn = 2.0 * np.pi * rng.random(shape)[..., None]
    disk = ring * (np.cos(turn) * side + np.sin(turn) * np.cross(away, side))
    origins = 2.0 * radius * away + disk
    return origins, np.broadcast_to(-away, origins.shape)


def write_photometry(path: str | Path, distribution: Distribution, name: str = "clpt") -> None:
    """Write a distribution as .ies (ANSI/IES LM-63-2002) or .ldt (EULUMDAT).

    name: of the luminaire. Raises SceneError for another suffix, and for a .ldt whose angles have
    no even steps.
    """
    path = Path(path)
    forms = {".ies": _ies, ".ldt": _ldt}
    if path.suffix.lower() not in forms:
        raise SceneError("must end with .ies or .ldt", file=path)
    output_files.write_text(path, forms[path.suffix.lower()](distribution, name))


def _ies(d: Distribution, name: str) -> str:
    head = (
        f"1 -1 1 {len(d.vertical)} {len(d.horizontal)} 1 2 "
        f"{d.size[0]:.4g} {d.size[2]:.4g} {d.size[1]:.4g}\n1 1 0\n"
    )
    rows = [d.vertical, d.horizontal, *d.candela]
    lines = (" ".join(f"{value:.6g}" for value in row) for row in rows)
    return f"IESNA:LM-63-2002\n[LUMINAIRE] {name}\nTILT=NONE\n{head}" + "\n".join(lines) + "\n"


def _ldt(d: Distribution, name: str) -> str:
    """The lines of Stockmar's format, 1990: candela for 1000 lm of a lamp of all its lumens."""
    steps = [np.diff(angles) for angles in (d.vertical, d.horizontal)]
    if any(len(step) and np.ptp(step) > 1e-6 for step in steps):
        raise SceneError("its angles must have even steps in a .ldt", where="distribution")
    single = len(d.horizontal) == 1
    planes = d.horizontal if single else d.horizontal[:-1]
    between = 0.0 if single else float(steps[1][0])
    lumens = max(d.lumens, 1e-30)
    millimetres = [round(1000.0 * float(size)) for size in d.size]
    below = d.vertical <= 90.0
    share = 100.0 * Distribution(
        d.vertical[below], d.horizontal, d.candela[:, below], d.errors, d.size
    ).lumens / lumens  # fmt: skip
    head = [
        name, 1, int(single), len(planes), f"{between:g}", len(d.vertical), f"{steps[0][0]:g}", "",
        name, "", "", "", millimetres[2], millimetres[0], millimetres[1], millimetres[2],
        millimetres[0], *[0] * 4, f"{min(share, 100.0):.1f}", 100.0, 1, 0, 1, 1, name,
        f"{lumens:.6g}", "", "", 0, *[0] * 10, *planes, *d.vertical,
    ]  # fmt: skip
    candela = (d.candela[: len(planes)] * 1000.0 / lumens).ravel()
    return "\n".join([*map(str, head), *(f"{value:.6g}" for value in candela)]) + "\n"
