"""Every record that the host shares with the device. Read this first.

Three slabs hold what is in flight, one slot a path: `Path`, `Hit` and `Shadow`. Tables of words
hold the scene; `TABLES` lists them once; the kernels' `Scene` struct and arguments follow from it.
"""

from __future__ import annotations

from clpt.layout import Record

PATH = Record(
    "Path",
    "State of one light path; stays in its slot.",
    o=("vec3", "origin of the ray in flight [m]"),
    d=("vec3", "its direction, unit length"),
    beta=("spectrum", "throughput, per wavelength"),
    radiance=("spectrum", "what the path has gathered so far"),
    lambdas=("spectrum", "wavelengths [nm]; unused in RGB mode"),
    pdf=("real", "of d [1/sr]; below 0 if the last event was delta; at the camera, -(its far end)"),
    sampled_hemisphere=(
        "vec3",
        "normal of the hemisphere that d was chosen from; 0: the whole sphere",
    ),
    null_distance=(
        "real",
        "from where d was chosen to where the ray begins, past null surfaces [m]",
    ),
    ratio=("spectrum", "pdf of the path at each wavelength, over the mean of the four"),
    eta=("real", "product of the relative indices so far, for Russian roulette"),
    weight=("real", "of the sample, from the pixel filter; from a light, 1 over its first beta"),
    medium=("integer", "what absorbs along the ray, see kernels/optics/medium.cl; 0: nothing does"),
    state=("integer", "PATH_ bits and depth, see kernels/path/path_state.cl"),
    pixel_index=("integer", "the pixel that the path belongs to, in the order of the film's tiles"),
    sample=("integer", "the number of its sample"),
    sum=("vec3", "of the pixel's samples so far: xyz, or rgb in RGB mode"),
    compensation=("vec3", "what rounding took from `sum` (Neumaier)"),
    samples=("real", "how many samples `sum` holds"),
)

HIT = Record(
    "Hit",
    "Where the ray in flight ends.",
    t=("real", "distance [m]"),
    u=("real", "barycentric of vertex 1; u of an analytic shape"),
    v=("real", "barycentric of vertex 2; v of an analytic shape"),
    n=("vec3", "geometric normal; of a triangle not normalised, twice its area long"),
    prim=("integer", "primitive; -1: nothing was hit"),
    shape=("integer", "row of the shape in `shapes`"),
    material=("integer", "material word of the side that was hit, see kernels/path/surface.cl"),
    instance=("integer", "1 + row in `instances`; 0: none"),
)

SHADOW = Record(
    "Shadow",
    "A ray to a light that waits to be tested, and what it carries.",
    o=("vec3", "origin [m]"),
    d=("vec3", "direction, unit length"),
    t=("real", "distance to the light [m]; not above 0: no ray"),
    value=("spectrum", "radiance that arrives if nothing is in the way"),
    pixel=("integer", "index of the pixel that gets it, for paths that start at lights"),
)

SETTINGS = Record(
    "Settings",
    "What holds for a whole render.",
    width=("integer", "of the picture [pixels]"),
    height=("integer", "of the picture [pixels]"),
    crop_x=("integer", "where it begins on the film, from the left [pixels]"),
    crop_y=("integer", "and from above"),
    film_width=("integer", "of the whole film [pixels]"),
    film_height=("integer", "of the whole film [pixels]"),
    tiles_x=("integer", "4x4-pixel tiles in a row"),
    padded_pixels=("integer", "16 times the number of 4x4 tiles that cover the picture"),
    slots=("integer", "paths in flight"),
    per_plane=("integer", "slots that work on one film plane"),
    planes=("integer", "film planes; slots of different planes share pixels"),
    seed=("natural", "of the sampler"),
    sample_bits=("integer", "of a pixel's number of samples, as a power of two; zsobol"),
    max_depth=("integer", "longest path"),
    rr_depth=("integer", "depth from which Russian roulette is played"),
    hide_lights=("integer", "1: the camera does not see lights"),
    light_count=("integer", "rows in `lights`"),
    ambient=(
        "integer",
        "first word in `light_params` of what the whitted integrator adds everywhere",
    ),
    first_analytic=("integer", "row in `shapes` of the first shape that is not of triangles"),
    analytic_count=(
        "integer",
        "how many shapes there are from there on, each sphere of `spheres` counted",
    ),
    single_count=("integer", "how many of these have a row each; the others are of `spheres`"),
    shape_count=("integer", "rows in `shapes`"),
    infinite_count=("integer", "how many of the lights are infinite; these come first"),
    lambda_min=("real", "[nm]"),
    lambda_max=("real", "[nm]"),
    tanh_min=("real", "tanh of the wavelength importance where the sensor begins to respond"),
    tanh_max=("real", "and where it ends"),
    bands=("integer", "of a spectral film"),
    density=("integer", "first word in `distributions` of the density of wavelengths"),
    to_first=("vec3", "from a film's sums to the picture: what makes its first channel"),
    to_second=("vec3", "its second"),
    to_third=("vec3", "its third"),
    scene_radius=("real", "of the sphere around the scene [m]"),
    center=("vec3", "of that sphere [m]"),
)

