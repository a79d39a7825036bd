"""The records of cameras: what lowering writes into `camera` and kernels read there."""

from __future__ import annotations

from clpt.layout import Record

_TO_WORLD = ("matrix", "camera space to world, row-major")

_NEAR = ("real", "distance of the near plane [m]")

_FAR = ("real", "distance of the far plane [m]")

_PINHOLE = {
    "to_world": _TO_WORLD,
    "extent": ("vec2", "width and height of the film at distance 1"),
    "offset": ("vec2", "of the principal point, in widths and heights of the film"),
    "near": _NEAR,
    "far": _FAR,
}

RECORDS: dict[str, Record] = {
    "perspective": Record("PerspectiveCamera", "A pinhole.", **_PINHOLE),
    "thin_lens": Record(
        "ThinLensCamera",
        "A pinhole with an aperture.",
        **_PINHOLE,
        aperture_radius=("real", "of the lens [m]"),
        focus_distance=("real", "of the plane in focus [m]"),
        focal_length=("real", "at the design wavelength [m]"),
        power=("real", "index - 1 of the glass at that wavelength"),
        glass=("integer", "row in `spectra` of a glass that disperses"),
    ),
    "orthographic": Record(
        "OrthographicCamera",
        "Parallel rays.",
        to_world=_TO_WORLD,
        aspect=("real", "height of the film over its width"),
        near=_NEAR,
        far=_FAR,
    ),
    "spherical": Record("SphericalCamera", "All directions around a point.", to_world=_TO_WORLD),
    "matrix": Record(
        "MatrixCamera",
        "Unprojects clip coordinates x and y.",
        direction=("vec3", "at x = y = 0; not normalised"),
        direction_x=("vec3", "what it gains per x"),
        direction_y=("vec3", "and per y"),
        near=("spectrum", "point on the near plane at x = y = 0, homogeneous"),
        near_x=("spectrum", "what it gains per x"),
        near_y=("spectrum", "and per y"),
    ),
}
