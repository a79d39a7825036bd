"""The choice of an integrator in place of `auto`, and of "auto" light paths of `path`.

Light paths find caustics: light that specular surfaces focus on diffuse surfaces. If the light is
large, paths from the camera find caustics too, and sooner. Photons also find caustics that are seen
in a mirror or through glass.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.files import disk_cache
from clpt.geometry import analytic, casting, shapes, triangles
from clpt.render.geometry import surroundings
from clpt.render.geometry.find import Emitter, Geometry
from clpt.render.lights import bounds as light_bounds
from clpt.render.lights.aims import Sharp, is_sharp
from clpt.render.lights.find import Sources, environment_of
from clpt.render.records.tables import LoweringCache
from clpt.render.scene_index import SceneIndex
from clpt.render.spectra.find import Look
from clpt.render.transport import light_caches, reuse
from clpt.scene import materials as mt
from clpt.scene.integrators import Integrator, Path, Vcm, shared
from clpt.scene.shapes import Shape

SMALL = 0.03  # share of the sphere of directions: a light that fills less is small
NEAR = 0.25  # of the scene's radius: the least distance from a light to lit surfaces
SUN = 0.25  # of an image's power: if a small part sends it, the image is a small light
FEWEST = 3  # edges of a path from a light over two surfaces to the camera: the shortest caustic
MOSTLY = 0.5  # share of small lights in the power of all lights, for more light paths than FEW
FEW = 0.125  # light paths for each sample, if small lights have less than MOSTLY
SOME = 0.25  # the same if small lights have more; `vcm` has 1, as its photons are light paths
STREWN, STREWN_AIMED = 0.25, 0.2  # number and share that aims for lights in shades
SHADE = 0.05  # of the distance from a light to the camera: nearer diffuse surfaces are its shade
SHADED = 0.25  # of the directions of a light that meet its shade; and of the power of all lights
LAMPS = 16  # with the most power, for the search for shades
FOGGY = 0.25, 0.5  # FEW and SOME for lights in media that scatter
MANY = 8  # the same for lights in bulbs, which paths from the camera hardly find
DIRECTIONS = 128  # from a light, for the share of specular surfaces around it
SLACK = 1e-6  # of the cosine of a cone around a surface, for roundings
BULB = 0.75  # of DIRECTIONS: if specular surfaces fill more, the light is in a bulb
SEEN = 0.02  # of the picture: if clear surfaces fill more, caustics may be seen through them
CLEAR = 0.05  # roughness alpha of clear surfaces; light paths are connected to rougher surfaces
RAYS = 256  # of the camera, for the share of clear surfaces
TRIAL_SAMPLES = 1 << 23  # of the film, for a trial of integrators that compiles nothing more

LEAST = 0.25  # share in the power of all lights: small lights in media with less are ignored
THIN, DENSE = 0.3, 5.0  # optical depths from a light to the camera, see bench/notes/media.md
ALL_AROUND = 0.49 * np.pi  # [rad] from a light's axis: a light that reaches it is no spot

Ball = tuple[NDArray[np.float64], float]  # centre and radius
# Its name, its place [m], its share in the power of all lights, its rows in `lights`.
Small = tuple[str, NDArray[np.float64] | None, float, slice]
Slices = tuple[slice, slice]


@dataclass(frozen=True)
class Lit:
    """The facts about a scene that decide its integrator.

    sphere: centre and radius of a sphere around the scene [m]; extinction (n,): of the medium
    around each row of `lights` where it scatters, else 0, and nan on a grid [1/m]; () without
    media.
    """

    index: SceneIndex
    geometry: Geometry
    look: Look
    sources: Sources
    sphere: Ball
    extinction: NDArray[np.float64]

    @cached_property
    def eye(self) -> NDArray[np.float64]:
        """Where the camera is in the middle of the shutter's time (3,) [m]."""
        return surroundings.camera_halfway(self.index)

    @cached_property
    def bounds(self) -> light_bounds.Bounds:
        """The bounds of all rows of `lights`."""
        return light_bounds.concatenated([source.bounds for source in self.sources.every])

    @cached_property
    def small(self) -> tuple[Small, ...]:
        """The small lights: those off all shapes, then shapes."""
        return tuple(_small_lights(self))


