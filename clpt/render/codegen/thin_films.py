"""Kernel text of boundaries: bare, with layers, or by the table of colours."""

from __future__ import annotations

from collections.abc import Mapping

from clpt.render.codegen import parameters
from clpt.render.contract import parameter_words
from clpt.render.contract.parameter_words import FILM_COSINES
from clpt.scene.materials import Layer
from clpt.scene.params import Kind, params

Sources = Mapping[str, frozenset[str]]


def boundary_text(cls: type[Kind], mode: str, sources: Sources, layer: Sources) -> str:
    """Return how a kind's boundary treats light: bare, with layers, or by the table of colours.

    sources: of the kind's parameters; layer: of those of the layers in the scene.
    """
    coated = [name for name, param in params(cls).items() if param.role == "layers"]
    if not coated:
        return ""
    if not any("layers" in sources.get(name, ()) for name in coated):
        return '#include "optics/boundary_bare.cl"\n'
    return _waves_text(layer) if mode == "spectral" else _table_text(layer)


def _waves_text(sources: Sources) -> str:
    """The layers of a material, which are read one by one."""
    words = parameter_words.row_words(Layer)
    return f"""{parameters.struct_text(Layer)}{parameters.load_text(Layer, sources, "materials")}
typedef struct {{
    Scene scene;
    integer first, count; /* rows in `materials` */
    TexturePoint point;
    Wavelengths lambdas;
}} Layers;
inline Layers layers_load(Scene scene, integer at, TexturePoint point, Wavelengths lambdas)
{{
    integer first = gather_i(scene.materials, at), count = gather_i(scene.materials, at + 1);
    Layers l = {{scene, first, count, point, lambdas}};
    return l;
}}
inline Layer layer_at(Layers l, integer i)
{{
    return layer_load(l.scene, l.first + i * {words}, l.point, l.lambdas);
}}
#include "optics/boundary_film.cl"
"""


def _table_text(sources: Sources) -> str:
    """Where in the table of colours a material's layers stand."""
    profile = parameters.value_text("film_profile", params(Layer)["profile"], sources["profile"])
    return f"""{profile}#define FILM_COSINES {FILM_COSINES}
typedef struct {{
    Scene scene;
    integer count, table, rows; /* layers; first number in `spectra`; how many profiles it has */
    real profile;
}} Layers;
inline Layers layers_load(Scene scene, integer at, TexturePoint point, Wavelengths lambdas)
{{
    integer row = gather_i(scene.materials, at);
    Layers l = {{scene, gather_i(scene.materials, at + 1), gather_i(scene.materials, row),
                gather_i(scene.materials, row + 1), film_profile(scene, row + 2, point, lambdas)}};
    return l;
}}
#include "optics/boundary_table.cl"
"""
