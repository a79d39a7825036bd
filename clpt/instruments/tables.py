"""Tables of points and of what was measured there, as CSV."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np

from clpt import images
from clpt.arrays import Floats
from clpt.errors import SceneError
from clpt.files import input_files as text_files
from clpt.instruments.false_color import write_false_color
from clpt.instruments.measuring import Measurement

TITLES = (("x", "y", "z"), ("nx", "ny", "nz"), ("dx", "dy", "dz"))


def read_points(path: str | Path) -> tuple[Floats, Floats | None]:
    """Return points (n, 3) [m] and directions (n, 3), or None without columns of these.

    Rows have x, y, z, or six numbers, separated by commas; a first row of titles is allowed: `x`,
    `y`, `z`, and `nx`, `ny`, `nz` or `dx`, `dy`, `dz`. `#` starts a comment.

    Raises SceneError with the line.
    """
    rows: list[list[float]] = []
    width = 0
    for number, line in enumerate(text_files.read(path).splitlines(), 1):
        fields = [field.strip() for field in line.split("#")[0].split(",")]
        if fields == [""]:
            continue
        if not rows and not width and _is_title(fields):
            width = len(fields)
            continue
        try:
            values = [float(field) for field in fields]
        except ValueError:
            raise SceneError(f"line {number}: {line.strip()!r} has no numbers", file=path) from None
        width = width or len(values)
        if len(values) != width or width not in (3, 6):
            message = f"line {number}: {len(values)} numbers, not {width if rows else '3 or 6'}"
            raise SceneError(message, file=path)
        rows.append(values)
    if not rows:
        raise SceneError("no points in this file", file=path)
    table = np.array(rows)
    return table[:, :3], table[:, 3:] if width == 6 else None


def _is_title(fields: list[str]) -> bool:
    names = tuple(field.lower() for field in fields)
    return names[:3] == TITLES[0] and names[3:] in ((), *TITLES[1:])


def written(points: Floats, measured: Measurement) -> str:
    """Return CSV: points (n, 3) with values and standard errors, a row each.

    Titles hold the unit, those of bands the wavelength [nm].
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    name = f"{measured.quantity} [{measured.unit}]"
    bands = [""]
    if measured.quantity == "tristimulus":
        bands = [f" {component}" for component in "XYZ"]
    if measured.wavelengths is not None:
        bands = [f" at {wavelength:g} nm" for wavelength in measured.wavelengths]
    values = measured.values.reshape(len(points), -1)
    errors = measured.errors.reshape(len(points), -1)
    titles = [f"{name}{band}" for band in bands]
    writer.writerow([*TITLES[0], *titles, *(f"standard error of {title}" for title in titles)])
    for point, value, error in zip(points, values, errors, strict=True):
        writer.writerow([f"{number:.7g}" for number in (*point, *value, *error)])
    return text.getvalue()


def write_map(path: Path, measured: Measurement) -> None:
    """Write the values (h, w) of a map as an image, its bands as the channels of an .npy.

    A .png has false colors. Texels beyond the surface are 0. Raises SceneError.
    """
    values = np.nan_to_num(measured.values).astype(np.float32)
    if path.suffix.lower() == ".png" and values.ndim == 2:
        write_false_color(path, measured.values, measured.unit)
    elif values.ndim == 2 or values.shape[2] == 3 or path.suffix.lower() == ".npy":
        images.write(path, values, half=False)
    else:
        message = f"holds no {values.shape[2]} bands; write an .npy or a .csv"
        raise SceneError(message, file=path)
