"""The prims that a stage shows, by role; none that is invisible or of another purpose."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator

from pxr import Usd

from clpt.formats.usd.document import Document

LIGHTS = frozenset(
    (
        "RectLight", "DiskLight", "SphereLight", "CylinderLight", "DistantLight", "DomeLight",
        "DomeLight_1", "PortalLight", "GeometryLight", "PluginLight",
    )
)  # fmt: skip
GPRIMS = frozenset(
    ("Mesh", "Sphere", "Cube", "Cylinder", "Cylinder_1", "Cone", "Capsule", "Capsule_1", "Plane",
     "BasisCurves", "Points")
)  # fmt: skip
UNREAD = frozenset(
    ("NurbsPatch", "NurbsCurves", "HermiteCurves", "TetMesh", "LightFilter", "PluginLightFilter",
     "ParticleField3DGaussianSplat", "ParticleField")
)  # fmt: skip
HIDDEN = ("proxy", "guide")  # purposes that no picture shows


Shown = dict[str, list[Usd.Prim]]  # prims by role: see ROLES, and "instances"
ROLES = {
    **dict.fromkeys(GPRIMS, "gprims"), **dict.fromkeys(LIGHTS, "lights"), "Camera": "cameras",
    "PointInstancer": "instancers", "Volume": "volumes", "RenderSettings": "settings",
}  # fmt: skip


def shown(document: Document, root: Usd.Prim, *, defined: bool = True) -> Shown:
    """Return the prims that are shown below a prim, and that prim.

    defined: leave out prims that only `over` speaks of, as a stage does; prototypes may be below
    such prims.
    """
    prims: Shown = defaultdict(list)
    for prim in _prims(document, root, defined):
        name = prim.GetTypeName()
        role = ROLES.get(name)
        if role is not None:
            prims[role].append(prim)
        elif name in UNREAD:
            document.warn(f"{name} is not read", prim.GetPath())
        elif prim.IsInstance():
            prims["instances"].append(prim)
    return prims


def _prims(document: Document, root: Usd.Prim, defined: bool) -> Iterator[Usd.Prim]:
    """Yield a prim and those below it that are visible and of a purpose that is shown."""
    anywhere = Usd.PrimIsActive & Usd.PrimIsLoaded & ~Usd.PrimIsAbstract
    iterator = iter(Usd.PrimRange(root, Usd.PrimDefaultPredicate if defined else anywhere))
    for prim in iterator:
        visibility = prim.GetAttribute("visibility")
        if visibility and visibility.Get(document.time) == "invisible":
            iterator.PruneChildren()
            if prim.GetTypeName() != "Camera":
                continue
        elif prim.GetAttribute("purpose").Get() in HIDDEN:
            iterator.PruneChildren()
            continue
        elif prim.GetTypeName() == "PointInstancer":
            iterator.PruneChildren()
        yield prim
