"""Messages to viewers as JSON, which has no infinity."""

from __future__ import annotations

import json
import math
from typing import Any


def as_json(message: Any) -> str:
    """Return a message as JSON; what is no finite number is null."""
    try:
        return json.dumps(message, allow_nan=False)
    except ValueError:
        return json.dumps(finite(message))


def finite(value: Any) -> Any:
    """Return a message in which what is no finite number is None."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: finite(child) for key, child in value.items()}
    return [finite(child) for child in value] if isinstance(value, (list, tuple)) else value
