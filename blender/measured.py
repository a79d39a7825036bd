# SPDX-License-Identifier: GPL-3.0-or-later
"""What clpt's own panels say: substances, spectra, lamps by standard, drops, real lenses."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from .graphs import Json
from .textures import observer

GLASSES = (
    "n-bk7", "n-fk51a", "n-sk16", "n-bak4", "n-baf10", "n-lak8", "n-lak14", "n-lak22", "n-kzfs4",
    "n-f2", "n-sf2", "n-sf5", "n-sf6", "n-sf10", "n-sf11", "n-sf66", "n-lasf9", "n-lasf44", "pyrex",
    "fused silica", "water", "water ice", "ethanol", "glycerol", "acrylic glass", "polycarbonate",
    "polystyrene", "amber", "calcium fluoride", "magnesium fluoride", "quartz", "calcite",
    "sapphire", "rutile", "yag", "sodium chloride", "diamond",
)  # fmt: skip
METALS = (
    "gold", "silver", "copper", "aluminium", "iron", "brass", "chromium", "cobalt", "mercury",
    "molybdenum", "nickel", "palladium", "platinum", "rhodium", "titanium", "TiN", "vanadium",
    "tungsten", "silicon",
)  # fmt: skip
LAMPS = (
    "A", "D50", "D65", *(f"F{i}" for i in range(1, 13)), *(f"HP{i}" for i in range(1, 6)),
    *(f"LED-B{i}" for i in range(1, 6)), "LED-BH1", "LED-RGB1", "LED-V1", "LED-V2", "sodium",
    "mercury", "hydrogen", "E", "2700 K", "4000 K",
)  # fmt: skip
LENSES = (
    "double_gauss", "loewenthal", "panchro", "planar", "sonnar", "biogon", "distagon", "flektogon",
    "petzval", "fisheye",
)  # fmt: skip
PAIR = re.compile(r"^[\s\"]*([\d.eE+-]+)[\s,;:\t]+([\d.eE+-]+)")


def rows(text: str) -> list[list[float]]:
    """Return a typed spectrum, "400:0.1 700:0.6", or that of a file with columns, nm and values.

    Raises ValueError for a text without two numbers in some line.
    """
    lines = re.split(r"(?<=\d)\s+(?=[\d.]+\s*:)", text.strip())
    if not re.match(r"\s*[\d.]+\s*:", text):
        path = Path(bpy.path.abspath(text))
        lines = path.read_text("utf-8", "replace").splitlines() if path.is_file() else []
    found = [list(map(float, pair.groups())) for line in lines if (pair := PAIR.match(line))]
    found = sorted(row for row in found if 100.0 <= row[0] <= 4000.0)
    if len(found) < 2:
        raise ValueError(f"{text!r} is no spectrum: write 400:0.1 700:0.6, or name a file")
    return found


def spectrum(text: str) -> Any:
    """Return a spectrum of a reflectance or a coefficient: a number, typed, or of a file."""
    text = text.strip()
    return float(text) if re.fullmatch(r"[\d.]+", text) else {"values": rows(text)}


def _kelvin(text: str) -> float | None:
    """Return the temperature that a text such as 3000 K names, None for others."""
    found = re.fullmatch(r"\s*(\d+)\s*K\s*", text)
    return None if found is None else float(found[1])


def turbidity(haze: float) -> float:
    """Return the turbidity of haze, an optical depth: Angstrom's coefficient, Preetham 1999."""
    return (haze * 0.55**1.3 + 0.04586) / 0.04608


def haze(turbidity: float) -> float:
    """Return the optical depth of haze straight up at 550 nm, of a turbidity."""
    return max(0.04608 * turbidity - 0.04586, 0.0) / 0.55**1.3


def lamp(text: str, luminance: float) -> Json:
    """Return what a lamp emits: by a standard's name, in kelvin, typed, or by its data sheet."""
    text, kelvin = text.strip(), _kelvin(text)
    if kelvin is not None:
        return {"type": "blackbody", "kelvin": kelvin, "normalised": True, "scale": luminance}
    if text in LAMPS:
        return {"type": "illuminant", "name": text, "scale": luminance}
    table = np.array(rows(text))
    nm = np.arange(360.0, 831.0)
    shown = (np.interp(nm, *table.T, 0.0, 0.0) * observer(nm)[1]).sum() / observer(nm)[1].sum()
    table[:, 1] *= luminance / max(shown, 1e-12)
    return {"values": table.tolist()}


