"""Gprims as shapes, in the world or in prototypes that instances and point instancers place."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom, UsdShade

from clpt import transforms
from clpt.arrays import Floats, Matrix
from clpt.files import budget
from clpt.formats.usd import curves, meshes, quadrics, walk
from clpt.formats.usd.document import Document
from clpt.scene.shapes import Group, Instance, Mesh, Shape

Reader = Callable[[Document, Usd.Prim, "UsdShade.Material | None"], Sequence[Shape]]
READERS: dict[str, Reader] = {
    "Mesh": meshes.meshes,
    **dict.fromkeys(quadrics.MESHES, quadrics.quadric),
    **curves.READERS,
}
BYTES = 2048  # of a copy in memory, about
INSTANCED = 20_000  # triangles that copies would add; fewer are traced faster as copies
DEEPEST = 32  # instances in each other


@dataclass
class Content:
    """Shapes below a prim, in its space, with prototypes that it places and lights.

    shapes and lights: each with its prim and its transform; copies: prototypes with the transforms
    (n, 4, 4) that place them.
    """

    shapes: list[tuple[Usd.Prim, Shape, Matrix]] = field(default_factory=list)
    lights: list[tuple[Usd.Prim, Matrix]] = field(default_factory=list)
    cameras: list[Usd.Prim] = field(default_factory=list)
    volumes: list[Usd.Prim] = field(default_factory=list)
    settings: list[Usd.Prim] = field(default_factory=list)
    copies: list[tuple[Content, Floats]] = field(default_factory=list)

    def flat(self) -> Content:
        """Return the content with the shapes of all its copies among its own."""
        whole = Content(list(self.shapes))
        for inner, matrices in self.copies:
            parts = inner.flat()
            budget.take_parts(len(matrices) * len(parts.shapes), "instances in prototypes")
            for matrix in matrices:
                whole.shapes += [(prim, one, matrix @ at) for prim, one, at in parts.shapes]
        return whole

    def flat_lights(self) -> list[tuple[Usd.Prim, Matrix]]:
        """Return all lights with their transforms, those of copies too."""
        lights = list(self.lights)
        for inner, matrices in self.copies:
            parts = inner.flat_lights()
            lights += [(prim, matrix @ at) for matrix in matrices for prim, at in parts]
        return lights


def content(
    document: Document,
    root: Usd.Prim,
    base: Matrix | None = None,
    inherited: UsdShade.Material | None = None,
    depth: int = 0,
) -> Content:
    """Return the content of a prim.

    base: from the world to the content's space, None for the world. inherited: the material of
    shapes that bind none. Raises SceneError for instances in each other without end.
    """
    if depth > DEEPEST:
        raise document.error("instances are nested too deeply", root.GetPath())
    prims = walk.shown(document, root, defined=base is None)
    whole = Content(cameras=prims["cameras"], volumes=prims["volumes"], settings=prims["settings"])
    for prim in prims["volumes"] if base is not None else ():
        document.warn("volumes of prototypes are left out", prim.GetPath())

    def placement(prim: Usd.Prim) -> Matrix:
        matrix = document.placement(prim)
        return matrix if base is None else base @ matrix

    for prim, shapes in _shapes(document, prims["gprims"], inherited):
        whole.shapes += [(prim, shape, placement(prim)) for shape in shapes]
    whole.lights = [(prim, placement(prim)) for prim in prims["lights"]]
    alike: dict[tuple[str, str], list[tuple[Usd.Prim, UsdShade.Material | None]]] = {}
    for prim, bound in zip(prims["instances"], _bound(prims["instances"]), strict=True):
        material = bound or inherited
        key = str(prim.GetPrototype().GetPath()), str(material.GetPath()) if material else ""
        alike.setdefault(key, []).append((prim, material))
    for key, several in alike.items():
        prototype, material = several[0][0].GetPrototype(), several[0][1]
        make = partial(content, document, prototype, np.eye(4), material, depth + 1)
        inner = document.once(("content", document.code, *key), make)
        matrices = document.placements([prim for prim, _ in several])
        whole.copies.append((inner, matrices if base is None else base @ matrices))
    for prim in prims["instancers"]:
        whole.copies += _instancer(document, prim, placement(prim), inherited, depth)
    return whole


def _bound(prims: list[Usd.Prim]) -> list[UsdShade.Material | None]:
    """Return the material that each prim binds, or None."""
    materials = UsdShade.MaterialBindingAPI.ComputeBoundMaterials(prims)[0] if prims else []
    return [material if material else None for material in materials]


def _shapes(
    document: Document, prims: list[Usd.Prim], inherited: UsdShade.Material | None
) -> Iterable[tuple[Usd.Prim, Sequence[Shape]]]:
    """Yield prims and their shapes, each in its prim's own space."""
    budget.take_parts(len(prims), "prims", document.file)
    for prim, material in zip(prims, _bound(prims), strict=True):
        yield prim, READERS[prim.GetTypeName()](document, prim, material or inherited)


