"""Volumes: the density of an OpenVDB field."""

from __future__ import annotations

import numpy as np
from pxr import Usd

from clpt.arrays import Matrix
from clpt.errors import SceneError
from clpt.formats import volumes
from clpt.formats.framing import TO_BOX
from clpt.formats.usd import packages
from clpt.formats.usd.document import Document
from clpt.scene.materials import Null
from clpt.scene.media import Grid
from clpt.scene.shapes import Cube, Shape

ALBEDO = 0.9  # of smoke between white and grey; a stage does not say


def volume(document: Document, prim: Usd.Prim, placement: Matrix) -> list[Shape]:
    """Return a box that holds a density, in a list; none, with a warning, where none can be read.

    placement: to the world, in units of the stage. A density of 1 is an extinction of 1 for each
    unit of the stage.
    """
    fields = {
        relation.GetName().partition(":")[2]: relation.GetTargets()
        for relation in prim.GetRelationships()
        if relation.GetName().startswith("field:")
    }
    for name in fields.keys() - {"density"}:
        document.warn(f"field {name!r} is left out", prim.GetPath())
    source = document.stage.GetPrimAtPath(fields["density"][0]) if fields.get("density") else None
    if not source or source.GetTypeName() != "OpenVDBAsset":
        document.warn("left out, as it has no density of OpenVDB", prim.GetPath())
        return []
    asset = document.value(source, "filePath")
    try:
        file = packages.file_of(document, asset)
        density = volumes.read(file, str(document.value(source, "fieldName", "density")))
    except (SceneError, AttributeError) as error:
        document.warn(f"left out: {error}", prim.GetPath())
        return []
    cloud = Grid(
        density=density,
        sigma_t=1.0 / document.metres,
        albedo=ALBEDO,
        to_world=document.to_metres @ placement,
    )
    matrix = document.to_metres @ placement @ np.asarray(density.to_world, np.float64)
    box = Cube(to_world=matrix @ TO_BOX, material=Null(), name=prim.GetName(), interior=cloud)
    return [box]
