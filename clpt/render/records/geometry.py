"""Features of shapes: the kinds that are no triangles, instances, and values of vertices."""

from __future__ import annotations

from dataclasses import dataclass

from clpt.render.records.macros import flag, macro


@dataclass(frozen=True)
class GeometryFeatures:
    """The kinds of shapes that rays meet as they are, instances, and what vertices have."""

    analytic: tuple[str, ...] = ()
    instances: bool = flag("USES_INSTANCES")
    only_instances: bool = flag("ONLY_INSTANCES")  # all triangles are of groups
    few_instances: int = flag("FEW_INSTANCES", 0)  # how many, if a ray goes to each without a tree
    normals: bool = False
    uvs: bool = False
    tangents: bool = flag("USES_TANGENTS")
    vertex_tangents: int = flag("VERTEX_TANGENTS", 0)  # where in `distributions` meshes' own lie

    @property
    @macro("USES_ANALYTIC")
    def has_analytic(self) -> bool:
        """Whether rays meet shapes that are no triangles."""
        return bool(self.analytic)
