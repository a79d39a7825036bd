"""Small programs around single kernel functions, so that tests can call them on arrays."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import numpy as np
import pyopencl as cl

from clpt import device
from clpt.render.kinds import array_size, lane_type, struct_text
from clpt.scene.params import Kind, device_params

COMPONENTS = {"rgb": 3, "spectral": 4}
LAMBDAS = (532.0, 590.0, 655.0, 441.0)  # [nm], of kinds that ask for the path's wavelengths
SHADING = ("lanes", "math", "spectrum", "frame", "warp", "bsdf")
RESULTS = ("wi", "weight", "sampled_pdf", "eta", "lobe", "eval", "pdf", "eval_again", "pdf_again")


@cache
def opened() -> device.Device:
    """The device that the kernel tests run on."""
    return device.choose()


def root_text(mode: str, files: tuple[str, ...] = ()) -> str:
    """The includes of shading code in a mode ("rgb" or "spectral"), then of `files`."""
    lib = [f"lib/{name}.cl" for name in SHADING]
    lib.insert(2, f"spectrum/{mode}.cl")
    return "\n".join(f'#include "{name}"' for name in (*lib, *files)) + "\n"


@cache
def _program(text: str, lanes: int) -> device.Program:
    source = device.assemble("probe.cl", {"probe.cl": text}, {"LANES": lanes})
    return device.build(opened(), source)


def run(text: str, kernel: str, lanes: int, given: np.ndarray, rows: int) -> np.ndarray:
    """Run a kernel `(global const float *in, global float *out, uint n)` whose rows are streams.

    given: (k, n) float32; returns (rows, n) float32. n is padded to whole lane blocks.
    """
    n = given.shape[1]
    padded = -(-n // 16) * 16
    data = np.empty((given.shape[0], padded), np.float32)
    data[:, :n], data[:, n:] = given, given[:, -1:]
    out = np.empty((rows, padded), np.float32)
    dev = opened()
    flags = cl.mem_flags
    source = cl.Buffer(dev.context, flags.READ_ONLY | flags.COPY_HOST_PTR, hostbuf=data)
    target = cl.Buffer(dev.context, flags.WRITE_ONLY, out.nbytes)
    bound = _program(text, lanes).kernel(kernel).bind(**{"in": source, "out": target, "n": padded})
    bound.enqueue(dev.queue, (padded // lanes,), (1,))
    cl.enqueue_copy(dev.queue, out, target)
    return out[:, :n]


def map_text(body: str, arguments: int, results: int, mode: str = "rgb", files=()) -> str:
    """A kernel `probe` that computes r[0..results) from x[0..arguments), all `real`."""
    reads = "".join(f"    x[{i}] = block_load(in + {i} * n + at);\n" for i in range(arguments))
    writes = "".join(f"    block_store(out + {i} * n + at, r[{i}]);\n" for i in range(results))
    return (
        root_text(mode, tuple(files))
        + "kernel void probe(global const float *in, global float *out, uint n)\n{\n"
        + f"    uint at = get_global_id(0) * LANES;\n    real x[{arguments}], r[{results}];\n"
        + f"{reads}    {body}\n{writes}}}\n"
    )


class Probe:
    """The functions of one material kind in one mode, as functions of arrays.

    source: the kind's kernel text; by default its file in kernels/bsdf.
    """

    def __init__(self, cls: type[Kind], mode: str, lanes: int = 16, source: str | None = None):
        self.cls, self.mode, self.lanes = cls, mode, lanes
        self.components = COMPONENTS[mode]
        self.text = self._text(source or f'#include "bsdf/{cls.kind}.cl"')

    def __call__(
        self, params: Mapping[str, object], wo: np.ndarray, wi: np.ndarray, u: np.ndarray
    ) -> dict[str, np.ndarray]:
        """Sample at u, evaluate at wi and at the sampled direction.

        params: by name, a number or (components,) for a spectrum, or (n,) and (n, components);
        wo, wi, u: (n, 3). Returns the entries of RESULTS, `albedo` beside them: (n,), (n, 3)
        for `wi`, (n, components) for spectra; float32.
        """
        n = max(len(wo), len(wi), len(u))
        columns = [np.broadcast_to(a, (n, 3)) for a in (wo, wi, u)]
        for name, param in device_params(self.cls).items():
            wide = self.components if lane_type(param) == "Spectrum" else array_size(param)
            value = np.asarray(params[name], float)
            value = value[:, None] if wide == 1 and value.ndim == 1 else value
            columns.append(np.broadcast_to(value, (n, wide)))
        if self.cls.needs_wavelengths:
            value = params.get("lambdas", LAMBDAS[: self.components])
            columns.append(np.broadcast_to(np.asarray(value, float), (n, self.components)))
        given = np.concatenate(columns, axis=1).T.astype(np.float32)
        c = self.components
        out = run(self.text, "probe", self.lanes, given, 8 + 4 * c).T
        parts = np.split(out, np.cumsum([3, c, 1, 1, 1, c, 1, c, 1]), axis=1)
        named = dict(zip((*RESULTS, "albedo"), parts, strict=True))
        named["lobe"] = named["lobe"].astype(int)
        return {k: v[:, 0] if v.shape[1] == 1 else v for k, v in named.items()}

    def _text(self, source: str) -> str:
        kind, names = self.cls.kind, "xyzw"[: self.components]
        at, reads = 9, []
        for name, param in device_params(self.cls).items():
            form = lane_type(param)
            members = [f"m.{name}.{c}" for c in names] if form == "Spectrum" else [f"m.{name}"]
            if (size := array_size(param)) > 1:
                members = [f"m.{name}[{i}]" for i in range(size)]
            for member in members:
                row = f"block_load(in + {at} * n + at)"
                value = f"to_integer({row})" if form == "integer" else row
                reads.append(f"    {member} = {value};")
                at += 1
        if self.cls.needs_wavelengths:
            for i, c in enumerate(names):
                reads.append(f"    m.lambdas.{c} = block_load(in + {at + i} * n + at);")
        spectra = {name: [f"{name}.{c}" for c in names] for name in ("f", "again", "albedo")}
        weight = [f"s.weight.{c}" for c in names]
        results = ["s.wi.x", "s.wi.y", "s.wi.z", *weight, "s.pdf", "s.eta", "to_real(s.lobe)"]
        results += [*spectra["f"], "pdf", *spectra["again"], "pdf_again", *spectra["albedo"]]
        writes = [f"    block_store(out + {i} * n + at, {r});" for i, r in enumerate(results)]
        vectors = ", ".join(
            f"{v} = v3({', '.join(f'block_load(in + {3 * i + j} * n + at)' for j in range(3))})"
            for i, v in enumerate(("wo", "wi", "u"))
        )
        return "\n".join(
            [
                root_text(self.mode) + struct_text(self.cls),
                source,
                "kernel void probe(global const float *in, global float *out, uint n)",
                "{",
                "    uint at = get_global_id(0) * LANES;",
                f"    vec3 {vectors};",
                f"    {self.cls.__name__} m;",
                *reads,
                f"    BsdfSample s = {kind}_sample(m, wo, u);",
                f"    Spectrum f = {kind}_eval(m, wo, wi), again = {kind}_eval(m, wo, s.wi);",
                f"    real pdf = {kind}_pdf(m, wo, wi), pdf_again = {kind}_pdf(m, wo, s.wi);",
                f"    Spectrum albedo = {kind}_albedo(m);",
                *writes,
                "}",
                "",
            ]
        )
