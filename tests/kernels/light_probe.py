"""Kernel functions of lights and shapes on arrays, with the tables of a scene behind them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
import pyopencl as cl

from clpt import device
from clpt.geometry import analytic, shapes, triangles
from clpt.records import SETTINGS, SHAPE
from clpt.render.flow.flags import scene_text
from clpt.render.geometry import cases as shape_text
from clpt.render.lights import cases as light_dispatch
from clpt.render.lights import encode as lights
from clpt.render.lights import find as sources
from clpt.render.materials import cases as parameters
from clpt.render.materials.encoder import Encoder
from clpt.render.records import Features, MaterialFeatures
from clpt.render.spectra.encode import STEP
from clpt.render.textures import cases as texture_text
from tests.kernels.harness import opened
from tests.kernels.scene_harness import PLAIN

LAMBDAS = (450.0, 520.0, 580.0, 640.0)  # of the spectral mode's probes [nm]
INCLUDES = ("core/base.cl", "shapes/shape.cl", "lights/light.cl", "generated/lights.cl")


@dataclass
class Lit:
    """A scene of lights alone: its tables, and what `light_rows` gave."""

    encoder: Encoder
    rows: lights.LightRows
    files: tuple[str, ...] = ()
    radius: float = 1.0
    gloss: bool = False
    buffers: dict[str, Any] = field(default_factory=dict)

    def __call__(self, body: str, given: np.ndarray, results: int, lanes: int = 8) -> np.ndarray:
        """Run `body`, which sets r[0..results) from x[0..k), on given (k, n): (results, n)."""
        n = given.shape[1]
        padded = -(-n // 16) * 16
        data = np.concatenate([given, np.repeat(given[:, -1:], padded - n, axis=1)], axis=1)
        data = np.ascontiguousarray(data, np.float32)
        out = np.empty((results, padded), np.float32)
        dev, flags = opened(), cl.mem_flags
        if not self.buffers:
            arrays = {**self.encoder.store.arrays(), "settings": self._settings()}
            self.buffers = {name: self._buffer(values) for name, values in arrays.items()}
        program = _program(
            self.encoder.spectra.mode,
            self._text(),
            body,
            given.shape[0],
            results,
            self.files,
            lanes,
        )
        target = cl.Buffer(dev.context, flags.WRITE_ONLY, out.nbytes)
        there = {"in": self._buffer(data), "out": target, "n": padded, **self.buffers}
        kernel = program.kernel("probe")
        kernel.bind(**there).enqueue(dev.queue, (padded // lanes,), (1,))
        cl.enqueue_copy(dev.queue, out, target)
        return out[:, :n]

    def _text(self) -> str:
        """The lights' functions, with the look-ups of textures where there are any."""
        encoder, sources = self.encoder, self.encoder.sources
        found, factors = (
            frozenset(source for kind, _, source in sources if kind == wanted)
            for wanted in ("emission", "factor")
        )
        found = found or frozenset({"constant"})
        text = ""
        if encoder.textures.roles:
            text += texture_text.dispatch_text(encoder.textures.features())
        text += parameters.emission_text(found)
        if factors:
            text += parameters.factor_text(factors)
        features = Features(
            lights=self.rows.features(int(self.gloss)),
            materials=MaterialFeatures(sources=encoder.sources),
        )
        return text + light_dispatch.dispatch_text(features)

    def _settings(self) -> np.ndarray:
        settings = np.zeros(1, SETTINGS.dtype)
        settings["light_count"] = len(self.rows.rows)
        settings["infinite_count"] = self.rows.sources.infinite
        settings["lambda_min"], settings["lambda_max"] = 360.0, 830.0
        settings["scene_radius"] = self.radius
        return settings

    def _buffer(self, values: np.ndarray) -> cl.Buffer:
        flags = cl.mem_flags
        return cl.Buffer(
            opened().context, flags.READ_ONLY | flags.COPY_HOST_PTR, hostbuf=values.reshape(-1)
        )


@cache
def _program(
    mode: str, light_text: str, body: str, arguments: int, results: int, files: tuple, lanes: int
) -> device.Program:
    reads = "".join(f"    x[{i}] = block_load(in + {i} * n + at);\n" for i in range(arguments))
    writes = "".join(f"    block_store(out + {i} * n + at, r[{i}]);\n" for i in range(results))
    nm = ", ".join(f"{v}f" for v in (LAMBDAS if mode == "spectral" else (0.0,) * 3))
    probe = (
        "".join(f'#include "{name}"\n' for name in (*INCLUDES, *files))
        + "kernel void probe(SCENE_ARGS, global const float *in, global float *out, uint n)\n{\n"
        + "    SCENE\n    uint at = get_global_id(0) * LANES;\n"
        + f"    real x[{max(arguments, 1)}], r[{results}];\n    Wavelengths lambdas = {{{nm}}};\n"
        + f"{reads}    {body}\n{writes}}}\n"
    )
    virtual = {
        **PLAIN,
        **shape_text.virtual_files(Features()),
        **light_dispatch.virtual_files(),
        "probe.cl": probe,
        "generated/scene.cl": scene_text(),
        "generated/spectrum.cl": f'#include "spectra/{mode}.cl"\n',
        "generated/spectrum_read.cl": f'#include "spectra/{mode}.cl#read"\n',
        "generated/lights.cl": light_text,
    }
    defines = {"LANES": lanes, "QUEUED": 0, "SPECTRA_STEP": f"{STEP}f"}
    defines["SPECTRA_SIZE"] = Encoder("spectral").spectra.samples
    return device.build(opened(), device.assemble("probe.cl", virtual, defines))


def lit(
    lamps=(),
    emitters=(),
    mode: str = "rgb",
    radius: float = 1.0,
    files=(),
    tree: bool = False,
    gloss: bool = False,
) -> Lit:
    """A scene of lamps and emissive shapes; `files` are further includes.

    tree: it chooses lights; gloss: by the gloss of surfaces.
    """
    encoder = Encoder(mode)
    made, first = [], 0
    for number, shape in enumerate(emitters):
        row = np.zeros(1, SHAPE.dtype)
        row["prim"] = first
        vertices = faces = uvs = None
        if shape.kind not in shapes.ANALYTIC:
            vertices, faces, _, uvs = triangles.triangulate(shape)
            base = encoder.store.size("uvs") // 2
            encoder.store.append("faces", faces + np.uint32(base))
            encoder.store.append_floats("uvs", np.zeros((len(vertices), 2)) if uvs is None else uvs)
            row["flags"] = 0 if uvs is None else 2
            first += len(faces)
        made.append((row, lights.Emitter(shape, number, vertices, faces, uvs)))
    emitting = [emitter for _, emitter in made]
    found = sources.measured(lamps, emitting, radius, encoder.look)
    rows = lights.light_rows(lamps, emitting, encoder, found, 1 if tree else None)
    for (row, _), at in zip(made, rows.sources.first, strict=True):
        row["light"] = at
        encoder.store.append("shapes", row.view(np.uint32))
    encoder.store.append("lights", rows.rows.view(np.uint32))
    encoder.textures.finish()
    if rows.tree is not None:
        encoder.store.append("lights", rows.tree)
    return Lit(encoder, rows, tuple(files), radius, gloss)


def shape_probe(shape) -> Lit:
    """A scene whose `geometry` holds one shape, and the kind's functions."""
    encoder = Encoder("rgb")
    encoder.store.append("geometry", analytic.row(shape))
    none = lights.light_rows((), (), encoder, sources.measured((), (), 1.0, encoder.look))
    return Lit(encoder, none, (f"generated/shape/{shape.kind}.cl",))
