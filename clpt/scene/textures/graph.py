"""A texture that computes its value by a graph of nodes, which kernels have as generated text."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol, TypeAlias

import numpy as np

from clpt.arrays import LARGEST, Floats, is_number
from clpt.errors import SceneError
from clpt.scene.params import choice, host
from clpt.scene.textures.nodes import NODES, SOURCES, widened
from clpt.scene.values import Attributes, Look, Texture

TEXTURE = "texture"  # the kind of a node that looks up a texture of the graph
MOST_NODES = 1000
MOST_STOPS = 256
SECOND_UV = ("vertex_u1", "vertex_v1")  # the attributes of a mesh that `texcoord1` is
SIDE = 64  # places along u and v, for a mean
PLACES = np.random.default_rng(8).uniform(-2.0, 2.0, (SIDE**2, 3))  # in space, likewise

Operand: TypeAlias = Floats | int | str  # a constant (n,), the number of a step, or a source


class Sources(Protocol):
    """Values of sources and of textures, as `Graph.evaluated` asks for them."""

    def source(self, name: str) -> Floats:
        """Return a source (..., channels), see SOURCES."""

    def texture(self, number: int, uv: Floats | None, channels: int) -> Floats:
        """Return a texture of the graph (..., channels); uv: None for the surface's."""


@dataclass(frozen=True)
class Step:
    """A node with its inputs found.

    operands: by the names of inputs. settings: whole numbers by name. width: its channels. stops:
    the rows of a ramp (n, 5), None for other nodes.
    """

    kind: str
    operands: dict[str, Operand]
    settings: dict[str, int]
    width: int
    stops: Floats | None = None

    def computed(self, inputs: dict[str, Floats]) -> Floats:
        """Return the node's value (..., width); inputs: arrays (..., channels) by name."""
        return NODES[self.kind].evaluated(inputs, self.settings, self.width, self.stops)


@dataclass(frozen=True, kw_only=True, eq=False)
class Graph(Texture):
    """A value that nodes compute: patterns, arithmetic, ramps of colors, and other textures.

    A node is an object with a `type` and inputs. An input is a number, a list of up to four
    numbers, the name of another node, or `texcoord`, `texcoord1` or `position`: the surface's first
    and second uv, and the place in the world [m]. [Graphs](graphs.md) lists the nodes. Colors are
    linear Rec. 709; in spectral mode the result becomes a spectrum, as the texels of an image do.
    """

    nodes: Mapping[str, Mapping[str, Any]] = host(
        {"value": {"type": "convert"}}, "nodes by their names", form="nodes"
    )
    output: str = host("", "name of the node that is the value; by default the last one")
    textures: Sequence[Texture] = host(
        (), "textures that nodes of the type `texture` look up, by their places", form="textures"
    )
    channel: str = choice(
        "luminance",
        "of a color, where a number is asked for; `a` is the fourth",
        ("luminance", *"rgba"),
    )
    alpha = True

    def check(self) -> None:
        if not isinstance(self.nodes, Mapping) or not self.nodes:
            raise SceneError("must be nodes by their names", where="graph.nodes")
        if len(self.nodes) > MOST_NODES:
            raise SceneError(f"has more than {MOST_NODES} nodes", where="graph.nodes")
        if not all(isinstance(texture, Texture) for texture in self.textures):
            raise SceneError("must be textures", where="graph.textures")
        if any(t.combines or isinstance(t, Graph) for t in self.textures):
            message = "cannot be textures that combine others: nodes do that"
            raise SceneError(message, where="graph.textures")
        object.__setattr__(self, "textures", tuple(self.textures))
        _ = self._resolved  # raises for nodes that the value does not need, too

    @cached_property
    def _resolved(self) -> tuple[list[Step], Operand]:
        return _Resolver(self).resolve()

    @property
    def steps(self) -> list[Step]:
        """The nodes that vary, each after those that it reads."""
        return self._resolved[0]

    @property
    def result(self) -> Operand:
        """The operand that is the value."""
        return self._resolved[1]

    @property
    def width(self) -> int:
        """The channels of the value."""
        return width_of(self.result, self.steps)

    @cached_property
    def sources(self) -> set[str]:
        """The sources that the value depends on."""
        read = [operand for step in self.steps for operand in step.operands.values()]
        return {operand for operand in (*read, self.result) if isinstance(operand, str)}

    @property
    def attributes(self) -> tuple[str, ...]:  # type: ignore[override]
        return SECOND_UV if "texcoord1" in self.sources else ()

    def with_channel(self, channel: str) -> Graph:
        return dataclasses.replace(self, channel=channel)

    def evaluated(self, sources: Sources) -> Floats:
        """Return the value (..., channels) float64."""
        values: list[Floats] = []

        def value(operand: Operand) -> Floats:
            if isinstance(operand, int):
                return values[operand]
            return sources.source(operand) if isinstance(operand, str) else operand

        for step in self.steps:
            inputs = {name: value(operand) for name, operand in step.operands.items()}
            if step.kind == TEXTURE:
                uv = inputs.get("texcoord")
                uv = uv if uv is None else widened(uv, 2)
                values.append(sources.texture(step.settings["texture"], uv, step.width))
            else:
                values.append(step.computed(inputs))
        return value(self.result)

    def values_at(self, look: Look, uv: Floats) -> Floats:
        """Return the value at uv (m, k, 2), (m, k, channels); images are not averaged."""
        return self.evaluated(_OnSurface(self, look, uv, np.zeros(len(uv)), {}))

    def mean(self, look: Look) -> float:
        axis = (np.arange(SIDE) + 0.5) / SIDE
        uv = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(1, -1, 2)
        return float(self._brightness(look, uv, np.full(1, 1.0 / SIDE**2), {}).mean())

    def brightness_at(self, look: Look, uv: Floats, area: Floats, attributes: Attributes) -> Floats:
        if "position" in self.sources:  # which uv does not tell
            return np.full(uv.shape[:2], self.mean(look))
        return self._brightness(look, uv, area, attributes)

    def _brightness(self, look: Look, uv: Floats, area: Floats, given: Attributes) -> Floats:
        value = self.evaluated(_OnSurface(self, look, uv, area, given))
        light = np.maximum(np.nan_to_num(value[..., : 3 if self.width > 2 else 1]), 0.0)
        return np.broadcast_to(light.mean(axis=-1), uv.shape[:2]) * look.white

    def check_use(self, *, emissive: bool) -> None:
        for texture in self.textures:
            texture.check_use(emissive=False)


