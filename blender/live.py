# SPDX-License-Identifier: GPL-3.0-or-later
"""The live film of a viewport, in the process beside Blender: changes are updates, not loads."""

from __future__ import annotations

import dataclasses
import functools
import json
import time
from contextlib import suppress
from pathlib import Path
from queue import Empty
from typing import TYPE_CHECKING, Any

import bake
import numpy as np
import rendering

import clpt
from clpt.formats.native import read
from clpt.scene import Film, Scene, integrators, shapes
from clpt.scene.params import fields_of
from clpt.view.target import smaller

if TYPE_CHECKING:
    from worker import Link

DIVIDERS = (1, 2, 4, 8)  # of pictures while something moves
SLOW, FAST = 0.08, 0.02  # [s] of such a picture: the next ones are coarser, or finer
CANCEL_SECONDS = 0.05  # a pass ends within them when something moves
REST = 0.1  # [s] without a change until the whole picture begins
WAIT = 0.01  # [s] between looks whether a picture was taken
SHARE = 0.1  # of the time, for sending pictures that get better
DENOISED_FROM = 8  # samples
PLACE = "to_world"


class Parts:
    """Makes scenes of descriptions; what is described alike in two of them is the same object."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.known: dict[tuple[str, ...], Any] = {}

    def scene(self, described: dict[str, Any], film: Film) -> Scene:
        """Return a scene; only what no scene before had is read."""
        needed: dict[tuple[str, ...], Any] = {}
        self._read(described, needed)
        dressed: dict[tuple[str, ...], Any] = {}
        media = described["media"]

        def once(key: tuple[str, ...], make: Any) -> Any:
            if key not in dressed:
                dressed[key] = self.known[key] if key in self.known else make()
            return dressed[key]

        def dress(entry: dict[str, Any]) -> tuple[tuple[str, ...], Any]:
            """Return the shape with its material and light, in its own space, and its key."""
            bare, name, glow = _bare(entry), entry.get("material"), entry.get("emission")
            keys = [_key("shape", [bare, media.get(bare.get("interior"))])]
            changes: dict[str, Any] = {}
            if name is not None:
                keys.append(_key("material", [name, described["materials"][name]]))
                changes["material"] = needed[keys[-1]]
            if glow is not None:
                keys.append(_key("light", glow))
                changes["emission"] = needed[keys[-1]]
            key = tuple(text for parts in keys for text in parts)
            return key, once(key, lambda: dataclasses.replace(needed[keys[0]], **changes))

        groups: dict[str, tuple[tuple[str, ...], Any]] = {}
        for name, entries in described["groups"].items():
            members = [dress(entry) for entry in entries]
            key = ("group", *(text for keys, _ in members for text in keys))
            content = tuple(member for _, member in members)
            groups[name] = key, once(key, lambda c=content, n=name: shapes.Group(c, n))

        def place(entry: dict[str, Any]) -> Any:
            if entry["type"] == "instance":
                inner, group = groups[entry["group"]]
                name = entry.get("name", "")
                key = ("instance", name, *inner)
                shape = once(key, lambda: shapes.Instance(group=group, name=name))
            else:
                key, shape = dress(entry)
            where = entry.get(PLACE)
            if where is None:
                return shape
            return once((*key, *_key("at", where)), lambda: shape.placed(where))

        placed = [place(entry) for entry in described["shapes"]]
        lights = [needed[_key("lamp", entry)] for entry in described["lights"]]
        self.known = {**needed, **dressed}
        return Scene(
            camera=self.camera(described["camera"]), shapes=placed, lights=lights, film=film,
            integrator=self.integrator(described["integrator"]["max_depth"]),
        )  # fmt: skip

    @staticmethod
    @functools.cache
    def integrator(max_depth: int) -> integrators.Path:
        """Return the same integrator for the same depth."""
        return integrators.Path(max_depth=max_depth, light_paths=0)

    def camera(self, described: dict[str, Any]) -> Any:
        """Return a camera."""
        return read.from_json({"version": 2, "camera": described}, self.folder).camera

    def _read(self, described: dict[str, Any], needed: dict[tuple[str, ...], Any]) -> None:
        """Bring the materials, shapes and lights of a description, which are known or read."""
        entries = [*described["shapes"], *(e for g in described["groups"].values() for e in g)]
        entries = [entry for entry in entries if entry["type"] != "instance"]
        media = described["media"]
        wanted: dict[str, dict[tuple[str, ...], Any]] = {
            "material": {_key("material", [n, m]): n for n, m in described["materials"].items()},
            "shape": {
                _key("shape", [e, media.get(e.get("interior"))]): e for e in map(_bare, entries)
            },
            "light": {_key("light", glow): glow for e in entries if (glow := e.get("emission"))},
            "lamp": {_key("lamp", entry): entry for entry in described["lights"]},
        }  # fmt: skip
        fresh = {
            kind: {key: value for key, value in table.items() if key not in self.known}
            for kind, table in wanted.items()
        }
        carriers = [{"type": "sphere", "emission": glow} for glow in fresh["light"].values()]
        carriers += [{"type": "sphere", "material": name} for name in fresh["material"].values()]
        loaded = read.from_json(
            {
                "version": 2, "camera": {"type": "perspective"},
                "materials": described["materials"] if fresh["material"] else {},
                "media": described["media"],
                "shapes": [*fresh["shape"].values(), *carriers],
                "lights": list(fresh["lamp"].values()),
            },
            self.folder, rendering.GREY,
        )  # fmt: skip
        for table in wanted.values():
            needed.update({key: self.known[key] for key in table if key in self.known})
        made = iter(loaded.shapes)
        needed.update(zip(fresh["shape"], made, strict=False))
        needed.update({key: next(made).emission for key in fresh["light"]})
        needed.update({key: next(made).material for key in fresh["material"]})
        needed.update(zip(fresh["lamp"], loaded.lights, strict=True))


def _key(kind: str, value: Any) -> tuple[str, ...]:
    return kind, json.dumps(value)


def _bare(entry: dict[str, Any]) -> dict[str, Any]:
    """Return a shape without its place, material and light."""
    return {k: v for k, v in entry.items() if k not in (PLACE, "material", "emission")}


class Follower:
    """A renderer that follows the scene, as a picture of a part of its size."""

    def __init__(self, divider: int):
        self.divider = divider
        self.renderer: clpt.Renderer | None = None
        self.scene: Scene | None = None

    def follow(
        self, scene: Scene, beside: clpt.Renderer | None, denoise: str | None = None
    ) -> clpt.Renderer:
        """Return the renderer of a scene; its film is empty if the scene is another one.

        beside: a renderer that may have parts of the scene; denoise: how finished pictures are
        denoised. After an error there is no renderer.
        """
        former, self.scene = self.scene, scene
        if scene is former and self.renderer is not None:
            return self.renderer
        small = smaller(self.divider)(scene)
        try:
            if self.renderer is None or former is None or former.film is not scene.film:
                self.close()
                self.scene = scene
                self.renderer = clpt.Renderer(
                    small, beside=beside, cancel_seconds=CANCEL_SECONDS, programs="shared",
                    denoise=denoise,
                )  # fmt: skip
            else:
                self.renderer.update(**(_edits(former, scene) or {"scene": small}))
        except BaseException:
            self.close()
            raise
        return self.renderer

    def close(self) -> None:
        """Give the device's memory back."""
        if self.renderer is not None:
            self.renderer.close()
        self.renderer = self.scene = None


