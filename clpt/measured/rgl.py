"""Files of Dupuy and Jakob's laboratory (.bsdf): a Measurement as a tensor file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from clpt.errors import SceneError
from clpt.measured import tensor_file
from clpt.measured.measurement import Measurement

TABLES = ("phi_i", "theta_i", "ndf", "sigma", "vndf", "luminance")


def read(path: str | Path) -> Measurement:
    """Read a measured material. Raises SceneError for what is none, naming the field."""
    fields = tensor_file.read(path)
    try:
        return _measurement(fields)
    except SceneError as error:
        raise SceneError(error.message, file=Path(path)) from None


def _measurement(fields: dict[str, np.ndarray]) -> Measurement:
    colours = "spectra" if "spectra" in fields else "rgb"
    needed = [*TABLES, colours, *(["wavelengths"] if colours == "spectra" else [])]
    for name in needed:
        if name not in fields:
            known = ", ".join(map(repr, fields)) or "none"
            raise SceneError(f"has no field {name!r}; it has {known}")
        if fields[name].dtype.kind != "f":
            raise SceneError(f"the field {name!r} must be of floats, not {fields[name].dtype}")
    flag = fields.get("jacobian", np.ones(1, np.uint8))
    if flag.size != 1:
        raise SceneError(f"the field 'jacobian' must be one number, not {flag.shape}")
    text = fields.get("description", np.zeros(0, np.uint8))
    return Measurement(
        **{name: fields[name] for name in TABLES},
        spectra=fields[colours],
        wavelengths=fields["wavelengths"] if colours == "spectra" else np.zeros(0),
        jacobian=bool(flag.reshape(-1)[0]),
        description=text.astype(np.uint8).tobytes().decode("utf8", "replace"),
    )


def write(path: str | Path, measurement: Measurement) -> None:
    """Write a measured material, so that `read` gives it back. Raises SceneError."""
    spectral = len(measurement.wavelengths) > 0
    fields = {
        "description": np.frombuffer(measurement.description.encode(), np.uint8),
        "jacobian": np.array([measurement.jacobian], np.uint8),
        **{name: vars(measurement)[name] for name in TABLES},
        **({"wavelengths": measurement.wavelengths} if spectral else {}),
        "spectra" if spectral else "rgb": measurement.spectra,
    }
    try:
        tensor_file.write(path, fields)
    except OSError as error:
        raise SceneError(f"cannot be written: {error.strerror}", file=Path(path)) from None
