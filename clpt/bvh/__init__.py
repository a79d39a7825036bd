"""Acceleration structures: triangles and boxes to nodes, built on the device."""

from .build import LAYOUTS, Bvh, build, build_boxes, choose_layout

__all__ = ["LAYOUTS", "Bvh", "build", "build_boxes", "choose_layout"]
