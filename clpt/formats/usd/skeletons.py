"""Points that skeletons and blend shapes move (UsdSkel), at the time of the document."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdSkel, Vt

from clpt import transforms
from clpt.arrays import Floats32
from clpt.formats.usd.document import Document


def moved(document: Document, prim: Usd.Prim, rest: Floats32) -> Floats32:
    """Return a prim's points (n, 3), in its own space, after its skeleton has moved them."""
    skin = skin_of(document, prim)
    return rest if skin is None else skin.posed(skin.shaped(rest))


@dataclass(frozen=True)
class Skin:
    """A prim that is bound to a skeleton."""

    document: Document
    prim: Usd.Prim
    query: UsdSkel.SkinningQuery
    skeleton: UsdSkel.SkeletonQuery

    def shaped(self, rest: Floats32) -> Floats32:
        """Return points (n, 3) that blend shapes have moved."""
        animation, mapper = self.skeleton.GetAnimQuery(), self.query.GetBlendShapeMapper()
        weights = None
        if self.query.HasBlendShapes() and animation and mapper:
            weights = animation.ComputeBlendShapeWeights(self.document.time)
        if weights is None:
            return rest
        shapes, moved = UsdSkel.BlendShapeQuery(UsdSkel.BindingAPI(self.prim)), _rows(rest)
        shapes.ComputeDeformedPoints(
            *shapes.ComputeSubShapeWeights(mapper.Remap(weights)),
            shapes.ComputeBlendShapePointIndices(), shapes.ComputeSubShapePointOffsets(), moved,
        )  # fmt: skip
        return np.array(moved, np.float32)

    def posed(self, rest: Floats32) -> Floats32:
        """Return points (n, 3) that joints have moved, in the prim's space."""
        time, moved = self.document.time, _rows(rest)
        joints = self.skeleton.ComputeSkinningTransforms(time)
        if joints is None or not self.query.HasJointInfluences():
            return rest
        if not self.query.ComputeSkinnedPoints(joints, moved, time):
            message = "its joints do not fit its skeleton: it is shown at rest"
            self.document.warn(message, self.prim.GetPath())
            return rest
        # They are in the skeleton's space.
        to_world = self.document.placement(self.skeleton.GetPrim())
        to_prim = transforms.inverse(self.document.placement(self.prim)) @ to_world
        return transforms.transform_points(to_prim, np.array(moved, np.float64)).astype(np.float32)

    def turned(self, rest: Floats32, normals: Floats32, vertices: NDArray[Any]) -> Floats32:
        """Return normals (m, 3) at vertices (m,) as they turn with points (n, 3), of unit length.

        rest: the points before they move. Around a point the motion is linear: how far small steps
        along the axes go are the columns of its matrix.
        """
        shaped = self.shaped(rest)
        step = np.float32(max(float(np.ptp(rest, axis=0).max()), 1e-6))
        origin = self.posed(shaped)
        steps = [self.posed(shaped + step * axis) - origin for axis in np.eye(3, dtype=np.float32)]
        matrices = np.stack(steps, axis=-1).astype(np.float64) / step
        # A normal turns by the inverse transpose, which is the matrix of cofactors times a number.
        rows = [matrices[:, row] for row in range(3)]
        cofactors = np.stack([np.cross(rows[i - 2], rows[i - 1]) for i in range(3)], axis=1)
        whole = np.einsum("nij,nj->ni", cofactors[vertices], normals.astype(np.float64))
        length = np.linalg.norm(whole, axis=1, keepdims=True)
        return np.where(length > 0.0, whole / np.maximum(length, 1e-30), normals).astype(np.float32)


def skin_of(document: Document, prim: Usd.Prim) -> Skin | None:
    """Return how a skeleton moves a prim's points; None where nothing does."""
    root = prim
    while root and root.GetTypeName() != "SkelRoot":
        root = root.GetParent()
    if not root:
        return None

    def populated() -> UsdSkel.Cache:
        cache = UsdSkel.Cache()
        cache.Populate(UsdSkel.Root(root), Usd.PrimDefaultPredicate)
        return cache

    cache = document.once(("skeletons", str(root.GetPath())), populated)
    query = cache.GetSkinningQuery(prim)
    if not query or not (query.HasJointInfluences() or query.HasBlendShapes()):
        return None
    skeleton = UsdSkel.BindingAPI(prim).GetInheritedSkeleton()
    bound = cache.GetSkelQuery(skeleton) if skeleton else None
    if not bound:
        document.warn("its skeleton is not there: it is shown at rest", prim.GetPath())
        return None
    return Skin(document, prim, query, bound)


def _rows(rows: Floats32) -> Vt.Vec3fArray:
    return Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(rows, np.float32))
