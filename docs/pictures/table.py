"""Every picture of a kind, by category and kind as `clpt.scene.KINDS` has them."""

from __future__ import annotations

from pathlib import Path

from .cameras import CAMERAS
from .integrators import FILTERS, INTEGRATORS, SAMPLERS
from .lights import LIGHTS
from .materials import MATERIALS
from .media import MEDIA, PHASES
from .shapes import SHAPES
from .studio import Picture
from .textures import TEXTURES

FOLDER = Path(__file__).parent / "kinds"
CAPTIONS = FOLDER / "captions.json"  # for clpt.formats.native.reference, which imports none of this
PICTURES = {
    "material": MATERIALS,
    "medium": MEDIA,
    "phase": PHASES,
    "light": LIGHTS,
    "shape": SHAPES,
    "camera": CAMERAS,
    "texture": TEXTURES,
    "integrator": INTEGRATORS,
    "sampler": SAMPLERS,
    "filter": FILTERS,
}


def file(name: str) -> Path:
    """Return where the picture of a kind is stored."""
    return FOLDER / f"{name}.webp"


def pictures() -> dict[str, Picture]:
    return {f"{category}/{kind}": p for category, ps in PICTURES.items() for kind, p in ps.items()}