def decided(lit: Lit, former: Integrator | None = None) -> tuple[SceneIndex, str]:
    """Return the index with the integrator that "auto" stands for, and the reason as a sentence.

    The sentence is empty if the scene leaves no choice. former: the choice before an edit, which
    stays, since the film has sums for its light paths. Raises SceneError for a broken image light.
    """
    index = lit.index
    wanted = index.integrator
    if not wanted.leaves_choice:
        return index, ""
    if former is None:
        chosen, reason = _reusing(lit, *_choice(lit))
    else:
        keeps = former.has_photons and wanted.asks_photons
        guiding = former.guiding and not wanted.guiding
        guide_paths = former.guide_paths if guiding else 0
        plain = Path(
            light_paths=former.light_paths,
            aimed=former.aimed,
            guiding=guiding,
            guide_paths=guide_paths,
            reuse=former.reuse,
        )
        chosen = former if keeps else plain
        reason = "as before the scene was edited"
    if index.timed:
        chosen, reason = Path(light_paths=0), "the film sorts light by time"
    elif index.light_layers and index.adaptive:
        chosen, reason = Path(light_paths=0), "layers of light have no guides of noise"
    elif "light_groups" in index.layers and chosen.has_photons:
        chosen, reason = Path(light_paths=chosen.light_paths), "photons do not know their group"
    if wanted.guiding:
        chosen = Path(light_paths=0, guiding=True, guide_paths=wanted.guide_paths)
        reason = "directions are guided"
    elif wanted.reuse:
        chosen, reason = Path(light_paths=0, reuse=True), "paths are reused"
    chosen = replace(chosen, **shared(wanted, chosen))
    index = replace(index, integrator=chosen)
    return replace(index, candidates=_candidates(lit, index) if former is None else ()), reason


def _reusing(lit: Lit, chosen: Integrator, reason: str) -> tuple[Integrator, str]:
    """The integrator, and the reason, where path reuse may replace few light paths, or none."""
    other = _way_to_reuse(lit, chosen) if reuse.is_certain(lit.index) else None
    if other is None:
        return chosen, reason
    return other, f"{reason}; paths go from diffuse to diffuse surfaces, so pixels reuse them"


def _way_to_reuse(lit: Lit, chosen: Integrator) -> Integrator | None:
    """Path reuse, if many paths share; None where it is chosen or light paths are needed."""
    if chosen.reuse or chosen.light_paths not in (0, FEW):
        return None
    way = Path(light_paths=0, reuse=True, **shared(lit.index.integrator, Path()))
    return way if reuse.many_share(replace(lit.index, integrator=way), lit.geometry) else None


def _candidates(lit: Lit, index: SceneIndex) -> tuple[Integrator, ...]:
    """The candidates of a trial, the chosen integrator first; empty without a trial.

    A trial pays if many samples are to come. If a limit of noise ends the picture, their number is
    unknown. Some scenes cannot have a guide. Photons blur the picture, and the variance does not
    show that: a trial may replace `vcm` by a cheaper integrator, but never chooses it. `path` is no
    candidate where it cannot find a light behind clear surfaces. Path reuse is a candidate where it
    does not surely pay.
    """
    samples, chosen = index.samples, index.integrator
    if samples < TRIAL_SAMPLES or index.adaptive or index.lit_ghosts or chosen.guiding:
        return ()
    path = Path(light_paths=0, **shared(chosen, Path()))
    finds = not chosen.has_photons or (chosen.light_paths != MANY and _may_be_met(index))
    plain = [path] if finds and chosen.light_paths else []
    several = chosen.max_depth < 0 or chosen.max_depth > 2
    guide = replace(path, guiding=True, guide_paths=light_caches.guide_paths_for(samples))
    guided = [guide] if several and index.lights_reach else []
    reusing = None if reuse.is_certain(index) else _way_to_reuse(lit, chosen)
    others = (*plain, *filter(None, [reusing]), *guided)
    return (chosen, *others) if others else ()


def _may_be_met(index: SceneIndex) -> bool:
    """Whether a ray can meet every light."""
    return all(light.reach in ("surface", "infinite") for light in index.lights)