def surface(settings: Any) -> Json:
    """Return the material that a material's panel says; both sides are alike unless it is glass."""
    kind, rough = settings.kind, settings.roughness > 0.0
    facets = {"roughness": settings.roughness} if rough else {}
    film = {"layers": [{"eta": settings.film_ior, "thickness": settings.film_thickness}]}
    layers = film if settings.film_thickness > 0.0 else {}
    if kind == "GLASS":
        name = "rough_dielectric" if rough else "dielectric"
        inside = {"absorption": spectrum(settings.absorption)} if settings.absorption else {}
        return {
            "type": name, "int_ior": settings.glass, "ext_ior": "air", **facets, **layers, **inside,
        }  # fmt: skip
    if kind == "METAL":
        name = "rough_conductor" if rough else "conductor"
        front: Json = {"type": name, "metal": settings.metal, **facets, **layers}
    elif kind == "GRATING":
        front = {
            "type": "grating", "metal": settings.metal, "period": settings.period,
            "angle": float(np.degrees(settings.angle)), "depth": settings.depth,
        }  # fmt: skip
    elif kind == "FLUORESCENT":
        dye = {
            "type": "fluorophore", "quantum_yield": settings.quantum_yield,
            "absorption": _peak(settings.absorbed, settings.strength),
            "emission": _peak(settings.emitted, 1.0),
        }  # fmt: skip
        front = {"type": "fluorescent", "reflectance": spectrum(settings.spectrum or "0.1"),
                 "reradiation": dye}  # fmt: skip
    elif kind == "MEASURED":
        path = bpy.path.abspath(settings.file)
        front = {"type": "merl" if path.endswith(".binary") else "measured", "data": path}
    else:
        front = {"type": "diffuse", "reflectance": spectrum(settings.spectrum or "0.5")}
    return {"type": "two_sided", "front": front}


def _peak(nm: float, height: float) -> Json:
    """Return a bell of 60 nm around a wavelength."""
    axis = nm + np.linspace(-75.0, 75.0, 31)
    values = height * np.exp(-0.5 * ((axis - nm) / 25.0) ** 2)
    return {"values": np.column_stack([axis, values]).tolist()}


def drops(settings: Any, python: str) -> Json:
    """Return a medium of drops by Mie's theory, which clpt computes. Raises ValueError."""
    asked = (settings.radius, settings.spread, settings.share * 1e-6)
    command = [
        python, "-m", "clpt", "mie", str(asked[0]), "--spread", str(asked[1]), "--share",
        str(asked[2]), "--index", settings.drops, "-o", str(Path(bpy.app.tempdir) / "mie.json"),
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise ValueError((done.stderr.strip().splitlines() or ["clpt mie fails"])[-1])
    return json.loads(Path(command[-1]).read_text("utf-8"))


def lens(camera: Any, width: float, focus: float) -> Json:
    """Return the camera of a real lens with Blender's f-number; width of the film, focus [m]."""
    name = camera.clpt.lens
    return {
        "type": "lens", "lens": name if name in LENSES else bpy.path.abspath(name),
        "film_width": width, "focus_distance": focus,
        "f_number": camera.dof.aperture_fstop if camera.dof.use_dof else 0.0,
    }  # fmt: skip


def film(settings: Any) -> Json:
    """Return how the film sees wavelengths, and what is white to it."""
    made: Json = {}
    if settings.mode == "spectral" and settings.sensor == "FILE" and settings.sensor_file:
        made["sensor"] = {"file": bpy.path.abspath(settings.sensor_file)}
    elif settings.mode == "spectral" and settings.sensor != "FILE":
        made["sensor"] = settings.sensor
    white = settings.white_balance.strip()
    if white:
        made["white_balance"] = _kelvin(white) or white
    return made
