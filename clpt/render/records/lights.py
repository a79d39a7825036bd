"""Lights: the records of their tables, what their functions return, and their features."""

from __future__ import annotations

from dataclasses import dataclass

from clpt.geometry import shapes
from clpt.records.layout import Record
from clpt.render.records.macros import flag, macro
from clpt.scene.lights import KINDS as LIGHTS
from clpt.scene.lights import Light
from clpt.scene.params import params
from clpt.scene.roles import REAL, HostForm, Param

_BANDS = {  # of an image of spectra
    "bands": ("integer", "values in a texel"),
    "number": ("integer", "row in `spectra`: the number of the band by wavelength"),
}
_IMAGE = {
    "x": ("vec3", "the light's own axes in the world, unit length"),
    "y": ("vec3", "up"),
    "z": ("vec3", ""),
    "width": ("integer", "of the image, or of a face [texels]"),
    "height": ("integer", "[texels]"),
    "texels": ("integer", "first float of the first texel in `texels`"),
    "corners": ("integer", "first weight in `distributions`"),
    "marginal": ("integer", "first of the cumulative sums over the rows of blocks"),
    "conditional": ("integer", "first of those over the columns of blocks"),
    "blocks": ("integer", "first of the chances of blocks, see kernels/core/grid.cl"),
    "block_rows": ("integer", "rows of cells of a block"),
    "block_columns": ("integer", "columns of cells of a block"),
    "norm": ("real", "one over the sum of the cells' mean weights"),
}

IMAGE_RECORDS: dict[str, Record] = {
    "envmap": Record("Envmap", "An image in latitude and longitude.", **_IMAGE),
    "cube_map": Record("CubeMap", "Six square images, with a border of one texel.", **_IMAGE),
    "spectral_envmap": Record(
        "SpectralEnvmap",
        "An image of spectra in latitude and longitude.",
        **_IMAGE,
        **_BANDS,
    ),
}
_SKY = {
    **_IMAGE,
    "horizon": ("real", "above the level [rad]"),
    "sun_texels": ("integer", "first float of the first texel of the sun's disc"),
    "sun_cos": ("real", "of the angle of the sun's middle above the level"),
    "sun_sin": ("real", ""),
    "sun_radius": ("real", "sine of the radius of its disc"),
    "sun_share": ("real", "of samples that go to the disc"),
}
SKY_RECORDS: dict[str, Record] = {
    "sky": Record("Sky", "A sky; z is the level direction toward the sun.", **_SKY),
    "spectral_sky": Record(
        "SpectralSky",
        "A sky of spectra.",
        **_SKY,
        **_BANDS,
    ),
}
_PLACEMENT = {
    "position": ("vec3", "[m]"),
    "x": ("vec3", "the light's own axes in the world"),
    "y": ("vec3", ""),
    "z": ("vec3", "unit length"),
}

_CONE = {
    "cutoff": ("real", "half angle beyond which it is dark [rad]"),
    "beam_width": ("real", "half angle of full intensity [rad]"),
    "edge": ("integer", "falls linearly in the angle: 0; in the cosine by a cubic: 1, x^4: 2"),
}
_RADIANCE = ("integer", "first word of the emission parameter in `light_params`")
_SCALE = ("real", "what the image's values were divided by")
_FACTOR = ("integer", "first word of its factor in `light_params`")

OF_HOST: tuple[HostForm, ...] = (
    "text",
    "keys",
    "optional_number",
)  # forms of parameters that are for the host alone

PROJECTED_RECORDS: dict[str, Record] = {
    "projector": Record(
        "Projector",
        "A pinhole camera in reverse; x and y are over half the size of the image at a metre.",
        **_PLACEMENT,
        scale=_SCALE,
        radiance=_RADIANCE,
        factor=_FACTOR,
    ),
    "image_spot": Record(
        "ImageSpot",
        "A spot light with an image; x and y are over half its size at a metre.",
        **_PLACEMENT,
        **_CONE,
        radiance=_RADIANCE,
        factor=_FACTOR,
    ),
    "goniometric": Record(
        "Goniometric",
        "A point light with an image around it.",
        **_PLACEMENT,
        scale=_SCALE,
        radiance=_RADIANCE,
        factor=_FACTOR,
    ),
}


