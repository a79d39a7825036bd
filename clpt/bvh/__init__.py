"""Acceleration structures over triangles and boxes, built on the device."""

from ..choices import Quality
from .build import (
    Bvh,
    Runs,
    build,
    build_boxes,
    build_parts,
    choose_layout,
    choose_tree,
    outgrows_caches,
    rebuild_boxes,
    refit,
    refit_boxes,
)
from .building import Building
from .layouts import ALONE, LAYOUTS, TREES, shapes_layout, traversal_text

__all__ = [
    "ALONE",
    "LAYOUTS",
    "TREES",
    "Building",
    "Bvh",
    "Quality",
    "Runs",
    "build",
    "build_boxes",
    "build_parts",
    "choose_layout",
    "choose_tree",
    "outgrows_caches",
    "rebuild_boxes",
    "refit",
    "refit_boxes",
    "shapes_layout",
    "traversal_text",
]