def _choice(lit: Lit) -> tuple[Integrator, str]:
    """The integrator, without its depths, and the reason; cheap questions come first."""
    index, geometry = lit.index, lit.geometry
    integrator, without = index.integrator, Path(light_paths=0)
    if not index.lights_reach:
        return without, index.lit_media
    if not index.camera.is_connected(index.mode):
        return without, "points cannot be joined to this camera"
    fewest = FEWEST - index.free_panes  # a pane on the way costs no depth
    if 0 <= integrator.max_depth < fewest:
        return without, "the longest path is too short for a caustic"
    if (in_fog := _in_fog(lit)) is not None:
        return in_fog
    sharp = _first_sharp(index.shapes)
    if sharp is None:
        return without, "nothing is specular"
    if not _has_diffuse(index.shapes):
        return without, "there is nothing dull for a caustic to be seen on"
    if not lit.small:
        return without, "no light is small"
    reason = f"{shapes.where(sharp)} is specular, and {lit.small[0][0]} is a small light"
    if sum(share for _, _, share, _ in lit.small) < MOSTLY:
        return Path(light_paths=FEW), f"{reason}, though most light is of large ones"
    number = SOME
    if _enclosed(lit) >= MOSTLY:
        number, reason = MANY, f"{reason}, in a bulb"
    if not _sees_clear(index, geometry):
        reason = f"{reason}; the camera sees little glass and few mirrors"
        return _out_of_sight(lit, number, reason)
    if not integrator.asks_photons or index.has_media or index.shifts:
        return Path(light_paths=number), reason
    if index.adaptive:
        return Path(light_paths=number), f"{reason}; noise is not measured with photons"
    if index.motions:
        return Path(light_paths=number), f"{reason}; photons of a pass are all at one time"
    whole = max(1, int(number))
    return Vcm(light_paths=whole), f"{reason}; the camera sees glass or mirrors"


def _out_of_sight(lit: Lit, number: float, reason: str) -> tuple[Integrator, str]:
    """The integrator where the camera hardly sees what makes caustics; number: of light paths."""
    if number == MANY:
        return Path(light_paths=MANY), reason
    if _has_shades(lit):
        return Path(light_paths=STREWN, aimed=STREWN_AIMED), f"{reason}, and lights have shades"
    return Path(light_paths=FEW), reason


def _in_fog(lit: Lit) -> tuple[Integrator, str] | None:
    """The integrator for small lights in media that scatter; None without such lights.

    Paths from the camera find the light that is scattered near such a light by chance alone. In
    dense fog light paths do not reach the camera. In thin fog a light is the only light on its
    surroundings, which paths from the camera find, except around a spot.
    """
    if not lit.extinction.any():
        return None
    share = lit.sources.power / max(lit.sources.power.sum(), 1e-300)
    spots = lit.bounds.theta_o + lit.bounds.theta_e < ALL_AROUND
    small = []
    for name, place, _, rows in lit.small:
        far = 0.0 if place is None else float(np.linalg.norm(place - lit.eye))
        depth = far * lit.extinction[rows]
        pays = np.isnan(depth) | (depth > np.where(spots[rows], 0.0, THIN)) & (depth < DENSE)
        small.append((name, share[rows][pays].sum()))
    power = sum(part for _, part in small)
    if power < LEAST:
        return None
    name = next(name for name, part in small if part)
    number = FOGGY[int(power >= MOSTLY)]
    return Path(light_paths=number), f"{name} is a small light in a medium that scatters"


def _hides(shape: Shape) -> bool:
    """Whether a shape is filled with a medium that scatters, so that it makes no caustic."""
    return shape.interior is not None and shape.interior.scatters


def _enclosed(lit: Lit) -> float:
    """Return the share of the light's power that comes from bulbs: see `_is_enclosed`."""
    placed = [(place, share) for _, place, share, _ in lit.small if place is not None]
    sharp = Sharp(lit.geometry, (), lambda m: is_sharp(m) and not _is_diffuse(m))
    by = [(place.tolist(), share) for place, share in placed]

    def share_of(pieces: Iterable[NDArray[np.float64]]) -> float:
        pieces = list(pieces)
        return sum(share for place, share in placed if _is_enclosed(pieces, place))

    return float(sharp.remembered(__file__, ("enclosed", by), share_of))


def _is_enclosed(shapes_: Iterable[NDArray[np.float64]], place: NDArray[np.float64]) -> bool:
    """Whether a light at a place [m] is in a bulb: the pieces of shapes fill most directions."""
    covered = np.zeros(DIRECTIONS, bool)
    directions = casting.cone(np.array([0.0, 0.0, 1.0]), -1.0, DIRECTIONS).T
    for pieces in shapes_:
        covered[_covered(pieces, place, directions)] = True
    return bool(covered.mean() > BULB)


