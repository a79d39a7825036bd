"""Kernel text of the shapes."""

from __future__ import annotations

from clpt.render.contract.shape_records import ONE_OF, RECORDS


def virtual_files() -> dict[str, str]:
    """Return generated/shape/<kind>.cl per kind: its struct, its loader and its functions."""
    made = {kind: record.row_text() for kind, record in RECORDS.items()}
    made |= {kind: f'#include "generated/shape/{one}.cl"\n' for kind, one in ONE_OF.items()}
    return {
        f"generated/shape/{kind}.cl": f'{text}#include "shape/{kind}.cl"\n'
        for kind, text in made.items()
    }
