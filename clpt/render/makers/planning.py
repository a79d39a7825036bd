"""Plans of another scene for a film on a device, in the quickest way that is possible.

There are three ways. Shapes that only move do so on the device. Values of the camera and of
materials are a few written words. For any other change the scene is lowered again.
"""

from __future__ import annotations

import itertools
import logging
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from clpt import device as dev
from clpt.geometry import shapes
from clpt.render.edit.moving import Move, Moving
from clpt.render.edit.plans import (
    Patch,
    Plan,
    has_other_paths,
    prepare_patch,
    prepare_rebuild,
    refusal,
)
from clpt.render.edit.scene_edit import (
    MaterialKey,
    Replacements,
    ShapeKey,
    between,
    edit_scene,
    match_replacements,
    resolve_device_arrays,
)
from clpt.render.flow.scene_to_tables import Lowered
from clpt.render.geometry.surroundings import bodies_around, media_around
from clpt.render.makers.device_film import DeviceFilm, Once
from clpt.render.media.bodies import matter_of
from clpt.render.wavefront.wavefront import Wavefront
from clpt.scene import Scene
from clpt.scene.cameras import Camera
from clpt.scene.integrators import Integrator
from clpt.scene.lights import Light
from clpt.scene.materials import Material
from clpt.scene.params import fields_of, params

log = logging.getLogger("clpt.render.renderer")  # which the documentation names


@dataclass(frozen=True, eq=False)
class Changes:
    """Changes of a scene, see `Renderer.update`; integrator: in place of the former choice."""

    camera: Camera | None = None
    materials: Mapping[MaterialKey, Material] | None = None
    transforms: Mapping[ShapeKey, Any] | None = None
    vertices: Mapping[ShapeKey, Any] | None = None
    scene: Scene | None = None
    motion: bool = False
    integrator: Integrator | None = None

    @property
    def by_key(self) -> dict[str, Mapping[Any, Any]]:
        """The changes of parts of the scene that are not empty, by name."""
        parts = {
            "materials": self.materials, "transforms": self.transforms, "vertices": self.vertices
        }  # fmt: skip
        return {name: changes for name, changes in parts.items() if changes}

    @property
    def moves(self) -> Changes:
        """The changes of transforms and vertices alone."""
        return Changes(transforms=self.transforms, vertices=self.vertices)


@dataclass(frozen=True, eq=False)
class Exchange(Plan):
    """A wavefront in place of a film's former wavefront, whose film has another form.

    rebuild: of a wavefront that was in use before; None for a new one.
    """

    film: DeviceFilm
    wavefront: Wavefront
    rebuild: Plan | None = None

    def write(self) -> None:
        if self.rebuild is not None:
            self.rebuild.write()
        self.film.exchange(self.wavefront)


@dataclass(frozen=True, eq=False)
class SceneChange(Plan):
    """Another scene of a film: plans in the order of their writes, and facts about the scene.

    replaced: its shapes and materials that replace others; blurred: whether the tables have keys of
    motion that the scene does not have; rebuilt: whether it was lowered again.
    """

    film: DeviceFilm
    plans: tuple[Plan, ...]
    scene: Scene
    warnings: list[str]
    replaced: Replacements
    blurred: bool
    rebuilt: bool

    @property
    def repeatable(self) -> bool:
        return all(plan.repeatable for plan in self.plans)

    def write(self) -> None:
        for plan in self.plans:
            plan.write()
        film = self.film
        film.scene, film.warnings, film.blurred = self.scene, self.warnings, self.blurred
        film.successors.note(self.replaced)
        if self.rebuilt:
            film.moving = None


def plan(
    film: DeviceFilm, changes: Changes, events: dev.Events, share: Once | None = None
) -> Plan | None:
    """Return the plan of a changed scene for a film; None if nothing is to be written.

    events: to wait for before arrays of the changes are read; share: see `DeviceFilm`. Raises as
    `Renderer.update` does; nothing has changed then.
    """
    if changes.integrator is not None:
        return _another_integrator(film, changes.integrator, share)
    scene, replaced = _edited(film, changes, share)
    quick: list[Plan] | None = None
    if changes.scene is None and not (changes.motion or film.blurred):
        quick = _quick_plans(film, changes, scene, share)
    if quick is not None:
        return SceneChange(film, tuple(quick), scene, film.warnings, replaced, False, False)
    rebuilt, warnings = _rebuilt(film, scene, events, changes, share)
    return SceneChange(film, (rebuilt,), scene, warnings, replaced, changes.motion, True)


