"""Kernel text of boundaries: bare, with layers, or by the table of colours."""

from __future__ import annotations

from collections.abc import Mapping

from clpt.render.materials.cases import load_text, struct_text, value_text
from clpt.render.records.parameter_words import FILM_COSINES, row_words
from clpt.scene import roles
from clpt.scene.materials import Layer
from clpt.scene.params import Kind, params

Sources = Mapping[str, frozenset[str]]
_WAVES = '#include "materials/layers_waves.cl"\n#include "materials/boundary_film.cl"\n'
_TABLE = '#include "materials/layers_table.cl"\n#include "materials/boundary_table.cl"\n'


def boundary_text(cls: type[Kind], mode: str, sources: Sources, layer: Sources) -> str:
    """Return how a kind's boundary treats light: bare, with layers, or by the table of colours.

    sources: of the kind's parameters; layer: of those of the layers in the scene.
    """
    coated = [name for name, param in params(cls).items() if param.role is roles.LAYERS]
    if not coated:
        return ""
    if not any("layers" in sources.get(name, ()) for name in coated):
        return '#include "materials/boundary_bare.cl"\n'
    if mode == "rgb":
        profile = value_text("film_profile", params(Layer)["profile"], layer["profile"])
        return f"{profile}#define FILM_COSINES {FILM_COSINES}\n{_TABLE}"
    loader = load_text(Layer, layer, "materials")
    return f"{struct_text(Layer)}{loader}#define LAYER_WORDS {row_words(Layer)}\n{_WAVES}"
