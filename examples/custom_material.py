"""A material that clpt does not have: velvet, whose fibres stand up and light up at its edges.

A material is a dataclass with parameters, and OpenCL functions that sample and evaluate it.
"""

from argparse import ArgumentParser
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import clpt
from clpt.scene import Film, cameras, lights, materials, shapes
from clpt.scene.params import real, reflectance
from clpt.transforms import look_at


@dataclass(frozen=True, kw_only=True, eq=False)
class Velvet(materials.Material):
    """Fibres that stand about the normal (Estevez and Kulla 2017), on the front."""

    colour: Any = reflectance(0.7, "of the fibres")
    roughness: Any = real(0.4, "how far they lean", low=0.1, high=1.0, textured=True)

    source = """
    real velvet_pdf(Velvet m, vec3 wo, vec3 wi) /* every direction of the front alike */
    {
        return sel((wo.z > 0.0f) & (wi.z > 0.0f), (real)(INV_2PI), (real)(0.0f));
    }

    Spectrum velvet_eval(Velvet m, vec3 wo, vec3 wi) /* f |cos| [1/sr] */
    {
        vec3 h = normalize3(add3(wo, wi));
        real exponent = 1.0f / m.roughness, sin2 = max_r(1.0f - h.z * h.z, (real)(0.0f));
        real d = (2.0f + exponent) * pow_r(sin2, 0.5f * exponent) * INV_2PI;
        real room = 4.0f * (wo.z + wi.z - wo.z * wi.z); /* Neubelt and Pettineo 2013 */
        mask front = (wo.z > 0.0f) & (wi.z > 0.0f);
        real f = d * wi.z / max_r(room, (real)(1e-6f));
        return spectrum_scale(m.colour, sel(front, f, (real)(0.0f)));
    }

    BsdfSample velvet_sample(Velvet m, vec3 wo, vec3 u)
    {
        BsdfSample s = bsdf_nothing();
        vec2 uv = {0.5f * u.x, u.y}; /* the upper half of the sphere */
        s.wi = uniform_sphere(uv);
        s.pdf = velvet_pdf(m, wo, s.wi);
        s.weight = spectrum_scale(velvet_eval(m, wo, s.wi), 2.0f * PI);
        return s;
    }
    Spectrum velvet_albedo(Velvet m) { return m.colour; }
    """


def cloth(material: materials.Material, x: float) -> shapes.Mesh:
    """Return a hanging cloth with folds, two metres wide."""
    u, v = np.meshgrid(np.linspace(-1, 1, 161), np.linspace(0, 1, 81))
    depth = 0.12 * np.sin(9 * u + 1.5 * v) * (0.3 + v) + 0.05 * np.sin(21 * u - 2 * v)
    i = (np.arange(80)[:, None] * 161 + np.arange(160)).ravel()
    faces = [np.stack([i, i + a, i + b], 1) for a, b in ((162, 1), (161, 162))]
    points = {"vertices": np.stack([u + x, 2.4 - 2.4 * v, depth], -1).reshape(-1, 3)}
    return shapes.Mesh(**points, faces=np.concatenate(faces), normals="smooth", material=material)


def scene() -> clpt.Scene:
    """Two cloths of one colour: plain paint, and velvet."""
    paint, lamp = materials.Diffuse(reflectance=(0.45, 0.04, 0.07)), lights.Area(radiance=(9, 8, 7))
    cloths = [cloth(paint, -1.15), cloth(Velvet(colour=(0.9, 0.1, 0.15)), 1.15)]
    above = look_at((-3, 4, 4), (0, 1, 0), (0, 1, 0))
    camera = cameras.Perspective(to_world=look_at((0, 1.4, 7), (0, 1.2, 0), (0, 1, 0)), fov=42)
    things = [*cloths, shapes.Rectangle(to_world=above, emission=lamp)]
    sky = lights.Constant(radiance=0.35)
    return clpt.Scene(camera=camera, shapes=things, lights=[sky], film=Film(size=(384, 216)))


if __name__ == "__main__":
    arguments = ArgumentParser(description=__doc__)
    arguments.add_argument("folder", type=Path, nargs="?", default=".", help="gets the picture")
    picture = arguments.parse_args().folder / "custom_material.png"
    clpt.write_image(picture, clpt.render(scene(), spp=64), tone="agx")
    print(f"wrote {picture}")
