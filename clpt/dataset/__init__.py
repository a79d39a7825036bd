"""Datasets: pictures of random scenes with ground truth, by the ten thousand."""

from clpt.dataset.generating import Report, generate, pictures, warm
from clpt.dataset.loading import Pictures
from clpt.dataset.picture import Picture
from clpt.dataset.truth import Truth, ground_truth, optical_flow, scene_flow
from clpt.dataset.writers import WRITERS, Writer

__all__ = [
    "WRITERS",
    "Picture",
    "Pictures",
    "Report",
    "Truth",
    "Writer",
    "generate",
    "ground_truth",
    "optical_flow",
    "pictures",
    "scene_flow",
    "warm",
]