def declared_record(cls: type[Light]) -> Record:
    """Return the record of a light whose members are its parameters, as they are declared.

    An emission is the first word of its five in `light_params`; a number in degrees comes in
    radians; a direction has unit length; `to_world` becomes position and unit axes.
    """
    members: dict[str, tuple[str, str]] = {}
    for name, param in params(cls).items():
        doc = f"{param.doc} [{param.unit}]" if param.unit else param.doc
        members |= {member: (type_, doc) for member, type_ in _members(name, param).items()}
    summary = (cls.__doc__ or cls.__name__).split("\n")[0]
    return Record(cls.__name__, summary, **members)


def _members(name: str, param: Param) -> dict[str, str]:
    """The members of a parameter by name, with their types."""
    placement = {member: type_ for member, (type_, _) in _PLACEMENT.items()}
    forms = {"vector": {name: "vec3"}, "direction": {name: "vec3"}, "matrix4": placement}
    forms |= {form: {} for form in OF_HOST}
    if param.role.place != "host":
        return {name: "real" if param.role is REAL else "integer"}
    if param.role.name not in forms:
        raise TypeError(f"a light cannot declare {name!r} as a host parameter of this form")
    return forms[param.role.name]


# Lights whose rows the lowering computes; those of all other kinds follow from their declaration.
COMPUTED: dict[str, Record] = {
    "spot": Record(
        "Spot",
        "A spot light.",
        position=("vec3", "[m]"),
        axis=("vec3", "unit vector in which it shines"),
        **_CONE,
        radiance=_RADIANCE,
    ),
    **PROJECTED_RECORDS,
    **IMAGE_RECORDS,
    **SKY_RECORDS,
}
DECLARED = {cls.kind: cls for cls in LIGHTS if cls.reach != "surface" and cls.kind not in COMPUTED}
BRICK = "emissive_brick"  # what of a grid emits: eight cells along each axis
BODY = "emissive_body"  # a homogeneous medium that emits
VOLUMES = (BRICK, BODY)
RECORDS: dict[str, Record] = {
    **{kind: declared_record(cls) for kind, cls in DECLARED.items()},
    **COMPUTED,
    BRICK: Record(
        "EmissiveBrick",
        "A brick of a grid that emits.",
        medium=("integer", "the medium, see kernels/media/medium.cl"),
        number=("integer", "of the brick, see kernels/media/medium_grid.cl"),
        corner=("vec3", "[m]"),
        x=("vec3", "edges from there [m]"),
        y=("vec3", ""),
        z=("vec3", ""),
        chord=("real", "mean length of the lines through it [m]"),
        inverse=("real", "of its volume [1/m^3]"),
    ),
    BODY: Record(
        "EmissiveBody",
        "A homogeneous medium that emits, in a ball or a box.",
        medium=("integer", "the medium, see kernels/media/medium.cl"),
        box=("integer", "1: it is a box, else a ball"),
        x=("vec3", "rows of the matrix to the unit ball, or the cube from -1 to 1"),
        y=("vec3", ""),
        z=("vec3", ""),
        at=("vec3", "and its last column"),
        center=("vec3", "[m]"),
        edge_x=("vec3", "from there to the ends of the axes [m]"),
        edge_y=("vec3", ""),
        edge_z=("vec3", ""),
        inverse=("real", "of its volume [1/m^3]"),
    ),
}
# A ray that leaves the scene meets INFINITE lights; PLACED lights have a position.
INFINITE = (
    *(cls.kind for cls in LIGHTS if cls.reach == "infinite"),
    "spectral_envmap",
    "spectral_sky",
)
PLACED = (*(cls.kind for cls in LIGHTS if cls.reach == "placed"), "image_spot")
# LightRow.emission_mode, see kernels/lights/area.cl
FRONT, ALONG, BOTH, UNSEEN, DIRECTED = 0, 1, 2, 4, 8

BASES = {
    "spectral_envmap": "envmap",
    "spectral_sky": "sky",
    "image_spot": "spot",
}  # a kind uses the functions of its base

