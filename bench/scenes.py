"""The scenes that renders are timed on, as Mitsuba XML that both renderers read.

python -m bench.scenes FOLDER writes cornell.xml, atrium.xml and glass.xml with their meshes: 256x256,
box filter, next-event estimation and MIS, path depth 8 (glass 12).
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import trimesh

from scenes.atrium.generate import atrium

HEAD = """<scene version="3.0.0">
  <default name="spp" value="64"/>
  <integrator type="path"><integer name="max_depth" value="{depth}"/></integrator>
  <sensor type="perspective">
    <float name="fov" value="{fov}"/>
    <transform name="to_world"><lookat origin="{origin}" target="{target}" up="0, 1, 0"/></transform>
    <sampler type="independent"><integer name="sample_count" value="$spp"/></sampler>
    <film type="hdrfilm">
      <integer name="width" value="256"/><integer name="height" value="256"/>
      <rfilter type="box"/>
    </film>
  </sensor>
"""

CORNELL = """
  <bsdf type="twosided" id="white"><bsdf type="diffuse">
    <rgb name="reflectance" value="0.885809, 0.698859, 0.666422"/></bsdf></bsdf>
  <bsdf type="twosided" id="green"><bsdf type="diffuse">
    <rgb name="reflectance" value="0.105421, 0.37798, 0.076425"/></bsdf></bsdf>
  <bsdf type="twosided" id="red"><bsdf type="diffuse">
    <rgb name="reflectance" value="0.570068, 0.0430135, 0.0443706"/></bsdf></bsdf>
  <shape type="rectangle"><transform name="to_world"><scale x="0.23" y="0.19"/>
    <rotate x="1" angle="90"/><translate y="0.99" z="0.01"/></transform><ref id="white"/>
    <emitter type="area"><rgb name="radiance" value="18.387, 13.9873, 6.75357"/></emitter></shape>
  <shape type="rectangle"><transform name="to_world"><rotate x="1" angle="-90"/>
    <translate y="-1"/></transform><ref id="white"/></shape>
  <shape type="rectangle"><transform name="to_world"><rotate x="1" angle="90"/>
    <translate y="1"/></transform><ref id="white"/></shape>
  <shape type="rectangle"><transform name="to_world"><translate z="-1"/></transform>
    <ref id="white"/></shape>
  <shape type="rectangle"><transform name="to_world"><rotate y="1" angle="-90"/>
    <translate x="1"/></transform><ref id="green"/></shape>
  <shape type="rectangle"><transform name="to_world"><rotate y="1" angle="90"/>
    <translate x="-1"/></transform><ref id="red"/></shape>
  <shape type="cube"><transform name="to_world"><scale value="0.3"/><rotate y="1" angle="-17"/>
    <translate x="0.335" y="-0.7" z="0.38"/></transform><ref id="white"/></shape>
  <shape type="cube"><transform name="to_world"><scale x="0.3" y="0.61" z="0.3"/>
    <rotate y="1" angle="18.25"/><translate x="-0.33" y="-0.38" z="-0.28"/></transform>
    <ref id="white"/></shape>
"""

COLOURS = {
    "floor": (0.55, 0.5, 0.45),
    "walls": (0.6, 0.52, 0.42),
    "columns": (0.72, 0.69, 0.62),
    "curtains": (0.55, 0.08, 0.07),
    "foliage": (0.1, 0.32, 0.07),
    "vases": (0.25, 0.3, 0.5),
}
STONE = (0.62, 0.58, 0.5)


def mesh(name: str, bsdf: str) -> str:
    """One .ply with a material."""
    return f'  <shape type="ply"><string name="filename" value="{name}.ply"/>{bsdf}</shape>\n'


def diffuse(rgb: tuple[float, float, float]) -> str:
    """A two-sided diffuse material."""
    value = ", ".join(map(str, rgb))
    return (
        '<bsdf type="twosided"><bsdf type="diffuse">'
        f'<rgb name="reflectance" value="{value}"/></bsdf></bsdf>'
    )


def write_cornell(folder: Path) -> Path:
    """36 triangles, one light."""
    head = HEAD.format(depth=8, fov=39.3077, origin="0, 0, 3.9", target="0, 0, 0")
    return _write(folder / "cornell.xml", head + CORNELL)


def write_atrium(folder: Path) -> Path:
    """About 300,000 triangles under an even sky."""
    vertices, faces, parts = atrium()
    body = '  <emitter type="constant"><rgb name="radiance" value="1.0"/></emitter>\n'
    for part, chosen in parts.items():
        name = f"atrium_{part}"
        trimesh.Trimesh(vertices, faces[chosen], process=False).export(folder / f"{name}.ply")
        body += mesh(name, diffuse(COLOURS.get(part, STONE)))
    head = HEAD.format(depth=8, fov=75, origin="3, 5.5, 9", target="20, 5, 9")
    return _write(folder / "atrium.xml", head + body)


def write_glass(folder: Path) -> Path:
    """Glass balls of 82,000 triangles on a floor, lit from the side: caustics."""
    body = """  <shape type="rectangle"><transform name="to_world"><scale value="6"/>
    <rotate x="1" angle="-90"/></transform>"""
    body += diffuse((0.7, 0.7, 0.7)) + "</shape>\n"
    body += """  <emitter type="constant"><rgb name="radiance" value="0.2"/></emitter>
  <shape type="rectangle"><transform name="to_world"><scale value="1.2"/>
    <lookat origin="3, 4, 2" target="0, 0.5, 0" up="0, 1, 0"/></transform>
    <emitter type="area"><rgb name="radiance" value="14, 12, 10"/></emitter></shape>
"""
    glass = '<bsdf type="dielectric"><float name="int_ior" value="1.5"/></bsdf>'
    rng = np.random.default_rng(3)
    for i, (x, z, r) in enumerate([(0, 0, 0.7), (1.3, 0.5, 0.4), (-1.2, 0.6, 0.5), (0.3, 1.4, 0.3)]):
        ball = trimesh.creation.icosphere(subdivisions=5, radius=r)
        v = ball.vertices
        bumps = 1 + 0.04 * np.sin(v @ rng.normal(0, 9, (3, 3)) / r).sum(axis=1)[:, None] / 3
        ball.vertices = v * bumps + [x, r * 1.05, z]
        trimesh.Trimesh(ball.vertices, ball.faces, process=False).export(folder / f"glass_{i}.ply")
        body += mesh(f"glass_{i}", glass)
    head = HEAD.format(depth=12, fov=45, origin="0, 2.2, 5", target="0, 0.5, 0")
    return _write(folder / "glass.xml", head + body)


SCENES = {"cornell": write_cornell, "atrium": write_atrium, "glass": write_glass}


def _write(path: Path, text: str) -> Path:
    path.write_text(text + "</scene>\n")
    return path


if __name__ == "__main__":
    target = Path(sys.argv[1])
    target.mkdir(parents=True, exist_ok=True)
    for write in SCENES.values():
        print(write(target))
