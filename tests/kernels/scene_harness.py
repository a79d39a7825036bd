"""Small programs around kernel functions that read the scene's tables."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pyopencl as cl

from clpt import device
from clpt.records import SETTINGS, TABLES
from clpt.render.flow import choices
from clpt.render.flow.flags import scene_text
from clpt.render.records import Features
from tests.kernels.harness import opened

BLOCK = 16


PLAIN = choices.virtual_files(Features(), "binary")  # the files of a plain scene


def scene_files(mode: str) -> dict[str, device.Part | str | tuple[str, ...]]:
    """The generated files that core/base.cl includes, and those of a plain scene."""
    return {
        **PLAIN,
        "generated/scene.cl": scene_text(),
        "generated/spectrum.cl": f'#include "spectra/{mode}.cl"\n',
        "generated/spectrum_read.cl": f'#include "spectra/{mode}.cl#read"\n',
    }


class SceneProbe:
    """`body` on lanes, as a function of arrays: it sets r[0..results) from x[0..arguments).

    files: included after core/base.cl; virtual: generated ones among them; tables: arrays by their
    names in clpt.records.TABLES, settings by theirs.
    """

    def __init__(
        self,
        body: str,
        arguments: int,
        results: int,
        *,
        files: tuple[str, ...] = (),
        mode: str = "rgb",
        lanes: int = 8,
        virtual: Mapping[str, str] | None = None,
        defines: Mapping[str, str | int | float] | None = None,
        tables: Mapping[str, np.ndarray] | None = None,
        settings: Mapping[str, object] | None = None,
    ):
        self.arguments, self.results, self.lanes = arguments, results, lanes
        includes = "".join(f'#include "{name}"\n' for name in ("core/base.cl", *files))
        text = includes + _kernel(body, arguments, results)
        common = {"LANES": lanes, "QUEUED": 0, "SPECTRA_SIZE": 471, "SPECTRA_STEP": "1.0f"}
        made = {**scene_files(mode), **(virtual or {}), "probe.cl": text}
        source = device.assemble("probe.cl", made, {**common, **(defines or {})})
        self.program = device.build(opened(), source)
        self.buffers = _buffers(tables or {}, settings or {})

    def __call__(self, *given: np.ndarray) -> np.ndarray:
        """given: `arguments` arrays (n,); returns (results, n) float32."""
        n = len(given[0])
        padded = -(-n // BLOCK) * BLOCK
        columns = [np.pad(np.asarray(g, np.float32), (0, padded - n), "edge") for g in given]
        out = np.empty((self.results, padded), np.float32)
        dev, flags = opened(), cl.mem_flags
        source = _read_only(np.stack(columns))
        target = cl.Buffer(dev.context, flags.WRITE_ONLY, out.nbytes)
        bound = self.program.kernel("probe").bind(
            **self.buffers, given=source, made=target, n=padded
        )
        bound.enqueue(dev.queue, (padded // self.lanes,), (1,))
        cl.enqueue_copy(dev.queue, out, target)
        return out[:, :n]


def _kernel(body: str, arguments: int, results: int) -> str:
    reads = "".join(f"    x[{i}] = block_load(given + {i} * n + at);\n" for i in range(arguments))
    writes = "".join(f"    block_store(made + {i} * n + at, r[{i}]);\n" for i in range(results))
    return (
        "kernel void probe(SCENE_ARGS, global const float *given, global float *made, uint n)\n"
        "{\n    SCENE\n"
        f"    uint at = get_global_id(0) * LANES;\n    real x[{arguments}], r[{results}];\n"
        f"{reads}    {body}\n{writes}}}\n"
    )


def _buffers(
    tables: Mapping[str, np.ndarray], settings: Mapping[str, object]
) -> dict[str, cl.Buffer]:
    made = {}
    for name, (element, _) in TABLES.items():
        dtype = np.float32 if element == "float" else np.uint32
        made[name] = _read_only(np.asarray(tables.get(name, np.zeros(1)), dtype))
    words = np.zeros(1, SETTINGS.dtype)
    for name, value in settings.items():
        words[name] = value
    return {**made, "settings": _read_only(words)}


def _read_only(array: np.ndarray) -> cl.Buffer:
    flags = cl.mem_flags
    host = np.ascontiguousarray(array)
    return cl.Buffer(opened().context, flags.READ_ONLY | flags.COPY_HOST_PTR, hostbuf=host)
