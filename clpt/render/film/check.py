"""Rules of films: size, mode, filter and layers."""

from __future__ import annotations

from clpt.choices import AUTO
from clpt.errors import SceneError
from clpt.geometry.instancing import distinct
from clpt.render.film import colour, filters
from clpt.scene import Scene
from clpt.scene.integrators import HAVE_LAYERS, TIMED
from clpt.scene.layers import LAYERS

LARGEST = 1 << 26  # pixels of a film; its tiles are divided in float32, see kernels/film/film.cl


def check_film(scene: Scene) -> None:
    """Raise SceneError for a film that is too large, or that the scene cannot fill."""
    film = scene.film
    if film.mode == "rgb":
        asks = {"sensor": film.sensor != "cie1931", "bands": film.bands != 0}
        for name in (name for name, asked in asks.items() if asked):
            raise SceneError("needs the mode spectral, not rgb", where=f"film.{name}")
    width, height = film.size
    if width * height > LARGEST:
        raise SceneError(f"{width}x{height} are more than {LARGEST >> 20} Mi pixels", where="film")
    colour.output_matrix(film, film.mode)
    if not film.filter.is_constant:
        filters.integrals(film.filter)
    _check_layers(scene)
    if film.time_bins:
        _check_times(scene)


def _check_times(scene: Scene) -> None:
    """Raise SceneError where the times of light would not be known."""
    film, how = scene.film, scene.integrator
    where = "film.time_bins"
    if not isinstance(how, TIMED) or how.light_paths not in (0, AUTO):
        names = ", ".join(cls.kind for cls in TIMED)
        message = f"only paths from the camera have times: use {names}, without light_paths"
        raise SceneError(message, where=where)
    if film.filtering == "splatting":
        message = 'time_bins need samples that serve one pixel: leave it out, or "importance"'
        raise SceneError(message, where="film.filtering")
    media = [m for shape in distinct(scene.shapes) for m in (shape.interior, shape.exterior)]
    if any(m is not None and m.light is not None for m in (*media, scene.camera.medium)):
        raise SceneError("light of media that glow has no single time", where=where)


def _check_layers(scene: Scene) -> None:
    """Raise SceneError for layers that the integrator, the camera or the filter cannot make."""
    film, how = scene.film, scene.integrator
    if film.layers and not isinstance(how, HAVE_LAYERS):
        names = ", ".join(cls.kind for cls in HAVE_LAYERS)
        message = f"only the integrators {names} have layers, not {how.kind}"
        raise SceneError(message, where="film.layers")
    camera = scene.camera
    for name, possible in (("z", camera.has_axis), ("motion", camera.has_screen)):
        if name in film.layers and not possible:
            lacks = "axis for z: ask for depth" if name == "z" else "projection for motion"
            raise SceneError(f"the camera {camera.kind} has no {lacks}", where="film.layers")
    lights = [name for name in film.layers if LAYERS[name].form == "light"]
    if how.merging and "light_groups" in lights:
        message = "photons do not know their group: leave light_groups out, or vcm.merging"
        raise SceneError(message, where="film.layers")
    if lights and film.filtering == "splatting":
        message = f'{lights[0]} needs samples that serve one pixel: leave it out, or "importance"'
        raise SceneError(message, where="film.filtering")