def _covered(
    pieces: NDArray[np.float64], place: NDArray[np.float64], directions: NDArray[np.float64]
) -> NDArray[np.intp]:
    """Return which directions (3, n) from a place meet pieces, some more than once."""
    a, b, c = (pieces[:, i : i + 3] - place for i in (0, 3, 6))
    middle, reach = (a + b + c) / 3.0, pieces[:, 9]
    size = reach + np.max([np.linalg.norm(p - middle, axis=1) for p in (a, b, c)], axis=0)
    away, along = np.linalg.norm(middle, axis=1), middle @ directions
    edge = np.where(size < away, np.sqrt(np.maximum(away * away - size * size, 0.0)), -away)
    piece, way = np.nonzero(along >= (edge - SLACK * away)[:, None])  # a cone around each piece
    a, b, c, middle, reach = (values[piece] for values in (a, b, c, middle, reach))
    ahead = np.sign(np.einsum("ij,ij->i", a, np.cross(b, c)))
    towards = directions.T[way]
    sides = [np.einsum("ij,ij->i", np.cross(p, q), towards) for p, q in ((a, b), (b, c), (c, a))]
    apart = (middle * middle).sum(axis=1) - np.maximum(along[piece, way], 0.0) ** 2
    return way[(apart <= reach * reach) | (np.min(sides * ahead, axis=0) > 0.0)]


def _sees_clear(index: SceneIndex, geometry: Geometry) -> bool:
    """Whether mirrors and clear shapes fill enough of the picture, as if no shape hid them."""
    view = index.camera.view_of(index.film.width, index.film.height)
    assert view is not None, "a camera that can be joined has a point"

    def sees(shapes_: Iterable[NDArray[np.float64]]) -> bool:
        directions = casting.cone(view.axis, math.cos(view.angle), RAYS).T
        for pieces in shapes_:
            met = _covered(pieces, view.origin, directions)
            directions = np.delete(directions, met, axis=1)
            if directions.shape[1] <= (1.0 - SEEN) * RAYS:
                return True
        return False

    sharp = Sharp(geometry, index.motions.shapes, lambda m: is_sharp(m, CLEAR))
    by = "sees", view.origin.tolist(), view.axis.tolist(), view.angle
    return bool(sharp.remembered(__file__, by, sees))


def _has_shades(lit: Lit) -> bool:
    """Whether much light first meets diffuse surfaces close to its source.

    These are small and bright, as irradiance falls with the square of the distance. Paths from the
    camera seldom meet them, and light paths all do. Instances and analytic shapes do not count.
    """
    brightest = sorted(lit.small, key=lambda light: -light[2])[:LAMPS]
    lamps = [
        (place, share, float(np.linalg.norm(lit.eye - place)), _directions(lit.bounds[rows]))
        for _, place, share, rows in brightest
        if place is not None
    ]
    shades = [
        (slice_, faces)
        for shape, slice_, faces in lit.geometry.meshes()
        if shape.emission is None and _is_diffuse(shape.material)
    ]

    def has_shades() -> bool:
        shaded = 0.0
        for place, share, far, directions in lamps:
            met = _covered(_nearby(lit.geometry, shades, place, SHADE * far), place, directions)
            shaded += share * (len(np.unique(met)) >= SHADED * DIRECTIONS)
        return shaded >= SHADED

    asked = repr(([(p.tolist(), s, far, d.tobytes()) for p, s, far, d in lamps], shades)).encode()
    return bool(disk_cache.remembered([__file__], (lit.geometry.digest, asked), has_shades))


def _directions(bounds: light_bounds.Bounds) -> NDArray[np.float64]:
    """Directions (3, DIRECTIONS) of light with bounds; all directions where they differ much."""
    axis = bounds.axis.mean(axis=0)
    apart = np.arccos(np.clip(bounds.axis @ bounds.axis[0], -1.0, 1.0)).max()
    widest = apart + (bounds.theta_o + bounds.theta_e).max()
    if bounds.both.any() or widest >= np.pi:
        return casting.cone(np.array([0.0, 0.0, 1.0]), -1.0, DIRECTIONS).T
    return casting.cone(axis / np.linalg.norm(axis), math.cos(widest), DIRECTIONS).T