@dataclass(frozen=True)
class _OnSurface:
    """The sources of a graph at uv (m, k, 2) of faces with lookups of an area (m,)."""

    graph: Graph
    look: Look
    uv: Floats
    area: Floats
    attributes: Attributes

    def source(self, name: str) -> Floats:
        if name == "position":
            return np.resize(PLACES, (*self.uv.shape[:2], 3))
        if name == "texcoord1":
            found = [self.attributes.get(name) for name in SECOND_UV]
            if found[0] is not None and found[1] is not None:
                pair = np.concatenate([np.asarray(v, np.float64) for v in found], axis=-1)
                return np.broadcast_to(pair[:, None], (*self.uv.shape[:2], 2))
        return self.uv

    def texture(self, number: int, uv: Floats | None, channels: int) -> Floats:
        texture = self.graph.textures[number]
        at = self.uv if uv is None else np.broadcast_to(uv, self.uv.shape)
        found = [
            part.number_at(self.look, at, self.area, self.attributes)
            for part in parts_of(texture, channels)
        ]
        return np.stack(found, axis=-1)


def parts_of(texture: Texture, channels: int) -> list[Texture]:
    """Return textures of numbers: the texture itself, or its red, green, blue and alpha."""
    return [texture] if channels == 1 else [texture.with_channel(c) for c in "rgba"[:channels]]


def width_of(operand: Operand, steps: list[Step]) -> int:
    """Return the channels of an operand."""
    if isinstance(operand, int):
        return steps[operand].width
    return SOURCES[operand] if isinstance(operand, str) else len(operand)


