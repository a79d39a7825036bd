"""Ray queries on an application's queue: intersections of rays with triangles."""

from .accel import Accel, InstancedAccel
from .queries import AllHits, Hits

__all__ = ["Accel", "AllHits", "Hits", "InstancedAccel"]