def _nearby(
    geometry: Geometry, meshes: list[Slices], place: NDArray[np.float64], near: float
) -> NDArray[np.float64]:
    """Return pieces (n, 10) of meshes, by their vertices and faces, close to a place [m]."""
    found = [np.zeros((0, 10))]
    for vertices, faces in meshes:
        corners = geometry.vertices[vertices]
        if _apart(corners.min(axis=0), corners.max(axis=0), place) > near:
            continue
        triangles_ = geometry.vertices[geometry.faces[faces]].astype(np.float64)
        close = _apart(triangles_.min(axis=1), triangles_.max(axis=1), place) <= near
        found.append(np.pad(triangles_[close].reshape(-1, 9), ((0, 0), (0, 1))))
    return np.concatenate(found)


def _apart(
    low: NDArray[np.floating], high: NDArray[np.floating], place: NDArray[np.float64]
) -> Any:
    """Return the distance from a place to boxes (..., 3)."""
    return np.linalg.norm(np.maximum(np.maximum(low - place, place - high), 0.0), axis=-1)


def _by_material(all_: Iterable[Shape]) -> Iterable[Shape]:
    """Return the first shape of each material."""
    first: dict[int, Shape] = {}
    for shape in all_:
        first.setdefault(id(shape.material), shape)
    return first.values()


def _first_sharp(all_: Iterable[Shape]) -> Shape | None:
    """Return the first shape that is specular and makes caustics."""
    clear = _by_material(shape for shape in all_ if not _hides(shape))
    return next((shape for shape in clear if is_sharp(shape.material)), None)


def _has_diffuse(all_: Iterable[Shape]) -> bool:
    """Return whether a diffuse surface that emits no light can show caustics."""
    dark = _by_material(shape for shape in all_ if shape.emission is None)
    return any(_is_diffuse(shape.material) for shape in dark)


def _is_diffuse(material: mt.Material) -> bool:
    """Whether light paths can be connected to the camera on a material, or on a part of it."""
    if not material.reversible:
        return False
    if material.is_composite:
        return any(map(_is_diffuse, material.shared_parts.values()))
    return not material.delta and not is_sharp(material)


def _small_lights(lit: Lit) -> Iterator[Small]:
    motions, geometry = lit.index.motions, lit.geometry
    sources, (middle, radius) = lit.sources, lit.sphere
    lamps, share = lit.index.lights, sources.power / max(sources.power.sum(), 1e-300)
    for row, i in enumerate(sources.order):
        lamp = lamps[i]
        environment = environment_of(lamp, lit.look)
        if environment is not None:
            small = environment.extent(SUN) < SMALL
        else:
            small = lamp.reach in ("placed", "distant") and lamp.falloff
        bounds, place = lamp.bounds(), None
        if bounds is not None:
            place = motions.halfway(motions.lamps.get(i), (bounds.low + bounds.high) / 2.0)
            far = max(float(np.linalg.norm(place - middle)), NEAR * radius)
            small = small and float(((bounds.high - bounds.low) ** 2).sum()) < SMALL * far**2
        elif lamp.reach == "placed":
            small = False
        if small:
            yield f"lights[{i}]", place, float(share[row]), slice(row, row + 1)
    ends = (*sources.first, len(share))[1:]
    for emitter, first, end in zip(geometry.emitters, sources.first, ends, strict=True):
        area, place = _area_and_place(emitter, lit.look.cache)
        keys = motions.shapes.get(int(geometry.rows[emitter.shape_row]["number"]))
        place = motions.halfway(keys, place)
        far = max(float(np.linalg.norm(place - middle)), NEAR * radius)
        if area < SMALL * 4.0 * np.pi * far**2:
            rows = slice(first, end)
            yield shapes.where(emitter.shape), place, float(share[rows].sum()), rows


def _area_and_place(emitter: Emitter, cache: LoweringCache) -> tuple[float, NDArray[Any]]:
    """The area of a shape that emits [m^2], and the middle of the box around it (3,) [m]."""
    vertices, faces = emitter.vertices, emitter.faces
    if vertices is None:
        low, high = analytic.bounds(emitter.shape)
        return analytic.area(emitter.shape), (low + high) / 2.0
    middle = (vertices[:, :3].min(axis=0) + vertices[:, :3].max(axis=0)) / 2.0
    if emitter.shape.kind in shapes.ONE_OF:
        return float(4.0 * np.pi * (vertices[:, 3].astype(np.float64) ** 2).sum()), middle
    return float(cache(triangles.triangle_areas, vertices, faces).sum()), middle
