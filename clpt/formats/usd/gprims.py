"""Gprims as shapes: meshes, and what is instanced."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
from pxr import Usd, UsdShade

from clpt import transforms
from clpt.arrays import Matrix
from clpt.files import budget
from clpt.formats.usd import meshes
from clpt.formats.usd.document import Document
from clpt.formats.usd.walk import Shown
from clpt.scene.shapes import Shape

Reader = Callable[[Document, Usd.Prim, "UsdShade.Material | None"], list]
READERS: dict[str, Reader] = {"Mesh": meshes.meshes}


def shapes(document: Document, shown: Shown) -> list[Shape]:
    """Return the shapes of what a stage shows, in the world."""
    placed: list[Shape] = []
    for prim, parts in local_shapes(document, shown["gprims"]):
        matrix = document.to_metres @ document.placement(prim)
        placed += [moved for part in parts for moved in at(document, prim, part, matrix)]
    return placed


def local_shapes(document: Document, prims: list[Usd.Prim]) -> list[tuple[Usd.Prim, list[Shape]]]:
    """Return prims and their shapes, each in its prim's own space."""
    budget.take_parts(len(prims), "prims", document.file)
    bound = UsdShade.MaterialBindingAPI.ComputeBoundMaterials(prims)[0] if prims else []
    pairs = []
    for prim, material in zip(prims, bound, strict=True):
        reader = READERS.get(prim.GetTypeName())
        if reader is None:
            document.warn(f"{prim.GetTypeName()} is not read", prim.GetPath())
            continue
        pairs.append((prim, reader(document, prim, material if material else None)))
    return pairs


def at(document: Document, prim: Usd.Prim, shape: Shape, matrix: Matrix) -> list[Shape]:
    """Return a shape under a transform; none, with a warning, where that flattens space."""
    if transforms.is_singular(matrix):
        document.warn("left out, as its transform flattens space", prim.GetPath())
        return []
    whole = matrix @ np.asarray(shape.to_world)
    return [dataclasses.replace(shape, to_world=whole)]