# LightRow.kind is a position in this tuple
KINDS = (*(kind for kind in RECORDS if kind not in VOLUMES), *shapes.RECORDS, *VOLUMES)
NODE = Record(
    "LightNode",
    "A node of the tree over lights; children of a node are a group, neighbours in the table.",
    center=("vec3", "of its lights, weighed by power [m]"),
    radius=("real", "around all of them [m]; below 0: it shines everywhere, power alone counts"),
    mean=("vec3", "of the lights' normals, weighed by power"),
    power=("real", "of all its lights"),
    squares=("vec3", "mean of the squares of the normals' x, y and z, see lights/tree_nodes.py"),
    cos_e=("real", "of the angle from `mean` up to which there is light; -1: on all sides"),
    products=("vec3", "mean of the normals' y z, z x and x y"),
    child=("integer", "the group of its children; below 0: -1 - the row in `lights`"),
)
OPENING = Record(
    "Opening",
    "A rectangle that the light of infinite lights comes through.",
    center=("vec3", "[m]"),
    x=("vec3", "half an edge, over its square: 1 at the border [1/m]"),
    y=("vec3", ""),
    n=("vec3", "unit normal"),
    area=("real", "[m^2]"),
    reach=("real", "half the diagonal [m]"),
)
WIDTH = 4  # nodes of a group
LINE = 16  # words; the first group begins at a multiple of it

# What the functions of lights return, see kernels/lights/light.cl and emission.cl.
LIGHT_SAMPLE = Record(
    "LightSample",
    "A direction to a light, chosen as seen from some point p.",
    wi=("vec3", "unit length, from p", "v3(0.0f, 0.0f, 1.0f)"),
    t=("real", "distance [m]; FAR for lights at infinity", "FAR"),
    radiance=(
        "spectrum",
        "what comes along it; for a delta light, irradiance on a shading surface",
    ),
    pdf=("real", "[1/sr]; below 0: a delta light, to be taken as it is; 0: nothing comes"),
    row=("integer", "of the light in `lights`; where light paths are weighed"),
    chance=("real", "with which that row was chosen; likewise"),
    n=("vec3", "normal there of a light on a shape; where light paths are aimed"),
)
LIGHT_RAY = Record(
    "LightRay",
    "A ray that leaves a light.",
    o=("vec3", "where it starts [m]"),
    d=("vec3", "in which direction, unit length", "v3(0.0f, 0.0f, 1.0f)"),
    n=("vec3", "unit normal of the surface there; d off all surfaces", "v3(0.0f, 0.0f, 1.0f)"),
    size=("real", "of that surface, 0 off all, see kernels/core/rounding.cl [m]"),
    power=("spectrum", "radiance |cos| over the pdf of o and d [W/nm]"),
    seen=(
        "spectrum",
        "radiance over the pdf of o, or from infinity of d: what a camera may gather; "
        "0: a delta light",
    ),
    away=("integer", "a mask: it comes from infinity"),
    row=("integer", "of the light in `lights`; where light paths are weighed"),
    gain=("real", "how much denser aiming makes such rays; where they are aimed", "1.0f"),
)
VALUES = (LIGHT_SAMPLE, LIGHT_RAY)


@dataclass(frozen=True)
class LightFeatures:
    """The device kinds of lights, see clpt.render.records.lights, and what they do."""

    kinds: tuple[str, ...] = ()
    infinite: bool = False  # some light is met by rays that leave the scene
    visible: bool = False  # some light is no delta light: a camera may see it
    two_sided: bool = False  # some shape emits from its back too
    unseen: bool = False  # some shape emits, but no ray sees it
    directed: bool = False  # the light of some shape depends on its direction
    tree: bool = False  # a tree chooses among the lights
    gloss: int = 0  # the gloss stands so many words before a material's row; 0: no gloss
    openings: bool = False  # of a room, for infinite lights
    few: bool = flag("FEW_LIGHTS", True)  # a single random number chooses a light and a point

    @property
    @macro("USES_LIGHTS")
    def present(self) -> bool:
        """Whether there is a light."""
        return bool(self.kinds)

    @property
    def volumes(self) -> bool:
        """Whether parts of media are lights: bricks of grids, or whole bodies."""
        return any(kind in self.kinds for kind in VOLUMES)

    @property
    def bricks(self) -> bool:
        """Whether bricks of media are lights."""
        return BRICK in self.kinds

    @property
    def bodies(self) -> bool:
        """Whether homogeneous media are lights."""
        return BODY in self.kinds
