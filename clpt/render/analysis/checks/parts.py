"""Rules of the parts of a scene, each by itself."""

from __future__ import annotations

from clpt.render.analysis.checks.cameras import check_camera
from clpt.render.analysis.checks.lights import check_light
from clpt.render.analysis.checks.materials import check_material
from clpt.render.analysis.checks.shapes import check_shapes
from clpt.render.analysis.checks.textures import check_textures
from clpt.scene.cameras import Camera
from clpt.scene.lights import ON_SHAPES, Light
from clpt.scene.materials import Material
from clpt.scene.params import Kind
from clpt.scene.shapes import Shape


def check_part(part: Kind) -> None:
    """Raise SceneError for a part that no scene can have; of a camera, with a square film."""
    if isinstance(part, Shape):
        check_shapes([part])
    elif isinstance(part, Camera):
        check_camera(part, 1, 1)
    elif isinstance(part, Material):
        check_material(part, "spectral")
    elif isinstance(part, ON_SHAPES):
        check_textures(part)
    elif isinstance(part, Light):
        check_light(part)
