"""The camera: the records of its table, and its features."""

from __future__ import annotations

from dataclasses import dataclass

from clpt.records.layout import Record
from clpt.render.records.macros import flag
from clpt.scene import cameras
from clpt.scene.params import Kind, params

_TO_WORLD = ("matrix", "camera space to world, row-major")

_PINHOLE = {
    "to_world": _TO_WORLD,
    "extent": ("vec2", "width and height of the film at distance 1"),
    "offset": ("vec2", "of the principal point, in widths and heights of the film"),
}

WEIGHTED = ("lens", "rays", "calibrated")  # cameras whose rays have weights
GHOST_CELLS = 1024  # of equal probability; a cell gives a pair of reflecting surfaces


def _declared(kind: type[Kind]) -> dict[str, tuple[str, str]]:
    """Return the members that a camera declares by `member`."""
    return {
        name: ("real", f"{param.doc} [{param.unit}]" if param.unit else param.doc)
        for name, param in params(kind).items()
        if param.member
    }


RECORDS: dict[str, Record] = {
    "perspective": Record(
        "PerspectiveCamera", "A pinhole.", **_PINHOLE, **_declared(cameras.Perspective)
    ),
    "thin_lens": Record(
        "ThinLensCamera",
        "A pinhole with an aperture.",
        **_PINHOLE,
        **_declared(cameras.ThinLens),
        power=("real", "index - 1 of the glass at that wavelength"),
        glass=("integer", "row in `spectra` of a glass that disperses"),
    ),
    "lens": Record(
        "LensCamera",
        "A lens of surfaces. Behind it follow tables; where: their first words, from to_world on.",
        to_world=_TO_WORLD,
        extent=("vec2", "width and height of the film [m]"),
        back=("real", "from the film to the last surface [m]"),
        exposure=("real", "by which irradiance is multiplied [1/sr]"),
        surfaces=("integer", "where the rows of LensSurface begin, from the film on"),
        count=("integer", "of surfaces"),
        zones=("integer", "where the ellipses begin that rings of the film see"),
        zones_per_metre=("real", "rings in a metre of the film's radius"),
        last_zone=("integer", "number of the outermost ring"),
        blades=("integer", "of the diaphragm; 0: it is round"),
        blade_normals=("integer", "where the blades' normals begin"),
        blade_distance=("real", "of a blade from the axis, in radii of the stop"),
        ghosts=("real", "share of samples that are reflected twice"),
        ghost_cells=("integer", "where the pairs of reflecting surfaces begin"),
        rear_radius=("real", "on the rear plane, of rays that meet the last surface [m]"),
    ),
    "orthographic": Record(
        "OrthographicCamera",
        "Parallel rays.",
        to_world=_TO_WORLD,
        aspect=("real", "height of the film over its width"),
        **_declared(cameras.Orthographic),
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
    "rays": Record(
        "RaysCamera",
        "A list of rays, which follows.",
        columns=("integer", "of the film"),
        rows=("integer", "of the film"),
        count=("integer", "of rays"),
        list=("integer", "the list's first word, from columns on"),
    ),
    "calibrated": Record(
        "CalibratedCamera",
        "Directions of the pixels' corners, which follow.",
        to_world=_TO_WORLD,
        columns=("integer", "of the film"),
        rows=("integer", "of the film"),
        directions=("integer", "the first word of the corners, row by row, from to_world on"),
        form=(
            "integer",
            "of the model: 0: distortion of a pinhole, 1: a polynomial of the angle, "
            "2: its arc tangent, 3: spheres",
        ),
        coefficients=("integer", "the first word of the model's numbers, 12"),
        widest=("real", "cosine of the widest angle that is seen"),
        focal=("vec2", "a length of 1 on the image plane [pixels of the film]"),
        middle=("vec2", "where the axis meets the film, from its corner [pixels]"),
    ),
}

LENS_SURFACE = Record(
    "LensSurface",
    "A surface of a lens in camera space, lengths in metres; curvatures as seen from the film.",
    z=("real", "of the vertex, the film's being 0"),
    curvature=("real", "above 0 where the centre is on the scene's side"),
    conic=("real", "constant; 0: a sphere"),
    radius=("real", "half the diameter"),
    form=("integer", "0: a sphere or a plane, 1: a conic, 2: with aspheric terms"),
    stop=("integer", "1: the diaphragm is here"),
    near_index=("real", "on the film's side"),
    far_index=("real", "on the scene's side"),
    near_glass=("integer", "row in `spectra` of a glass that disperses, else -1"),
    far_glass=("integer", "the same, on the scene's side"),
    coats=("integer", "films on it"),
    first_coat=("integer", "where these begin: index and thickness [nm], from the scene on"),
    **{f"a{i}": ("real", f"sag [m] of (r / radius)^{2 * i + 4}") for i in range(8)},
)


@dataclass(frozen=True)
class CameraFeatures:
    """The kind of camera, and what its lens does."""

    kind: str = "perspective"
    disperses: bool = flag("CAMERA_DISPERSES")  # its glass does
    losses: bool = flag("LENS_LOSSES")  # surfaces of its lens reflect a part of the light
    ghosts: bool = flag("LENS_GHOSTS")  # and samples follow it

    @property
    def weighs(self) -> bool:
        """Whether its rays have weights."""
        return self.kind in WEIGHTED

    @property
    def listed(self) -> bool:
        """Whether its pixels are entries of a list, and so no neighbours."""
        return self.kind == "rays"
