"""Ray queries on an application's own queue: what rays meet among triangles."""

from .accel import Accel
from .instanced import InstancedAccel
from .queries import AllHits, Hits

__all__ = ["Accel", "AllHits", "Hits", "InstancedAccel"]