SHAPE = Record(
    "ShapeRow",
    "One shape.",
    kind=("integer", "0: triangles; else 1 + position in the table of analytic shapes"),
    front=("integer", "material word of its front"),
    back=("integer", "material word of its back"),
    light=("integer", "first of its rows in `lights`; -1: it does not emit"),
    flags=("integer", "SHAPE_ bits, see kernels/path/surface.cl"),
    prim=("integer", "its first primitive"),
    params=("integer", "first word of its parameters in `geometry`; analytic shapes"),
    number=("integer", "its index in the scene's shapes"),
    attributes=("integer", "first word in `attributes` of where each lies; 0: it has none"),
)

INSTANCE = Record(
    "InstanceRow",
    "A placed copy of a group's triangles. The origin of their space is the centre of their box.",
    origin=("vec3", "that origin in the world [m]"),
    x=("vec3", "from the world to the group, without the origin: first row of the matrix"),
    y=("vec3", "its second row"),
    z=("vec3", "its third row"),
    nodes=("natural", "where the nodes of the group's tree begin, in steps of 32 bytes"),
    leaves=("natural", "where its leaves begin, likewise"),
    prim=("integer", "first primitive of the group"),
    number=("integer", "its index in the scene's shapes"),
)

LIGHT = Record(
    "LightRow",
    "One light that can be chosen: a lamp, an analytic shape, or one triangle.",
    kind=("integer", "position in the table of device lights"),
    params=("integer", "first word of its parameters, in `geometry` or `light_params`"),
    pmf=("real", "probability of being chosen"),
    keep=("real", "probability that the alias table keeps this row"),
    alias=("integer", "the row taken otherwise"),
    shape=("integer", "row of its shape; -1: not on a shape"),
    radiance=("integer", "first word of its emission parameter in `light_params`"),
    emission_mode=("integer", "of a shape's light, see kernels/light/area.cl"),
)

SLABS = (PATH, HIT, SHADOW)

# name: (element type, what it holds); all read-only
TABLES: dict[str, tuple[str, str]] = {
    "vertices": ("float", "x y z per vertex [m]"),
    "normals": ("float", "x y z per vertex; zero where the shape has none"),
    "uvs": ("float", "u v per vertex"),
    "faces": ("uint", "three vertices per triangle"),
    "attributes": (
        "uint",
        "of meshes per vertex or face, see clpt.render.lowering.textures.attributes",
    ),
    "shapes": ("uint", "ShapeRow per shape"),
    "instances": ("uint", "InstanceRow per instance"),
    "geometry": ("uint", "parameters of analytic shapes, and of shapes as lights"),
    "spheres": ("float", "x y z and radius per sphere of the shapes `spheres` [m]"),
    "materials": ("uint", "parameters of the leaf materials, a row each"),
    "mixtures": ("uint", "rules of masks and blends, see kernels/stage/sort.cl"),
    "lights": ("uint", "LightRow per light, infinite ones first; then a tree over many"),
    "light_params": ("uint", "parameters of the lights that are not shapes, and emissions"),
    "spectra": ("float", "tabulated spectra on the common grid"),
    "textures": ("uint", "parameters of the textures, a row each"),
    "images": ("uint", "texels of bitmaps, see clpt.render.lowering.textures.bitmaps"),
    "texels": ("float", "of environment maps, and of bitmaps of spectra"),
    "distributions": ("float", "of filter, environment maps, wavelengths and re-radiation"),
    "camera": ("float", "the camera's parameters"),
}
