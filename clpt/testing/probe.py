"""The functions of a material kind, called on arrays through a small program."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import device
from clpt.render.flow.programs import BSDF
from clpt.render.materials import rough_coat_table
from clpt.render.materials.cases import struct_text
from clpt.render.materials.thin_films import film_colours
from clpt.render.records import materials
from clpt.render.records.materials import FILM_COSINES, array_size, lane_type
from clpt.render.spectra import measurements
from clpt.render.spectra.encode import angular_values
from clpt.scene import roles
from clpt.scene.materials import Layer, Material
from clpt.scene.params import device_params
from clpt.scene.roles import Param, Role
from clpt.spectra.spectrum import primaries

COMPONENTS = {"rgb": 3, "spectral": 4}
LAMBDAS = (532.0, 590.0, 655.0, 441.0)  # [nm], for kinds with `needs_wavelengths`, and layers
NOTHING = np.zeros(0)
RESULTS = ("wi", "weight", "sampled_pdf", "eta", "lobe", "eval", "pdf", "eval_again", "pdf_again")
CONTRACTED = {"rtol": 1e-3, "atol": 5e-5}  # for values about 1; twice NVIDIA's difference

_TEXT = """
kernel void probe(global const float *in, global float *out, uint n)
{
    uint at = get_global_id(0);
    float product = in[at] * in[at];
    out[at] = product - in[n + at];
}
"""


def root_text(mode: str, files: tuple[str, ...] = ()) -> str:
    """Return the includes of shading code in a mode ("rgb" or "spectral"), then of `files`."""
    text = "\n".join(f'#include "{name}"' for name in (*BSDF, *files)) + "\n"
    return text.replace("generated/spectrum.cl", f"spectra/{mode}.cl")


def run(
    on: device.Device,
    virtual: device.Virtual,
    lanes: int,
    streams: NDArray,
    rows: int,
    table: NDArray = NOTHING,
    options: Sequence[str] = (),
) -> NDArray[np.float32]:
    """Run `kernel void probe(global const float *in, global float *out, uint n)` of "probe.cl".

    streams: (k, n) float32, the start of `in`; table: the data behind them in `in`; virtual: the
    program's files; options: further compiler options. Returns (rows, n) float32. n is padded to
    whole blocks.
    """
    program = device.build(on, _source(tuple(virtual.items()), lanes), options)
    n = streams.shape[1]
    padded = -(-n // 16) * 16
    data = np.empty((streams.shape[0], padded), np.float32)
    data[:, :n], data[:, n:] = streams, streams[:, -1:]
    out = np.empty((rows, padded), np.float32)
    data = np.concatenate([data.ravel(), np.asarray(table, np.float32).ravel()])
    give, stream = device.Buffers(on), device.Stream(on.queue)
    memory = {"in": give.upload("arguments", data), "out": give.allocate("results", out.nbytes)}
    stream.run(program.kernel("probe").bind(**memory, n=padded), (padded // lanes,), (1,))
    return stream.read(memory["out"], out)[:, :n]


@lru_cache(maxsize=64)  # the same text is called with many arguments
def _source(virtual: tuple[tuple[str, Any], ...], lanes: int) -> device.Source:
    files = {**rough_coat_table.virtual_files(), **dict(virtual)}
    return device.assemble("probe.cl", files, {"LANES": lanes})


class Probe:
    """A material kind's functions in a mode, as functions of arrays.

    on: the device that runs them, by default a new context on the device of `clpt.device.choose`.
    """

    def __init__(
        self, cls: type[Material], mode: str, lanes: int = 16, on: device.Device | None = None
    ):
        self.cls, self.mode, self.lanes = cls, mode, lanes
        self.components = COMPONENTS[mode]
        self.on = device.choose() if on is None else on

    def __call__(
        self, params: Mapping[str, Any], wo: NDArray, wi: NDArray, u: NDArray
    ) -> dict[str, NDArray]:
        """Sample at u, evaluate at wi and at the sampled direction.

        params: by name, a number or (components,) for a spectrum, or (n,) and (n, components), and
        a list of `layers` of constant index, none by default;
        wo, wi, u: (n, 3). Returns the entries of RESULTS, `albedo` beside them: (n,), (n, 3)
        for `wi`, (n, components) for spectra; float32.
        """
        n = max(len(wo), len(wi), len(u))
        columns = [np.broadcast_to(a, (n, 3)) for a in (wo, wi, u)]
        layers = params.get("layers", ())
        for name, param in self._streamed():
            wide = self.components if lane_type(param) == "Spectrum" else array_size(param)
            value = np.asarray(params[name], float)
            value = value[:, None] if wide == 1 and value.ndim == 1 else value
            columns.append(np.broadcast_to(value, (n, wide)))
        if self.cls.needs_wavelengths:
            value = params.get("lambdas", LAMBDAS[: self.components])
            columns.append(np.broadcast_to(np.asarray(value, float), (n, self.components)))
        streams = np.concatenate(columns, axis=1).T.astype(np.float32)
        c = self.components
        extra = self._layers_text(len(layers), len(streams))
        if self._named(roles.ANGULAR):
            extra = self._angular_text(params, len(streams))
        elif self._named(roles.MEASUREMENT):
            extra = self._measurement_text(params, len(streams))
        elif self._named(roles.MERL):
            extra = self._merl_text(len(streams))
        virtual: dict[str, str | device.Part] = {"probe.cl": self._text(*extra)}
        if self.cls.source is not None:
            virtual[f"{self.cls.folder}/{self.cls.kind}.cl"] = materials.text(self.cls)
        table = self._table(params, layers)
        out = run(self.on, virtual, self.lanes, streams, 8 + 4 * c, table).T
        parts = np.split(out, np.cumsum([3, c, 1, 1, 1, c, 1, c, 1]), axis=1)
        named = dict(zip((*RESULTS, "albedo"), parts, strict=True))
        named["lobe"] = named["lobe"].astype(int)
        return {k: v[:, 0] if v.shape[1] == 1 else v for k, v in named.items()}

    def _named(self, role: Role) -> str:
        """Return the name of the parameter of a role, or ""."""
        return next((k for k, p in device_params(self.cls).items() if p.role is role), "")

    def _angular_text(self, params: Mapping[str, Any], rows: int) -> list[str]:
        """Return the text that sets m's AngularTable; its data stand behind the rows in `in`."""
        spectral = self.mode == "spectral"
        kind: Any = self.cls(**params)
        cosines, values, start, step = kind.device_rows(spectral)
        last = len(values) - 1
        at = (np.array(LAMBDAS) - start) / step if spectral else np.arange(3.0)
        row = ", ".join(f"(real)({position:.9e}f)" for position in np.clip(at, 0.0, last) + 0.0)
        counts = f"(integer)({len(cosines)}), (integer)({len(values)})"
        initialiser = f"{{in + {rows} * n, (integer)(0), {counts}, {{{row}}}}}"
        return [
            '#include "materials/angular_table.cl"',
            f"    AngularTable table = {initialiser};\n    m.{self._named(roles.ANGULAR)} = table;",
        ]

    def _measurement(self, params: Mapping[str, Any]) -> measurements.Rows:
        film = (min(LAMBDAS), max(LAMBDAS)) if self.mode == "spectral" else None
        return measurements.rows(params[self._named(roles.MEASUREMENT)], film)

    def _measurement_text(self, params: Mapping[str, Any], rows: int) -> list[str]:
        """Return the text that sets m's Measurement; its data stand behind the rows in `in`."""
        nodes = self._measurement(params).wavelengths
        at = np.interp(LAMBDAS, nodes, np.arange(len(nodes))) if len(nodes) else np.arange(3.0)
        row = ", ".join(f"(real)({position:.9e}f)" for position in at)
        initialiser = f"{{in + {rows} * n, (integer)(1), {{{row}}}}}"
        name = self._named(roles.MEASUREMENT)
        return [
            '#include "materials/measurement.cl"',
            f"    Measurement data = {initialiser};\n    m.{name} = data;",
        ]

    def _merl_text(self, rows: int) -> list[str]:
        """Return the text that sets m's MerlTable; its data stand behind the rows in `in`."""
        curves = np.eye(3)
        if self.mode == "spectral":
            curves = np.array([curve.sample(LAMBDAS) for curve in primaries()])
        basis = [", ".join(f"(real)({value:.9e}f)" for value in curve) for curve in curves]
        initialiser = (
            f"{{in + {rows} * n, (integer)(1), {', '.join(f'{{{row}}}' for row in basis)}}}"
        )
        name = self._named(roles.MERL)
        return [
            '#include "materials/merl_table.cl"',
            f"    MerlTable data = {initialiser};\n    m.{name} = data;",
        ]

    def _streamed(self) -> list[tuple[str, Param]]:
        beside = (roles.LAYERS, roles.ANGULAR, roles.MEASUREMENT, roles.MERL)
        return [(k, p) for k, p in device_params(self.cls).items() if p.role not in beside]

    def _table(self, params: Mapping[str, Any], layers: Sequence[Layer]) -> NDArray:
        """Return the data behind the streams in `in`: a table, layers, or layers' colours."""
        if self._named(roles.MEASUREMENT):
            return np.append(0.0, self._measurement(params).values)
        if name := self._named(roles.MERL):
            return np.append(0.0, measurements.merl_rows(params[name]).values)
        if self._named(roles.ANGULAR):
            kind: Any = self.cls(**params)
            return angular_values(*kind.device_rows(self.mode == "spectral")[:2])
        if not layers:
            return NOTHING
        if self.mode == "spectral":
            constants: Sequence[Any] = layers  # without textures
            films = [[e.eta.value, e.k.value, e.thickness, e.profile] for e in constants]
            return np.array(films, np.float32)
        indices = {
            k: np.asarray(params[k], float) for k, p in self._streamed() if p.role is roles.INDEX
        }
        if "int_ior" in indices:  # in RGB mode light is refracted by the mean ratio
            indices = {"int_ior": indices["int_ior"] / indices["ext_ior"], "ext_ior": np.ones(1)}
        constant = {k: float(v.mean()) for k, v in indices.items()}
        return film_colours(self.cls(**constant, layers=layers))  # type: ignore[arg-type, call-arg]

    def _layers_text(self, count: int, rows: int) -> list[str]:
        """Return the text that declares layers, behind the rows in `in`, and sets m.layers."""
        if "layers" not in device_params(self.cls):
            return ["", ""]
        if not count:
            return ['#include "materials/boundary.cl#bare"', "    m.layers = layers_none();"]
        if self.mode == "spectral":
            lambdas = ", ".join(f"(real)({v}f)" for v in LAMBDAS)
            return [
                struct_text(Layer) + "typedef struct { global const float *at; integer count;"
                " Spectrum lambdas; } Layers;\n"
                "inline Layer layer_at(Layers l, integer i)\n{\n    i *= 4;\n"
                "    Layer r = {spectrum_of(gather(l.at, i)), spectrum_of(gather(l.at, i + 1)),\n"
                "               gather(l.at, i + 2), gather(l.at, i + 3)};\n    return r;\n}\n"
                '#include "materials/boundary.cl#film"',
                f"    Layers layers = {{in + {rows} * n, {count}, {{{lambdas}}}}};\n"
                "    m.layers = layers;",
            ]
        return [
            "typedef struct { global const float *spectra; } Tables;\n"
            "typedef struct { Tables scene; integer count, table, rows; real profile; } Layers;\n"
            f'#define FILM_COSINES {FILM_COSINES}\n#include "materials/boundary.cl#table"',
            f"    Layers layers = {{{{in + {rows} * n}}, {count}, 0, 1, 1.0f}};\n"
            "    m.layers = layers;",
        ]

    def _reads(self) -> list[str]:
        """Return the lines that set a material's members from `in`, behind three vectors."""
        names = "xyzw"[: self.components]
        reads, at = [], 9
        for name, param in self._streamed():
            form = lane_type(param)
            members = [f"m.{name}.{c}" for c in names] if form == "Spectrum" else [f"m.{name}"]
            if (size := array_size(param)) > 1:
                members = [f"m.{name}[{i}]" for i in range(size)]
            for member in members:
                row = f"block_load(in + {at} * n + at)"
                value = f"to_integer({row})" if form == "integer" else row
                reads.append(f"    {member} = {value};")
                at += 1
        if self.cls.tints:
            reads.append("    m.luminance = luminance_of(m.base_color);")
        if self.cls.needs_wavelengths:
            for i, c in enumerate(names):
                reads.append(f"    m.lambdas.{c} = block_load(in + {at + i} * n + at);")
        return reads

    def _text(self, boundary: str, film: str) -> str:
        kind, names = self.cls.kind, "xyzw"[: self.components]
        reads = self._reads()
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
                root_text(self.mode) + boundary,
                struct_text(self.cls),
                f'#include "{self.cls.folder}/{kind}.cl"',
                "kernel void probe(global const float *in, global float *out, uint n)",
                "{",
                "    uint at = get_global_id(0) * LANES;",
                f"    vec3 {vectors};",
                f"    {self.cls.__name__} m;",
                *reads,
                film,
                f"    BsdfSample s = {kind}_sample(m, wo, u);",
                f"    Spectrum f = {kind}_eval(m, wo, wi), again = {kind}_eval(m, wo, s.wi);",
                f"    real pdf = {kind}_pdf(m, wo, wi), pdf_again = {kind}_pdf(m, wo, s.wi);",
                f"    Spectrum albedo = {kind}_albedo(m);",
                *writes,
                "}",
                "",
            ]
        )


@cache
def contracts(on: device.Device) -> bool:
    """Return whether the device's compiler joins a product and a later sum to an fma.

    Whether it joins them depends on the remaining program. So two programs may round the same
    expression differently: lanes of two widths agree to CONTRACTED. On other devices they agree to
    the bit.
    """
    streams = np.array([[1 + 2.0**-12], [1 + 2.0**-11]])  # a number, and its square as rounded
    return bool(run(on, {"probe.cl": _TEXT}, 1, streams, 1)[0, 0] != 0.0)
