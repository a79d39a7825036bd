"""Graphs of nodes: each node of the table in kernels against the same graph in float64."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clpt import spectra
from clpt.errors import SceneError
from clpt.render.materials.encoder import Encoder
from clpt.scene.roles import NAMED, Param
from clpt.scene.textures import Bitmap, Checkerboard, Graph, Marble, MeshAttribute, Mix, Product
from clpt.scene.textures.nodes import NODES, NodeKind
from clpt.spectra import upsampling
from clpt.spectra.spectrum import d65
from tests.kernels.test_solid_textures import LAMBDAS, look_up

COUNT = 40  # places of each graph
LEAPS = {  # values that jump: a place beside a jump may come out at the other side
    "floor", "ceil", "round", "fract", "sign", "modulo", "ifgreater", "ifgreatereq", "splitlr",
    "splittb", "tan", "dodge", "burn", "divide", "remap", "smoothstep", "power",
}  # fmt: skip
MOVED = {  # inputs of width 3, by their numbers, from places in space
    "a": {"type": "multiply", "in1": "position", "in2": (0.31, -0.17, 0.23)},
    "b": {"type": "subtract", "in1": 0.7, "in2": "a"},
    "c": {"type": "rotate3d", "in": "b", "amount": 50.0, "axis": (1.0, 2.0, 0.5)},
    "d": {"type": "absval", "in": "c"},
    "e": {"type": "add", "in1": "d", "in2": 0.25},
}
NAMES = (*MOVED,)


class Surface:
    """The sources of a graph at places (n, 3); u and v are x and y."""

    def __init__(self, places: np.ndarray):
        self.places = places.astype(np.float64)

    def source(self, name: str) -> np.ndarray:
        return self.places if name == "position" else self.places[:, :2]

    def texture(self, number: int, uv: np.ndarray | None, channels: int) -> np.ndarray:
        raise NotImplementedError


def graph_of(kind: str, declared: NodeKind, width: int, **settings: int) -> Graph:
    """A node whose inputs vary, each with so many channels."""
    nodes: dict[str, Any] = {**MOVED}
    node: dict[str, Any] = {"type": kind, **settings}
    for name, key in zip(NAMES, declared.inputs, strict=False):
        nodes[f"{name}{width}"] = {"type": "convert", "in": name, "channels": width}
        node[key] = f"{name}{width}" if key not in ("octaves", "pivot", "exponent") else 2.0
    if kind == "whitenoise":  # of bits: of what has no rounding
        nodes["whole"] = {"type": "floor", "in": node["in"]}
        node["in"] = "whole"
    return Graph(nodes={**nodes, "node": node}, channel="r")


def every_node() -> list[tuple[str, Graph]]:
    found = []
    for kind, declared in NODES.items():
        for width in (1, 3) if not kind.startswith("combine") else (1,):
            found.append((kind, graph_of(kind, declared, width)))
        for key, (_, least, most) in declared.settings.items():
            for value in range(least, most + 1):
                more = {"style": 0} if key == "channels" and "style" in declared.settings else {}
                found.append((kind, graph_of(kind, declared, 3, **{key: value}, **more)))
    return found


PLACES = np.random.default_rng(5).uniform(-6.0, 6.0, (COUNT, 3)).astype(np.float32)


@pytest.mark.parametrize("lanes", [1, 8])
def test_every_node_is_as_in_float64(lanes: int) -> None:
    made = every_node()
    assert {kind for kind, _ in made} == set(NODES)
    places = np.repeat(PLACES, len(made), axis=0)
    found = look_up([graph for _, graph in made], "factor", places, lanes=lanes)
    wrong = []
    for i, (kind, graph) in enumerate(made):
        value = graph.evaluated(Surface(PLACES))
        wide = np.repeat(value, 3, axis=1) if graph.width == 1 else value
        expected = np.maximum(np.pad(wide, ((0, 0), (0, 1)))[:, :3], 0.0)
        off = np.abs(found[i :: len(made)] - expected)
        bad = (off > 2e-5 + 1e-4 * np.abs(expected)).any(axis=1).mean()
        if bad > (0.05 if kind in LEAPS else 0.0):
            wrong.append((kind, graph.width, graph.nodes["node"], round(bad, 2), off.max()))
    assert not wrong


NOISY = {
    "n": {"type": "noise2d", "channels": 3, "amplitude": 1.3, "pivot": 0.5},
    "node": {"type": "clamp", "in": "n"},
}
COLORS = Graph(nodes=NOISY)


@pytest.mark.parametrize("role", ["reflectance", "emission"])
def test_spectra_of_colors_are_those_of_texels(role: str) -> None:
    """Greys, dark and saturated colors, and beyond 1 where light may be."""
    scale = 3.0 if role == "emission" else 1.0
    graph = Graph(nodes={**NOISY, "bright": {"type": "multiply", "in1": "node", "in2": scale}})
    found = look_up([graph], role, PLACES, "spectral")
    rgb = graph.evaluated(Surface(PLACES))
    if role == "reflectance":
        expected = upsampling.evaluate(spectra.uplift(rgb), np.array(LAMBDAS))
    else:
        size, shape = spectra.unbounded(rgb)
        expected = size[:, None] * upsampling.evaluate(shape, np.array(LAMBDAS))
        expected *= d65().sample(np.array(LAMBDAS))
    assert np.ptp(rgb) > 0.9 * scale
    np.testing.assert_allclose(found, expected, atol=2e-4 * max(1.0, expected.max()))


def test_a_number_is_a_channel_or_the_luminance() -> None:
    rgb = COLORS.evaluated(Surface(PLACES))
    for channel, expected in (
        ("luminance", rgb @ [0.2126, 0.7152, 0.0722]),
        ("g", rgb[:, 1]),
    ):
        found = look_up([COLORS.with_channel(channel)], "real", PLACES)
        np.testing.assert_allclose(found, expected, atol=1e-5)


IMAGE = np.random.default_rng(2).random((4, 6, 4)).astype(np.float32)


@pytest.mark.parametrize("mode", ["rgb", "spectral"])
def test_textures_within_a_graph(mode: str) -> None:
    """An image where noise bends it beside one in its own place, in both modes, by its channels."""
    nodes = {
        "place": {"type": "place2d", "scale": 2.0, "rotate": 30.0},
        "a": {"type": "texture", "texcoord": "place", "channels": 4},
        "b": {"type": "texture", "texture": 1},
        "alpha": {"type": "extract", "in": "a", "index": 3},
        "rgb": {"type": "convert", "in": "a", "channels": 3},
        "node": {"type": "mix", "fg": "rgb", "bg": "b", "mix": "alpha"},
    }
    image = Bitmap(image=IMAGE, raw=True, filter="nearest")
    board = Checkerboard(color0=(0.9, 0.2, 0.1), color1=0.3)
    graph = Graph(nodes=nodes, textures=[image, board])

    class Images(Surface):
        def texture(self, number: int, uv: np.ndarray | None, channels: int) -> np.ndarray:
            at = (self.source("texcoord") if uv is None else uv) % 1.0
            if number == 1:
                same = (at[:, :1] > 0.5) == (at[:, 1:] > 0.5)
                return np.where(same, [0.9, 0.2, 0.1], 0.3)
            columns, rows = (at * [6, 4]).astype(int).T
            return IMAGE[3 - rows, columns].astype(np.float64)

    expected = graph.evaluated(Images(PLACES))
    for i, channel in enumerate("rgb"):
        found = look_up([graph.with_channel(channel)], "real", PLACES, mode)
        np.testing.assert_allclose(found, expected[:, i], atol=1e-5)


def test_graphs_that_differ_by_numbers_share_a_function() -> None:
    def graph(scale: float, stops: list[list[float]], image: np.ndarray) -> Graph:
        nodes = {
            "fine": {"type": "multiply", "in1": "position", "in2": scale},
            "n": {"type": "noise3d", "position": "fine"},
            "ramp": {"type": "ramp", "in": "n", "stops": stops},
            "image": {"type": "texture"},
            "node": {"type": "multiply", "in1": "ramp", "in2": "image"},
        }
        nodes["image"]["channels"] = 4
        return Graph(nodes=nodes, textures=[Bitmap(image=image)])

    encoder = Encoder("rgb")
    made = [
        graph(4.0, [[0, 0], [1, 1]], IMAGE),
        graph(7.0, [[-1, 1, 0, 0], [0, 0, 1, 0], [1, 0, 0, 1]], IMAGE[:2]),
    ]
    for texture in made:
        encoder.param_words(texture, Param(NAMED["reflectance"]))
    assert len(encoder.textures.features().graphs) == 1
    last = {"node": {"type": "max", "in1": "ramp"}}
    other = Graph(nodes={**made[0].nodes, **last}, textures=made[0].textures)
    encoder.param_words(other, Param(NAMED["reflectance"]))
    assert len(encoder.textures.features().graphs) == 2


def test_what_varies_with_nothing_is_computed_before() -> None:
    nodes = {
        "a": {"type": "add", "in1": (0.1, 0.2, 0.3), "in2": 0.5},
        "b": {"type": "rgbtohsv", "in": "a"},
        "c": {"type": "mix", "fg": "b", "bg": "position", "mix": 0.0},
    }
    assert Graph(nodes=nodes, output="b").steps == []
    found = look_up([Graph(nodes=nodes, output="a")], "reflectance", PLACES[:2])
    np.testing.assert_allclose(found, [[0.6, 0.7, 0.8]] * 2, rtol=1e-6)


NODE = {"type": "add", "in1": "position"}
WRONG: list[tuple[dict[str, Any], str]] = [
    ({"nodes": {}}, "by their names"),
    ({"nodes": {"a": {"type": "paint"}}}, "no type of node"),
    ({"nodes": {"a": {"type": "add", "in3": 1.0}}}, "no 'in3', but in1, in2"),
    ({"nodes": {"a": {"type": "add", "in1": "b"}}}, "no node 'b'"),
    ({"nodes": {"a": {"type": "add", "in1": "a"}}}, "reads itself"),
    ({"nodes": {"a": {"type": "sin", "in": "b"}, "b": {"type": "sin", "in": "a"}}}, "reads itself"),
    ({"nodes": {"a": {"type": "add", "in1": [1.0] * 5}}}, "up to four numbers"),
    ({"nodes": {"a": {"type": "add", "in1": float("nan")}}}, "up to four numbers"),
    ({"nodes": {"b": {"type": "paint"}, "a": NODE}}, "no type of node"),
    ({"nodes": {"a": {"type": "add", "in1": 1e39}}}, "within float32"),
    ({"nodes": {"a": {"type": "add", "in1": True}}}, "up to four numbers"),
    ({"nodes": {"a": {"type": "add", "in1": "position", "in2": "texcoord"}}}, "2 and 3 channels"),
    (
        {"nodes": {"a": {"type": "combine2", "in1": "position", "in2": "position"}}},
        "more than four",
    ),
    ({"nodes": {"a": {"type": "extract", "in": "position", "index": 4}}}, "0 to 3"),
    ({"nodes": {"a": {"type": "noise3d", "channels": 1.5}}}, "1 to 4"),
    ({"nodes": {"a": {"type": "ramp", "stops": [[0, 1]]}}}, "two rows"),
    ({"nodes": {"a": {"type": "ramp", "stops": [[1, 1], [0, 1]]}}}, "cannot fall"),
    ({"nodes": {"a": {"type": "texture"}}}, "0 to -1"),
    ({"nodes": {"a": NODE}, "output": "b"}, "no node 'b'"),
    ({"nodes": {"a": NODE}, "textures": [0.5]}, "must be textures"),
    ({"nodes": {"a": NODE}, "textures": [Mix()]}, "combine others"),
    ({"nodes": {"a": NODE}, "textures": [Graph()]}, "combine others"),
    ({"nodes": {"a": {"type": "texture", "channels": 4}}, "textures": [Marble()]}, "four channels"),
    ({"nodes": {str(i): NODE for i in range(1001)}}, "more than 1000"),
]


@pytest.mark.parametrize(("given", "message"), WRONG, ids=[row[1] for row in WRONG])
def test_wrong_graphs(given: dict[str, Any], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        Graph(**given)


def test_a_graph_reads_what_meshes_say() -> None:
    graph = Graph(
        nodes={
            "a": {"type": "texture"},
            "b": {"type": "extract", "in": "texcoord1", "index": 1},
            "c": {"type": "multiply", "in1": "a", "in2": "b"},
        },
        textures=[MeshAttribute()],
    )
    assert graph.attributes == ("vertex_u1", "vertex_v1") and graph.sources == {"texcoord1"}
    assert Product(first=graph, second=2.0).folded(NAMED["reflectance"]).first is graph