def _instancer(
    document: Document,
    prim: Usd.Prim,
    placement: Matrix,
    inherited: UsdShade.Material | None,
    depth: int,
) -> list[tuple[Content, Floats]]:
    """Return the prototypes of a PointInstancer with the transforms that place them."""
    instancer = UsdGeom.PointInstancer(prim)
    indices = document.array(prim, "protoIndices", 0, np.int64)
    targets = instancer.GetPrototypesRel().GetTargets()
    roots = [document.stage.GetPrimAtPath(path) for path in targets]
    if indices is None or not len(indices) or not roots:
        return []
    budget.take_parts(len(indices), "instances", document.file)
    budget.take(BYTES * len(indices), "instances", document.file)
    matrices, there = _transforms(document, instancer, len(indices))
    if len(matrices) != len(indices):
        document.warn("left out: its arrays are not of one length", prim.GetPath())
        return []
    matrices = placement @ matrices
    copies = []
    for number, root in enumerate(roots):
        own = matrices[there & (indices == number)]
        if not root or not len(own):
            continue
        above = transforms.inverse(document.placement(root.GetParent()))
        key = (
            "content",
            document.code,
            str(root.GetPath()),
            str(inherited.GetPath()) if inherited else "",
        )
        make = partial(content, document, root, above, inherited, depth + 1)
        inner = document.once(key, make)
        copies.append((inner, own))
    return copies


def _transforms(
    document: Document, instancer: UsdGeom.PointInstancer, count: int
) -> tuple[Floats, NDArray[np.bool_]]:
    """Return the transforms of instances (n, 4, 4), and which are shown, (count,)."""
    whole = instancer.ComputeInstanceTransformsAtTime(
        document.time, document.time, UsdGeom.PointInstancer.ExcludeProtoXform,
        UsdGeom.PointInstancer.IgnoreMask,
    )  # fmt: skip
    mask = instancer.ComputeMaskAtTime(document.time)
    there = np.array(list(mask), bool) if len(mask) else np.ones(count, bool)
    return np.array(whole, np.float64).reshape(-1, 4, 4).swapaxes(1, 2), there


def placed(document: Document, whole: Content) -> list[Shape]:
    """Return the shapes of a world's content; many copies of many triangles as instances."""
    shapes = []
    for prim, shape, matrix in whole.shapes:
        shapes += at(document, prim, shape, document.to_metres @ matrix)
    for inner, matrices in whole.copies:
        parts = inner.flat().shapes
        budget.take_parts(len(matrices), "instances", document.file)
        triangles = sum(len(one.faces) if isinstance(one, Mesh) else 1 for _, one, _ in parts)
        world = document.to_metres @ matrices
        if triangles * (len(matrices) - 1) < INSTANCED:
            for prim, shape, local in parts:
                for matrix in world:
                    shapes += at(document, prim, shape, matrix @ local)
            continue
        sizes = np.linalg.svd(world[:, :3, :3], compute_uv=False)
        uneven = world[int(np.argmax(sizes[:, 0] / np.maximum(sizes[:, 2], 1e-300)))]
        own = [
            moved
            for prim, one, local in parts
            for moved in at(document, prim, quadrics.under(one, uneven @ local), local)
        ]
        group = Group(tuple(own), parts[0][0].GetName())
        solid = world[~transforms.are_singular(world)]
        shapes += [Instance(group=group, to_world=matrix) for matrix in solid]
    return shapes


def at(document: Document, prim: Usd.Prim, shape: Shape, matrix: Matrix) -> list[Shape]:
    """Return a shape under a transform; none, with a warning, where that flattens space."""
    if transforms.is_singular(matrix):
        document.warn("left out, as its transform flattens space", prim.GetPath())
        return []
    whole = matrix @ np.asarray(shape.to_world)
    return [dataclasses.replace(quadrics.under(shape, whole), to_world=whole)]