def _edits(former: Scene, scene: Scene) -> dict[str, Any] | None:
    """Return the arguments of an update from a scene to another; None if more than these differ."""
    places: dict[int, Any] = {}
    materials: dict[Any, Any] = {}
    alike = former.integrator is scene.integrator and _same(former.lights, scene.lights)
    if not alike or len(former.shapes) != len(scene.shapes):
        return None
    for number, (old, new) in enumerate(zip(former.shapes, scene.shapes, strict=True)):
        if old is new:
            continue
        if old.to_world is not new.to_world and not np.array_equal(old.to_world, new.to_world):
            places[number] = new.to_world
        if len(old.members) != len(new.members):
            return None
        for was, now in zip(old.members, new.members, strict=True):
            if was is now:
                continue
            is_old, is_new = fields_of(was), fields_of(now)
            if type(was) is not type(now) or any(
                is_old[name] is not is_new[name]
                for name in is_old
                if name not in (PLACE, "material", "group")
            ):
                return None
            if materials.setdefault(was.material, now.material) is not now.material:
                return None
    edits = {"transforms": places, "materials": {k: v for k, v in materials.items() if k is not v}}
    edits = {name: values for name, values in edits.items() if values}
    return (
        {**edits, "camera": scene.camera}
        if scene.camera is not former.camera or not edits
        else edits
    )


