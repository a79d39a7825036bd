"""Samples that a film does not take, as people are told of them."""

from __future__ import annotations

from ...render.resumable import ResumableRenderer


def refusals(renderer: ResumableRenderer) -> list[str]:
    """Return a sentence for each way in which samples of a render, or pixels, are wrong."""
    told = []
    if rejected := renderer.counts.rejected:
        told.append(
            f"{rejected} samples were not finite, too bright, or in a medium that is far too dense "
            "beside empty cells, and count as black"
        )
    if renderer.counts.full:
        told.append("pixels are too bright for the film: lower film.exposure")
    return told
