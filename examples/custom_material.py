"""A material that clpt does not have: velvet, whose fibres stand up and light up at its edges.

A material is a dataclass with parameters, and OpenCL functions that sample and evaluate it. It is
used as any of clpt's own: textured, spectral or rgb, below a mask or a blend.
"""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import clpt
from clpt.scene import Film, cameras, lights, materials, shapes, textures
from clpt.scene.params import real, reflectance
from clpt.transforms import look_at, rotate, scale


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


def scene() -> clpt.Scene:
    """Three balls: plain paint, velvet, and velvet woven with paint."""
    paint = materials.Diffuse(reflectance=(0.35, 0.03, 0.05))
    velvet = Velvet(colour=(0.9, 0.1, 0.15), roughness=0.3)
    board = textures.Checkerboard(color0=1.0, color1=0.0, to_uv=np.diag([16.0, 8.0, 1.0]))
    woven = materials.Blend(first=paint, second=velvet, weight=board)
    placed = [
        shapes.Sphere(center=(x, 1.0, 0.0), radius=1.0, material=m)
        for x, m in ((-2.1, paint), (0.0, velvet), (2.1, woven))
    ]
    return clpt.Scene(
        camera=cameras.Perspective(to_world=look_at((0, 2, 8), (0, 0.9, 0), (0, 1, 0)), fov=46),
        shapes=[*placed, shapes.Rectangle(to_world=rotate((1, 0, 0), -90) @ scale(20.0))],
        lights=[lights.Constant()],
        film=Film(width=384, height=192),
    )


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    clpt.write_image(folder / "custom_material.png", clpt.render(scene(), spp=64))