def _linear(renderer: clpt.Renderer) -> np.ndarray:
    """Return the picture so far as Blender has it: (h, w, 4) float32, the bottom row first."""
    if renderer.denoise is not None and renderer.samples >= DENOISED_FROM:
        return rendering.pixels(clpt.DenoisedPicture(renderer).picture())
    if renderer.scene.film.alpha:
        return rendering.pixels(renderer.image())
    picture = np.ascontiguousarray(renderer.film.get()[::-1])
    picture[..., 3] = 1.0
    return picture


def _covered(film: Film) -> dict[str, list[float]]:
    """Return the lower left corner and the extent of a film's part, as shares of its picture."""
    x, y, width, height = film.crop or (0, 0, film.width, film.height)
    return {
        "corner": [x / film.width, 1.0 - (y + height) / film.height],
        "extent": [width / film.width, height / film.height],
    }


def _same(some: list[Any], others: list[Any]) -> bool:
    return len(some) == len(others) and all(a is b for a, b in zip(some, others, strict=True))


class Live:
    """Renders what a viewport shows until Blender says stop.

    settings: folder of the files. Messages of Blender: `scene`, a description with `settings`, mode
    and samples; `camera`; `size` of the picture; `stop`.
    """

    def __init__(self, link: Link, settings: dict[str, Any]):
        self.link = link
        self.parts = Parts(Path(settings["folder"]))
        self.settings: dict[str, Any] = {}
        self.whole, self.moving = Follower(1), Follower(4)
        self.described: dict[str, Any] = {}
        self.scene: Scene | None = None
        self.film, self.film_key, self.size = Film(), "", [1, 1]
        self.crop: list[int] | None = None
        self.serial = 0  # of the newest message that changes the picture
        self.is_new = self.moves = False
        self.sent = self.cost = 0.0

    def go(self) -> None:
        """Follow messages until one says stop."""
        try:
            while self._take():
                try:
                    self._work()
                except Exception as error:  # the next change may mend it
                    self._fail(error)
        finally:
            self.moving.close()
            self.whole.close()
        self.link.send({"done": True})

    @property
    def _wants(self) -> bool:
        """Whether there is something to do without another message."""
        if self.scene is None:
            return False
        renderer = self.whole.renderer
        if self.moves or renderer is None or self.whole.scene is not self.scene:
            return True
        return renderer.samples < self.settings["samples"]

    def _take(self) -> bool:
        """Take all messages, wait for one where there is nothing to do; return whether to go on."""
        changes: dict[str, Any] = {}
        inbox = self.link.inbox
        while not (changes or self._wants or (self.is_new and self.link.is_seen)):
            with suppress(Empty):
                changes |= inbox.get(timeout=WAIT if self.is_new else None)
        while not inbox.empty():
            changes |= inbox.get()
        if "stop" in changes:
            return False
        if changes:
            self._change(changes)
        return True

    def _change(self, changes: dict[str, Any]) -> None:
        self.serial = changes.get("serial", self.serial)
        if "scene" in changes:
            self.described = {**changes["scene"], "camera": self.described.get("camera")}
            self.settings = changes["scene"]["settings"]
            lights = bake.lights(self.described["lights"], self.parts.folder)
            self.described["lights"] = lights
        if "camera" in changes:
            self.described["camera"] = changes["camera"]
        self.size, self.crop = changes.get("size", self.size), changes.get("crop", self.crop)
        if self.described.get("camera") is None or "shapes" not in self.described:
            return
        try:
            self.film = self._film()
            if self.scene is None or "scene" in changes:
                self.scene = self.parts.scene(self.described, self.film)
            else:
                camera = self.parts.camera(self.described["camera"])
                self.scene = dataclasses.replace(self.scene, camera=camera, film=self.film)
        except Exception as error:
            self._fail(error)
            return
        self.moves, self.is_new = True, False

    def _film(self) -> Film:
        """Return the film; the same object as before where nothing of it differs."""
        mode, denoise = self.settings["mode"], self.settings["denoise"]
        key = json.dumps([self.described["film"], self.size, self.crop, mode, denoise])
        if key == self.film_key:
            return self.film
        content = {"version": 2, "camera": self.described["camera"], "film": self.described["film"]}
        film = read.from_json(content, self.parts.folder).film
        width, height = self.size
        crop = None if self.crop is None else tuple(self.crop)
        self.film_key = key
        return dataclasses.replace(film, width=width, height=height, mode=mode, crop=crop)

    def _fail(self, error: Exception) -> None:
        self.scene = None
        line = (str(error).splitlines() or [type(error).__name__])[0]
        self.link.send({"fault": line, "serial": self.serial})

    def _work(self) -> None:
        """Make the next picture: a coarse one after a change, then the whole one."""
        if self.scene is None:
            return
        follower = self.moving if self.moves and self.moving.divider > 1 else self.whole
        if not self.moves and self.whole.scene is not self.scene and self._hears(REST):
            return
        if self.moves or self.whole.scene is not self.scene:
            began, was = time.perf_counter(), follower.renderer
            other = self.whole if follower is self.moving else self.moving
            renderer = self._follow(follower, other.renderer)
            renderer.run(1)
            self.is_new = True
            self._send(renderer, follower.divider)
            if self.moves and was is follower.renderer:
                self._adapt(time.perf_counter() - began)
            self.moves = False
            return
        renderer = self._follow(self.whole, None)
        left = self.settings["samples"] - renderer.samples
        if left > 0:
            renderer.run(min(left, max(1, renderer.samples)), lambda _: self.link.inbox.empty())
            self.is_new = True
        if time.perf_counter() - self.sent > self.cost / SHARE or left <= 0:
            self._send(renderer, 1)

    def _follow(self, follower: Follower, beside: clpt.Renderer | None) -> clpt.Renderer:
        """Return the renderer of the present scene; whole pictures may be denoised."""
        assert self.scene is not None
        denoise = self.settings["denoise"] and follower is self.whole
        return follower.follow(self.scene, beside, rendering.denoiser() if denoise else None)

    def _hears(self, seconds: float) -> bool:
        """Return whether a message comes within some time."""
        end = time.perf_counter() + seconds
        while self.link.inbox.empty() and time.perf_counter() < end:
            time.sleep(0.1 * seconds)
        return not self.link.inbox.empty()

    def _adapt(self, took: float) -> None:
        """Let the next pictures of movement be coarser or finer."""
        place = DIVIDERS.index(self.moving.divider)
        if took > SLOW:
            place = min(place + 1, len(DIVIDERS) - 1)
        elif took < FAST:
            place = max(place - 1, 0)
        if DIVIDERS[place] != self.moving.divider:
            self.moving.close()
            self.moving = Follower(DIVIDERS[place])

    def _send(self, renderer: clpt.Renderer, divider: int) -> None:
        """Send the picture, if Blender has taken the one before."""
        if not self.link.is_seen:
            return
        self.link.is_seen = False
        began = time.perf_counter()
        picture = _linear(renderer)
        message = {
            "samples": renderer.samples if divider == 1 else 0, "divider": divider,
            "size": [picture.shape[1], picture.shape[0]], "serial": self.serial,
            **_covered(renderer.scene.film),
        }  # fmt: skip
        self.link.send(message, picture)
        self.sent = time.perf_counter()
        self.cost, self.is_new = self.sent - began, False