class _Resolver:
    """Finds the inputs of nodes; what varies with nothing becomes a constant."""

    def __init__(self, graph: Graph):
        self.nodes, self.textures = graph.nodes, graph.textures
        self.output = graph.output or [*self.nodes][-1]
        self.steps: list[Step] = []
        self.found: dict[str, Operand] = {}

    def resolve(self) -> tuple[list[Step], Operand]:
        """Return the steps of the output, and its operand. Raises SceneError for any node."""
        needed = 0
        for name in self._in_order():
            self.found[name] = self._node(name)
            needed = len(self.steps) if name == self.output else needed
        return self.steps[:needed], self._operand(self.output, "graph.output")

    def _in_order(self) -> list[str]:
        """Return the names of nodes, each after those that it reads, the output's first.

        Raises SceneError.
        """
        if self.output not in {*self.nodes, *SOURCES}:
            raise SceneError(f"there is no node {self.output!r}", where="graph.output")
        ordered: dict[str, bool] = {}  # whether what a node reads comes before it already
        waiting = [*self.nodes, *([self.output] if self.output not in SOURCES else [])]
        while waiting:
            name = waiting[-1]
            if ordered.get(name):
                waiting.pop()
            elif name in ordered:
                ordered[name] = True
                ordered[name] = ordered.pop(name)  # to the end
                waiting.pop()
            else:
                ordered[name] = False
                for key, read in self._reads(name):
                    if read not in self.nodes:
                        raise SceneError(f"there is no node {read!r}", where=key)
                    if ordered.get(read) is False:
                        raise SceneError(f"the node {read!r} reads itself", where=key)
                    waiting.append(read)
        return [*ordered]

    def _reads(self, name: str) -> Iterator[tuple[str, str]]:
        node = self.nodes.get(name, {})
        for key, value in node.items() if isinstance(node, Mapping) else ():
            if key != "type" and isinstance(value, str) and value not in SOURCES:
                yield f"graph.nodes.{name}.{key}", value

    def _operand(self, value: object, where: str) -> Operand:
        """Return the operand of an input or of the output. Raises SceneError."""
        if isinstance(value, str):
            return value if value in SOURCES else self.found[value]
        numbers = value.tolist() if isinstance(value, np.ndarray) else value
        numbers = numbers if isinstance(numbers, (list, tuple)) else [numbers]
        finite = [float(v) for v in numbers if is_number(v) and abs(v) <= LARGEST]
        if not 1 <= len(finite) == len(numbers) <= 4:
            message = "must be up to four numbers within float32, or a node's name"
            raise SceneError(message, where=where)
        return np.array(finite, np.float64)

    def _node(self, name: str) -> Operand:
        """Return a node's constant, or the number of its step."""
        node, where = self.nodes[name], f"graph.nodes.{name}"
        kind = node.get("type") if isinstance(node, Mapping) else None
        if kind == TEXTURE:
            return self._texture(node, where)
        if kind not in NODES:
            known = ", ".join([*NODES, TEXTURE])
            raise SceneError(f"{kind!r} is no type of node; known are {known}", where=where)
        declared = NODES[kind]
        stops = _stops(node, where) if kind == "ramp" else None
        _check_keys(node, (*declared.inputs, *declared.settings, *STOPS.get(kind, ())), where)
        operands = {
            key: self._operand(node.get(key, default), f"{where}.{key}")
            for key, default in declared.inputs.items()
        }
        settings = _settings(node, declared.settings, where)
        widths = {key: width_of(operand, self.steps) for key, operand in operands.items()}
        try:
            width = declared.width_of(widths, settings)
        except SceneError as error:
            raise SceneError(error.message, where=where) from None
        constants = {k: v for k, v in operands.items() if isinstance(v, np.ndarray)}
        step = Step(kind, operands, settings, width, stops)
        if len(constants) == len(operands):
            return np.clip(np.nan_to_num(step.computed(constants)), -LARGEST, LARGEST)
        return self._appended(step)

    def _appended(self, step: Step) -> int:
        self.steps.append(step)
        return len(self.steps) - 1

    def _texture(self, node: Mapping[str, Any], where: str) -> int:
        limits = {"texture": (0, 0, len(self.textures) - 1), "channels": (3, 1, 4)}
        _check_keys(node, ("texcoord", *limits), where)
        settings = _settings(node, limits, where)
        at = node.get("texcoord", "texcoord")
        operands = {} if at == "texcoord" else {"texcoord": self._operand(at, f"{where}.texcoord")}
        width, texture = settings.pop("channels"), self.textures[settings["texture"]]
        if width == 4 and not texture.alpha:
            raise SceneError("only images have four channels", where=where)
        return self._appended(Step(TEXTURE, operands, settings, width))


STOPS = {"ramp": ("stops",)}  # keys that are no inputs


def _check_keys(node: Mapping[str, Any], known: tuple[str, ...], where: str) -> None:
    for key in node:
        if key not in ("type", *known):
            raise SceneError(f"the node has no {key!r}, but {', '.join(known)}", where=where)


def _settings(
    node: Mapping[str, Any], declared: Mapping[str, tuple[int, int, int]], where: str
) -> dict[str, int]:
    """Return whole numbers by name; declared: their default, least and most. Raises SceneError."""
    found = {}
    for key, (default, least, most) in declared.items():
        value = node.get(key, default)
        if not is_number(value) or value not in range(least, most + 1):
            message = f"must be a whole number {least} to {most}, not {value!r}"
            raise SceneError(message, where=f"{where}.{key}")
        found[key] = int(value)
    return found


def _stops(node: Mapping[str, Any], where: str) -> Floats:
    """Return the stops of a ramp (n, 5): positions that rise, and colors. Raises SceneError."""
    where = f"{where}.stops"
    try:
        rows = np.asarray(node.get("stops", ((0.0, 0.0), (1.0, 1.0))), np.float64)
    except (TypeError, ValueError):
        rows = np.empty(0)
    if rows.ndim != 2 or not 2 <= len(rows) <= MOST_STOPS or rows.shape[1] not in (2, 4, 5):
        message = "must be rows of a position and 1, 3 or 4 numbers, two rows at least"
        raise SceneError(message, where=where)
    if not (np.abs(rows) <= LARGEST).all() or (np.diff(rows[:, 0]) < 0.0).any():
        raise SceneError("must be finite, and positions cannot fall", where=where)
    colors = rows[:, 1:]
    colors = np.repeat(colors, 3, axis=1) if colors.shape[1] == 1 else colors
    alpha = np.ones((len(rows), 1)) if colors.shape[1] == 3 else colors[:, 3:]
    return np.concatenate([rows[:, :1], colors[:, :3], alpha], axis=1)
