"""A renderer that follows the scene of a session in a size of its own."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

from clpt.errors import SceneError
from clpt.render.renderer import Renderer
from clpt.scene import Scene
from clpt.scene.cameras import Camera
from clpt.scene.materials import Material

Variant = Callable[[Scene], Scene]
Make = Callable[..., Renderer]  # called with a scene


@dataclasses.dataclass(frozen=True)
class Change:
    """The difference of a scene from the former scene: its camera, materials, or anything.

    materials: new materials by the materials that they replace; whole: anything else differs too.
    """

    camera: Camera | None = None
    materials: dict[Material, Material] = dataclasses.field(default_factory=dict)
    whole: bool = False

    def then(self, after: Change) -> Change:
        """Return this change and a later change as a single change."""
        materials = {old: after.materials.get(new, new) for old, new in self.materials.items()}
        fresh = set(self.materials.values())
        materials |= {old: new for old, new in after.materials.items() if old not in fresh}
        return Change(after.camera or self.camera, materials, self.whole or after.whole)


class Target:
    """A renderer of a variant of the scene, such as a smaller picture; made when it is needed."""

    def __init__(self, make: Make, variant: Variant):
        self.make, self.variant = make, variant
        self.renderer: Renderer | None = None
        self._pending: Change | None = None

    def note(self, change: Change) -> None:
        """Note that the scene has changed."""
        self._pending = change if self._pending is None else self._pending.then(change)

    @property
    def is_slow(self) -> bool:
        """Whether `follow` may have to build something first."""
        change = self._pending
        return self.renderer is None or (
            change is not None and (change.whole or bool(change.materials))
        )

    def follow(self, scene: Scene) -> Renderer:
        """Return the renderer, of this scene; its film is empty if anything has changed.

        Raises SceneError, MemoryBudgetError, KernelBuildError; the renderer is gone then.
        """
        change, self._pending = self._pending, None
        try:
            if self.renderer is None:
                self.renderer = self.make(self.variant(scene))
            elif change is not None:
                self._update(self.renderer, scene, change)
        except BaseException:
            self.close()
            raise
        assert self.renderer is not None
        return self.renderer

    def _update(self, renderer: Renderer, scene: Scene, change: Change) -> None:
        if not change.whole:
            materials: dict[Any, Material] = {**change.materials}
            try:
                renderer.update(camera=change.camera, materials=materials or None)
                return
            except SceneError as error:
                if error.where != "materials":  # a material inside of another that was exchanged
                    raise
        variant = self.variant(scene)
        try:
            renderer.update(scene=variant)
        except SceneError as error:
            if error.where not in ("film", "film.layers"):
                raise
            self.close()  # another film, which a renderer cannot get
            self.renderer = self.make(variant)

    def cancel(self, discard: bool = False) -> None:
        """Let a run end soon; discard: its picture is of no use, and may be emptied."""
        if self.renderer is not None:
            self.renderer.cancel(discard=discard)

    def close(self) -> None:
        """Give the device's memory back."""
        if self.renderer is not None:
            self.renderer.close()
        self.renderer = self._pending = None


def smaller(divider: int) -> Variant:
    """Return what makes a scene's film smaller, so that it shows the same."""

    def variant(scene: Scene) -> Scene:
        film = scene.film
        width, height = (max(1, round(n / divider)) for n in (film.width, film.height))
        crop = film.crop
        if crop is not None:
            x, y = min(crop[0] // divider, width - 1), min(crop[1] // divider, height - 1)
            wide, high = (max(1, round(n / divider)) for n in crop[2:])
            crop = x, y, min(wide, width - x), min(high, height - y)
        small = dataclasses.replace(
            film, width=width, height=height, crop=crop, bands=0, time_bins=0
        )
        return dataclasses.replace(scene, film=small)

    return variant
