"""A check of scatterers: none may send on more light than it receives."""

from __future__ import annotations

from typing import Any

import numpy as np

from clpt.errors import SceneError
from clpt.spectra import Reradiation

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
