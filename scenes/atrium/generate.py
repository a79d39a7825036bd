"""Writes the meshes that scene.json is made of, 8 MB; `clpt.bench.atrium` has the formulas.

python scenes/atrium/generate.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh

from clpt.bench.atrium import atrium


def main() -> None:
    """Write every part as a .ply beside this script, where scene.json looks for them."""
    folder = Path(__file__).parent
    vertices, faces, parts = atrium()
    del parts["floor"]  # a rectangle in scene.json, where it has texture coordinates
    for name, which in parts.items():
        used, own = np.unique(faces[which], return_inverse=True)
        mesh = trimesh.Trimesh(vertices[used], own.reshape(-1, 3), process=False)
        mesh.update_faces(mesh.nondegenerate_faces())  # at the poles of the lamps
        mesh.export(folder / f"{name}.ply", vertex_normal=True)  # the grids are smooth
        print(f"{name}.ply: {len(mesh.faces):,} triangles")


if __name__ == "__main__":
    main()