def _edited(film: DeviceFilm, changes: Changes, share: Once | None) -> tuple[Scene, Replacements]:
    """Return the changed scene, and the replacements of its parts."""
    scene = film.scene if changes.scene is None else changes.scene
    replaced = {} if changes.scene is None else match_replacements(film.scene.shapes, scene.shapes)
    if changes.by_key:

        def edit() -> tuple[Scene, Replacements]:
            by_key = changes.materials, changes.transforms, changes.vertices
            return edit_scene(base, film.successors, *by_key)

        base, key = scene, ("edited", *changes.by_key)
        scene, more = edit() if share is None else share(key, edit)
        replaced |= more
    if changes.camera is not None:
        scene = replace(scene, camera=changes.camera)
    return scene, replaced


def _quick_plans(
    film: DeviceFilm, changes: Changes, scene: Scene, share: Once | None
) -> list[Plan] | None:
    """Return plans that need no lowering; None if some change needs it."""
    plans: list[Plan] = []
    moves = bool(changes.transforms or changes.vertices)
    if moves:
        move = _move(film, changes, share)
        if move is None:
            return None
        plans.append(move)
    if not moves or changes.materials is not None or changes.camera is not None:
        words = _patch(film, scene)
        if words is None:
            return None
        plans.append(words)
    return plans


def _move(film: DeviceFilm, changes: Changes, share: Once | None) -> Move | None:
    """Return the plan that moves shapes on the device; None if they cannot move there."""
    if film.moving is None:
        film.moving = Moving(film.wavefront.scene, film.scene.shapes)
    moved, replaced = _edited(film, changes.moves, share)
    if _enters_a_medium(film, moved):
        return None
    move = film.moving.plan(film.scene.shapes, replaced)
    if isinstance(move, str):
        log.debug("shapes cannot move on the device: %s", move)
        return None
    return move


def _patch(film: DeviceFilm, scene: Scene) -> Patch | None:
    """Return the plan that writes differing words of parameters; None if more differs."""
    if _enters_a_medium(film, scene):
        return None
    words = prepare_patch(film.wavefront.scene, film.scene, scene)
    if isinstance(words, str):
        log.debug("words alone do not change the scene: %s", words)
        return None
    return words


def _enters_a_medium(film: DeviceFilm, scene: Scene) -> bool:
    """Return whether the camera or a light of a changed scene may be in other media."""
    lowered = film.wavefront.scene.lowered
    if not lowered.features.media.absorbing:
        return scene.camera.medium is not film.scene.camera.medium
    if lowered.features.light_media and _lights_moved(film.scene, scene):
        return True
    readable = resolve_device_arrays(scene, film.device.queue)
    if not lowered.features.media.bodies:
        return media_around(readable, lowered.cache) != lowered.around
    return bodies_around(readable, matter_of, lowered.cache) != lowered.around


def _rebuilt(
    film: DeviceFilm, scene: Scene, events: dev.Events, changes: Changes, share: Once | None
) -> tuple[Plan, list[str]]:
    """Lower a scene; return the plan of it, and its warnings.

    With motion, shapes, lights and the camera move from the present scene to this scene.
    """
    for event in events or ():
        dev.wait(event)
    shown, remarks = between(film.scene, scene) if changes.motion else (scene, [])
    whole = changes.scene is not None
    former = film.wavefront.scene.lowered
    lowered = film.lower(shown, share, former, anew=whole)
    warnings = [*lowered.warnings, *remarks]
    if has_other_paths(former, lowered):
        return _exchange(film, lowered), warnings
    beside = film.beside.wavefront.scene if film.beside is not None else None
    return prepare_rebuild(film.wavefront, lowered, not whole, beside), warnings


def _another_integrator(
    film: DeviceFilm, integrator: Integrator, share: Once | None
) -> Exchange | None:
    """Return the plan of another integrator; None if the form of the film stays."""
    former = film.wavefront.scene.lowered
    lowered = film.lower(film.scene, share, replace(former, integrator=integrator))
    return _exchange(film, lowered) if has_other_paths(former, lowered) else None


def _exchange(film: DeviceFilm, lowered: Lowered) -> Exchange:
    """Return the plan of another wavefront. Raises as `Wavefront.create`, or `refusal`."""
    refused = refusal(film.wavefront.scene.lowered, lowered)
    if refused is not None:
        raise refused
    spare = film.spare(lowered)
    if spare is not None:
        return Exchange(film, spare, prepare_rebuild(spare, lowered))
    wavefront = film.create(lowered)
    wavefront.prepare()
    return Exchange(film, wavefront)


def _lights_moved(former: Scene, scene: Scene) -> bool:
    """Return whether lights, or boundaries of their media, may have moved."""
    places = [
        [*map(shapes.geometry, each.shapes), *map(_placement, each.lights)]
        for each in (former, scene)
    ]
    return len(places[0]) != len(places[1]) or any(
        old is not new
        for olds, news in zip(*places, strict=True)
        for old, new in itertools.zip_longest(olds, news)
    )


def _placement(light: Light) -> tuple[Any, ...]:
    """Return the parameters of a light that place it."""
    values = fields_of(light)
    return tuple(values[n] for n, p in params(type(light)).items() if p.role.place == "host")
