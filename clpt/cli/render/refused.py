"""Samples that a film does not take, as people are told of them."""

from __future__ import annotations

from ..opening.makers import AnyRenderer


def refusals(renderer: AnyRenderer) -> list[str]:
    """Return a sentence for each way in which samples of a render, or pixels, are wrong."""
    told = []
    rejected = sum(counts.rejected for counts in renderer.counts)
    if rejected:
        told.append(f"{rejected} samples were not finite, or too bright, and count as black")
    if any(counts.full for counts in renderer.counts):
        told.append("pixels are too bright for the film: lower film.exposure")
    return told
