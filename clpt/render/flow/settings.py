"""The settings of a lowered scene: what holds for a whole render, whatever the device."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from clpt.records import SETTINGS
from clpt.render.film.colour import film_scale, output_matrix
from clpt.render.geometry.find import Geometry
from clpt.render.lights.encode import LightRows, light_level
from clpt.render.records import Features, LayerFeatures
from clpt.render.scene_index import SceneIndex
from clpt.render.spectra.find import Density
from clpt.render.transport import light_caches
from clpt.scene.integrators import DEEPEST, LIGHT_SPEED, Vcm
from clpt.scene.params import fields_of
from clpt.spectra.cie import tanh_ends

LARGEST = 62  # exponent of 4 of a unit of areas, which is float32
ORDINARY_SIZE = 10  # exponent of 2 of the radius of a scene [m], up and down
SQUARE = 8  # pixels of a side; it holds whole groups of paths: kernels/transport/reuse.cl
MOST_SAMPLE_BITS = 16  # of a zsobol pixel's part of its sequence


def settings_of(
    index: SceneIndex,
    geometry: Geometry,
    lights: LightRows,
    density: Density,
    sphere: tuple[NDArray[np.float64], float],
    layers: LayerFeatures,
    features: Features,
) -> NDArray[np.void]:
    """Return the record SETTINGS of a scene, without indices of tables.

    The wavefront adds settings of the device. density: of wavelengths; sphere: centre and radius of
    a sphere around the scene [m]; layers: of the film.
    """
    settings = np.zeros((), SETTINGS.dtype)
    _set_film(settings, index, features.film.reuse)
    _set_paths(settings, index)
    if index.merged:
        _set_photons(settings, index, geometry, sphere[1], features.dispersion)
    if index.guided:
        paths = settings["guide_paths"] = index.integrator.guide_paths or light_caches.GUIDE_PATHS
        settings["photon_cells"], side = light_caches.guide_cells_for(paths)
        settings["guide_side"] = side * sphere[1]
    settings["mis_area_unit"] = mis_area_unit(sphere[1])
    settings["light_count"] = len(lights.rows)
    settings["infinite_count"] = lights.sources.infinite
    settings["first_analytic"] = geometry.first_analytic
    settings["analytic_count"] = len(geometry.boxes)
    settings["single_count"] = geometry.single_count
    settings["shape_count"] = len(geometry.rows)
    settings["tanh_min"], settings["tanh_max"] = tanh_ends(density.lo, density.hi)
    film = index.film
    matrix = output_matrix(film, index.mode)
    scale = settings["film_scale"] = film_scale(film, light_level(index, lights.sources, sphere))
    settings["to_first"], settings["to_second"], settings["to_third"] = matrix / scale
    settings["center"], settings["scene_radius"] = sphere
    _set_layers(settings, layers)
    return settings


def _set_film(settings: NDArray[np.void], index: SceneIndex, shares: bool) -> None:
    """Write the size of the film, and which of its pixels and wavelengths are rendered."""
    film = index.film
    width, height = film.size
    settings["width"], settings["height"] = width, height
    settings["crop_x"], settings["crop_y"] = (0, 0) if film.crop is None else film.crop[:2]
    settings["film_width"], settings["film_height"] = film.width, film.height
    margin = settings["margin"] = 0 if index.light_paths else _margin(index, shares)
    settings["tiles_x"] = -(-(width + 2 * margin) // 4)
    settings["padded_pixels"] = 16 * settings["tiles_x"] * -(-(height + 2 * margin) // 4)
    settings["alpha"] = index.film.alpha
    settings["lambda_min"], settings["lambda_max"] = film.lambda_min, film.lambda_max
    settings["bands"] = film.bands


def _margin(index: SceneIndex, shares: bool) -> int:
    """Return how far samples go beyond the picture: to whole squares where paths have groups.

    Every crop of a film has the same: the numbers of a pixel depend on it.
    """
    return index.filter_reach + (SQUARE - 1) * shares


def _set_paths(settings: NDArray[np.void], index: SceneIndex) -> None:
    """Write the settings of the sampler and the integrator."""
    integrator = index.integrator
    settings["seed"] = index.seed
    settings["sample_bits"] = min((max(index.spp, 1) - 1).bit_length(), MOST_SAMPLE_BITS)
    depth = integrator.max_depth
    settings["max_depth"] = DEEPEST if depth < 0 else min(depth, DEEPEST)
    settings["rr_depth"] = min(integrator.rr_depth, DEEPEST)
    settings["hide_lights"] = integrator.hide_lights
    settings["light_paths"] = index.weighed


def _set_layers(settings: NDArray[np.void], layers: LayerFeatures) -> None:
    """Write the words and indices of the film's layers."""
    for name, place in layers.places.items():
        settings[f"layer_{name}"] = place
    settings["layer_denoising"], settings["layer_words"] = layers.first_for_denoisers, layers.words
    settings["mattes"], settings["material_numbers"] = len(layers.mattes), layers.material_numbers
    settings["primitive_rows"] = layers.primitive_rows
    settings["matte_object"] = layers.matte_of_objects
    settings["matte_material"] = layers.matte_of_materials
    settings["layer_direct"], settings["layer_indirect"] = layers.direct, layers.indirect
    settings["layer_groups"], settings["light_groups"] = layers.groups, layers.light_group_row or 0
    settings["layer_times"] = layers.times


def set_times(
    settings: NDArray[np.void], index: SceneIndex, camera_index: float, slope: float
) -> None:
    """Write which optical lengths the bins of a film are.

    camera_index, slope: of the index of refraction at the camera's place.
    """
    settings["camera_slope"] = slope
    film, planes = index.film, fields_of(index.camera)
    settings["time_bins"] = film.time_bins
    settings["time_first"] = film.time_min * LIGHT_SPEED / camera_index
    length = (film.time_max - film.time_min) * LIGHT_SPEED / camera_index
    settings["time_rate"] = film.time_bins / length
    if "near" in planes:  # the lens is before the origins of the camera's rays
        settings["near_share"] = planes["near"] / (planes["far"] - planes["near"])


def mis_area_unit(scene_radius: float) -> float:
    """Return the unit of areas in MIS ratios of light paths [m^2], a power of two.

    It is 1 for scenes of ordinary size, and scales larger and smaller scenes to ordinary size.
    """
    exponent = math.frexp(scene_radius)[1]
    beyond = exponent - min(max(exponent, -ORDINARY_SIZE), ORDINARY_SIZE)
    return 4.0 ** min(max(beyond, -LARGEST), LARGEST)


def _set_photons(
    settings: NDArray[np.void],
    index: SceneIndex,
    geometry: Geometry,
    scene_radius: float,
    disperses: bool,
) -> None:
    """Write the settings of photons; the wavefront adds the number of their light paths."""
    integrator, film = index.integrator, index.film
    assert isinstance(integrator, Vcm)
    settings["max_depth"] = min(int(settings["max_depth"]), light_caches.DEEPEST)
    settings["radius"] = integrator.radius or light_caches.first_radius(
        index.camera, geometry, (film.width, film.height), scene_radius
    )
    settings["photon_places"] = light_caches.photon_places(integrator)
    held = light_caches.photon_pixels(integrator, int(settings["padded_pixels"]))
    settings["photon_pixels"] = held
    cells = max(held * integrator.light_paths, light_caches.FEWEST_CELLS)
    settings["photon_cells"] = 1 << (cells - 1).bit_length()
    suited = light_caches.GROUPS if disperses else light_caches.FEW_GROUPS
    groups = integrator.wavelength_groups or suited
    settings["wavelength_groups"] = groups if index.spectral else 1
