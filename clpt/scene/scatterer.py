"""The base of materials and phase functions."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from clpt.errors import SceneError
from clpt.scene.params import Kind, fields_of
from clpt.spectra import Reradiation


@dataclass(frozen=True, kw_only=True, eq=False)
class Scatterer(Kind):
    """Base of materials and phase functions, with the properties that kernels depend on."""

    folder: ClassVar[str] = "materials/kinds"  # of its file in the kernels folder
    is_phase: ClassVar[bool] = False  # it scatters in a medium, not at a surface
    source: ClassVar[str | Path | None] = None
    delta: ClassVar[bool] = (
        False  # all its lobes are delta functions: no light can be sampled through it
    )
    uses_lobe_sample: ClassVar[bool] = False  # `sample` uses u.z
    has_diffuse_lobe: ClassVar[bool] = False  # alone, or below a coat: paths of pixels share it
    chromatic: ClassVar[bool] = False  # the pdf differs between wavelengths: it has `pdfs`
    lobes_apart: ClassVar[bool] = (
        False  # a direction has light of a single lobe, if a lobe refracts
    )
    disperses: ClassVar[bool] = False  # whatever its parameters, directions depend on wavelength
    refracts: ClassVar[bool] = False  # they do so where a parameter of the role index does
    has_across: ClassVar[bool] = False  # a source has `across`; clpt's kinds need not say so
    fluoresces: ClassVar[bool] = False  # light may leave at another wavelength: it has `shift`
    is_null: ClassVar[bool] = False  # light goes on as if nothing were there, to lights as well
    is_pane: ClassVar[bool] = False  # what it lets through goes straight on: `free_panes`
    no_back: ClassVar[bool] = False  # its back is not there
    absorbs: ClassVar[bool] = False  # all light, where its albedo is 0: none is sought there
    reversible: ClassVar[bool] = True  # light that comes the other way takes the same paths
    two_sided: ClassVar[bool] = False  # it shades the back of a surface like a front
    perturbs_normals: ClassVar[bool] = False  # `shading` has other normals

    @property
    def transmits(self) -> bool:
        """Whether light goes through it."""
        return False

    @property
    def absorbs_inside(self) -> bool:
        """Whether the body behind its surface absorbs light."""
        return False

    def shading(self, front: bool) -> Scatterer:
        """Return the scatterer inside it that shades a side of a surface; else itself."""
        return self

    @property
    def mixture(self) -> tuple[Any, Scatterer, Scatterer] | None:
        """The share of the second scatterer, and both scatterers that it mixes; None: no mixture.

        The share is a number or a texture.
        """
        return None

    turning_lobe: ClassVar[str] = "anisotropy"  # the parameter whose lobe a rotation turns

    @property
    def directing(self) -> tuple[object, ...]:
        """The values or textures of a coat's normals, and of directions along the surface."""
        return ()

    @property
    def uses_tangents(self) -> bool:
        """Whether its scattering depends on the direction of the tangent."""
        values = fields_of(self)
        u, v = values.get("alpha_u"), values.get("alpha_v")
        return u is not v and u != v


MEASURED = 0.02  # how much more light than comes may leave, by the noise of a measurement


def check_reradiation(kind: str, elastic: Any, reradiation: Reradiation, amount: float) -> None:
    """Raise SceneError where `elastic`, a spectrum, and `amount` of a matrix send on too much."""
    into = reradiation.table[1]
    total = elastic.sample(into) + amount * reradiation.emitted(into)
    most = int(np.argmax(total))
    if total[most] > 1.0 + MEASURED:
        raise SceneError(
            f"of the light at {into[most]:g} nm, {total[most]:.3f} would leave; "
            "lower the reflectance, the yield or the amount",
            where=f"{kind}.reradiation",
        )
