"""A film or checkpoint as `clpt info` and `clpt inspect` show it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ...render.film import film_file
from ...render.film.layer_channels import channels_of
from ..printing.console import shown
from .image_contents import ImageContents, size_text


def film_summary(path: Path) -> dict[str, Any]:
    """Return what a film file says of itself. Raises SceneError."""
    header = film_file.read_header(path)
    height, width = header["shapes"]["words"][-2:]
    origin, sessions, form = header["scene"], header["sessions"], header["form"]
    film: dict[str, Any] = {"width": width, "height": height, "bands": form["bands"]}
    crop = origin.get("film.crop")  # numbers with commas
    part = {} if crop is None else {"crop": [round(float(n)) for n in str(crop).split(",")]}
    return {
        "format": "film",
        "clpt": header["clpt"],
        "samples": [f"{first} to {end - 1}" for first, end in header["taken"]],
        "film": film | part,
        "holds": ["picture", *form["layers"], *["alpha"] * form["alpha"]],
        "integrator": header["settings"]["chosen.integrator"],
        "sampler": origin["sampler.type"],
        "seed": origin["seed"],
        "noise": "noise" in header["adaptive"],
        "seconds": round(sum(one["seconds"] for one in sessions), 3),
        "sessions": [
            f"{one['began']}  {one['seconds']:.1f} s  {one['device']['device']}" for one in sessions
        ],
    }


def film_contents(path: Path) -> ImageContents:
    """Return the picture of a film, and what it says of itself. Raises SceneError."""
    picture, summary = film_file.read(path).developed(), film_summary(path)
    form, lambdas, quantity = picture.form, None, "value (linear)"
    colours = picture.colours()
    values = picture.image()
    if form.bands:
        lambdas, quantity = picture.spectral_image().lambdas, "radiance [W m^-2 sr^-1 nm^-1]"
        labels = [f"{nm:g} nm" for nm in lambdas]
    else:
        beside = channels_of(picture.layers()) if form.layers else {}
        beside |= {"samples.X": picture.samples_per_pixel()} if form.adaptive else {}
        labels = [*"RGBA"[: values.shape[2]], *beside]
        values = np.dstack([values, *beside.values()])
    facts = {"size": size_text(values)} | {k: shown(v).plain for k, v in summary.items()}
    stops = form.display_exposure
    return ImageContents(path, values, tuple(labels), lambdas, colours, quantity, facts, stops)
