"""Acceleration structures: triangles and boxes to nodes, built on the device."""

from .build import Bvh, build, build_boxes, build_parts, choose_layout
from .layouts import LAYOUTS

__all__ = ["LAYOUTS", "Bvh", "build", "build_boxes", "build_parts", "choose_layout"]
