"""Many devices and machines: who renders which samples, and what travels between them."""

from typing import Any


def __getattr__(name: str) -> Any:
    """Import `ClusterRenderer` on its first use, not with clpt."""
    if name == "ClusterRenderer":
        from clpt.cluster.cluster_renderer import ClusterRenderer

        return ClusterRenderer
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
