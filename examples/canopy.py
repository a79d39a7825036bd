"""Light under a canopy of leaves: its spectrum above and below, the photons that plants use."""

import dataclasses
from argparse import ArgumentParser
from pathlib import Path

import numpy as np

import clpt
from clpt import transforms as tf
from clpt.scene import Film, Scene, cameras, lights, materials, shapes
from clpt.scene.integrators import Path as PathTracer
from clpt.spectra import Tabulated

SIDE, LOW, HIGH = 12.0, 1.5, 3.0  # of the layer of leaves [m]
INDEX, LEAF = 2.0, 0.05  # area of leaves over that of the ground, and a leaf's radius [m]
RED, FAR_RED = (650.0, 670.0), (720.0, 740.0)  # [nm]

# a green leaf: chlorophyll absorbs blue and red, and little beyond 700 nm
LAMBDAS = [400, 480, 520, 550, 580, 630, 670, 690, 710, 730, 760, 830]
REFLECTED = [0.05, 0.05, 0.08, 0.12, 0.09, 0.06, 0.05, 0.06, 0.22, 0.38, 0.46, 0.47]
PASSED = [0.01, 0.01, 0.05, 0.11, 0.07, 0.04, 0.02, 0.04, 0.22, 0.37, 0.45, 0.46]


def leaves(rng: np.random.Generator) -> shapes.Mesh:
    """Return hexagons, evenly in the layer, whose normals point evenly to all sides."""
    count = int(INDEX * SIDE**2 / (1.5 * np.sqrt(3) * LEAF**2))
    middles = rng.uniform([-SIDE / 2, LOW, -SIDE / 2], [SIDE / 2, HIGH, SIDE / 2], (count, 3))
    normals = rng.normal(size=(count, 3))
    across = np.cross(normals, rng.normal(size=(count, 3)))
    along = np.cross(normals, across)
    across, along = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in (across, along))
    angles = np.arange(6) * np.pi / 3
    corners = middles[:, None] + LEAF * (
        np.cos(angles)[:, None] * across[:, None] + np.sin(angles)[:, None] * along[:, None]
    )
    fans = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]])
    faces = (6 * np.arange(count)[:, None, None] + fans).reshape(-1, 3)
    green = materials.DiffuseTransmission(
        reflectance=Tabulated(LAMBDAS, REFLECTED), transmittance=Tabulated(LAMBDAS, PASSED)
    )
    return shapes.Mesh(vertices=np.float32(corners.reshape(-1, 3)), faces=faces, material=green)


def photons(spectrum, ends: tuple[float, float]) -> float:
    """Return the photons of a range of wavelengths, in some unit, of a spectral irradiance."""
    inside = (spectrum.wavelengths > ends[0]) & (spectrum.wavelengths < ends[1])
    return float((spectrum.values.mean(axis=0) * spectrum.wavelengths)[inside].sum())


arguments = ArgumentParser(description=__doc__)
arguments.add_argument("folder", type=Path, nargs="?", default=".", help="gets the picture")
file = arguments.parse_args().folder / "canopy.png"
soil = materials.Diffuse(reflectance=0.15)
ground = shapes.Rectangle(to_world=tf.rotate([1, 0, 0], -90) @ tf.scale(SIDE), material=soil)
scene = Scene(
    camera=cameras.Perspective(to_world=tf.look_at([0, 0.3, 0], [1.5, 2.5, 1], [0, 1, 0]), fov=70),
    shapes=[ground, leaves(np.random.default_rng(5))],
    lights=[lights.Sky(sun_elevation=50.0)],
    film=Film(size=(240, 160), lambda_min=400.0, lambda_max=800.0),
    integrator=PathTracer(max_depth=12, light_paths=0),
)
rng = np.random.default_rng(1)
at = np.stack([*rng.uniform(-2, 2, (2, 24))], axis=1)
for name, height in (("above", HIGH + 0.5), ("below", 0.2)):
    points = np.insert(at, 1, height, axis=1)
    spectrum = clpt.measure(scene, "spectral_irradiance", points, bands=40, samples=128)
    useful = clpt.measure(scene, "photon_flux_density", points, samples=128)
    ratio = photons(spectrum, RED) / photons(spectrum, FAR_RED)
    print(f"{name}: {useful.values.mean():.0f} {useful.unit}, red over far red {ratio:.2f}")
picture = dataclasses.replace(scene, spp=32)
clpt.write_image(file, clpt.render(picture), exposure="auto")
print(f"wrote {file}")
