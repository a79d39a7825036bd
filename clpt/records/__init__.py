"""Every record that the host shares with the device. Read this first.

Three slabs hold the state of all paths: `Path`, `Hit` and `Shadow`, with a slot for each path. The
scene lies in tables of 4-byte words: `TABLES` lists them once, and the kernels' `Scene` struct and
arguments follow from it. A member's text is what it means, with its unit. `CONSTANTS` are the bits
and other numbers that both sides know, each a file `generated/<name>.cl` of kernels.
"""

from __future__ import annotations

from clpt.records.layout import Constants, Record, bits

REUSE_GROUP = 8  # slots whose paths share vertices, see kernels/transport/reuse.cl

PATH = Record(
    "Path",
    "State of one light path; stays in its slot.",
    o=("vec3", "origin of the current ray [m]"),
    d=("vec3", "direction of the current ray, unit length"),
    beta=("spectrum", "throughput, per wavelength"),
    radiance=("spectrum", "radiance that the path has gathered so far"),
    lambdas=("spectrum", "wavelengths [nm]; unused in RGB mode"),
    pdf=(
        "real",
        "density with which d was chosen [1/sr]; below 0 where it was delta; of a camera's ray "
        "minus the distance to its far end [m]",
    ),
    sampled_hemisphere=(
        "vec3",
        "normal of the hemisphere that d was chosen from; 0: the whole sphere",
    ),
    sampled_wo=("natural", "to where that surface sends light, see kernels/core/warp.cl"),
    sampled_gloss=("natural", "its gloss, see kernels/lights/receiver.cl"),
    null_distance=(
        "real",
        "distance from the point where d was chosen to o, through null surfaces [m]",
    ),
    nulls=("integer", "null surfaces that the path has crossed"),
    ratio=(
        "spectrum",
        "density of the path at each wavelength, over the mean of the four",
        "spectrum_of(1.0f)",
    ),
    eta=("real", "product of the relative indices so far, for Russian roulette"),
    length=("real", "optical length from the camera to o, see kernels/transport [m]"),
    weight=("real", "sample's weight by the pixel filter; from a light, 1 over its first beta"),
    medium=("integer", "medium of the ray, see kernels/media/medium.cl; 0: none"),
    around=("integer", "medium from which the ray went into a body that absorbs; 0: none"),
    bodies=("integer", "bodies around the ray, see kernels/media/bodies.cl"),
    ray_offset=("real", "how far before o the ray's medium begins: o lies off the surface [m]"),
    mis_ratio=(
        "real",
        "the other side's density over the path's (dVCM), see kernels/transport/mis_ratio.cl",
    ),
    merge_ratio=(
        "real",
        "added to it if the next surface is specular (dVM), see kernels/transport/mis_ratio.cl",
    ),
    expected=("real", "light that a guide knows where the path met it first, times throughput"),
    escape=("real", "density of rays out of a sealed medium, over that of d; below 0: it is left"),
    escape_axis=("vec3", "of the cone into which they are sent, see kernels/media/escape.cl"),
    escape_width=("real", "1 less the cosine of its half angle; 0: none are sent"),
    escape_plane=("vec3", "normal of the boundary, times optical depth of a metre along the axis"),
    escape_depth=("real", "escape_plane . p for points p of the boundary"),
    light=("integer", "row in `lights` of the light where the path began"),
    time=("real", "when the path's light comes to the film, see clpt.scene.motion [s]"),
    state=("integer", "PATH_ bits and depth, see kernels/transport/path_state.cl"),
    pixel_index=("integer", "where the film stores the path's pixel, see kernels/film/pixel.cl"),
    pixel_key=("natural", "number by which the sampler knows that pixel of the whole film"),
    sample=("integer", "number of the path's sample in its pixel"),
    low=("natural3", "lowest words of the pixel's three sums so far: xyz, or rgb in RGB mode"),
    middle=("natural3", "middle words of these sums, see kernels/core/fixed.cl"),
    high=("natural3", "highest words of these sums"),
    covered=("fixed", "weights of those samples that met a surface; of a film with alpha"),
    samples=("natural", "number of samples in these sums"),
    cone=(
        "integer",
        "cone around the ray, see kernels/textures/cone.cl; of a scene with mip levels",
    ),
    slope=("real", "d ln n / d ln lambda of the index n at the ray, where time is that of pulses"),
    reuse=("integer", "what the path shares with its group, see kernels/transport/reuse.cl"),
    reuse_n=("natural", "geometric normal at its first vertex, see kernels/core/warp.cl"),
    reuse_ns=("natural", "shading normal there"),
    reuse_x=("vec3", "that vertex, off its surface [m]"),
    reuse_beta=("spectrum", "throughput behind it"),
    reuse_before=("spectrum", "radiance gathered before the second vertex"),
    reuse_y=("vec3", "the second vertex, off its surface [m]"),
    reuse_yn=("natural", "geometric normal there, toward the first"),
    reuse_yns=("natural", "shading normal there"),
    reuse_coat=("natural", "the coat at the first vertex"),
    reuse_y_coat=("natural", "the coat at the second vertex"),
    **{
        f"reuse_density{k}": ("real", "with which it would have found y of its group [1/m^2]")
        for k in range(REUSE_GROUP)
    },
)

HIT = Record(
    "Hit",
    "Where the current ray ends.",
    t=("real", "distance [m]"),
    u=("real", "barycentric of vertex 1; u of an analytic shape"),
    v=("real", "barycentric of vertex 2; v of an analytic shape"),
    n=("vec3", "geometric normal; a triangle's has twice its area as length [m^2]"),
    plane=("real", "of a triangle: n . p for its points p"),
    side=("real", "of a triangle: length that counts for what float32 rounds at the hit [m]"),
    prim=("integer", "primitive; -1: nothing was hit"),
    shape=("integer", "row of the shape in `shapes`"),
    material=("integer", "material word of the hit side, see kernels/shapes/surface.cl"),
    instance=("integer", "1 + row in `instances`; 0: none"),
)

SHADOW = Record(
    "Shadow",
    "A ray to a light, or from a light's path to the camera, that waits to be tested.",
    o=("vec3", "origin [m]"),
    d=("vec3", "direction, unit length"),
    t=("real", "distance to its end [m]; 0 or below: no ray waits"),
    value=("spectrum", "what arrives if nothing is between: radiance, or what a pixel gets"),
    through=(
        "integer",
        "medium at its beginning, where it may go through several; or bodies, where these overlap",
    ),
    into=("integer", "medium at its end, where a light is a part of that; 0: any"),
    length=("real", "optical length from the camera to the light [m]"),
    film=(
        "vec2",
        "where the picture shows its beginning, from the corner [pixels]; of light paths",
    ),
)

# layers of the first samples of a pixel, as kernels/film/layers.cl puts them
LAYER_PLACES = (
    "albedo", "shading_normal", "geometric_normal", "depth", "z", "position", "uv", "motion",
    "shape_id", "primitive_id", "material_id", "denoising_albedo", "denoising_normal",
)  # fmt: skip

SETTINGS = Record(
    "Settings",
    "Numbers that hold for a whole render.",
    width=("integer", "width of the picture [pixels]"),
    height=("integer", "height of the picture [pixels]"),
    crop_x=("integer", "column of the film where the picture begins, from the left [pixels]"),
    crop_y=("integer", "row of the film where the picture begins, from above [pixels]"),
    film_width=("integer", "width of the whole film [pixels]"),
    film_height=("integer", "height of the whole film [pixels]"),
    margin=("integer", "pixels around the picture whose samples its filter reaches"),
    tiles_x=("integer", "4x4-pixel tiles in a row"),
    padded_pixels=("integer", "16 times the number of 4x4 tiles that cover picture and margin"),
    slots=("integer", "number of slots: paths that are traced at once"),
    per_plane=("integer", "slots that share a film plane"),
    planes=("integer", "planes of slots; those of different ones may render the same pixel"),
    halves=(
        "integer",
        "2: even and odd samples have parts of the film of their own, and planes are even; else 1",
    ),
    octaves=("integer", "2: so have samples of even and odd octaves, see kernels/film/film.cl"),
    seed=("natural", "seed of the sampler"),
    sample_bits=("integer", "base-2 logarithm of the samples of a pixel; zsobol"),
    max_depth=("integer", "most surfaces of a path, that of the light counted"),
    rr_depth=("integer", "depth from which Russian roulette is played"),
    hide_lights=("integer", "1: the camera does not see lights"),
    alpha=("integer", "1: the film has a channel of what is covered; the camera sees no sky"),
    light_paths=(
        "real",
        "light paths for each camera sample; 0: there are none",
    ),
    radius=("real", "of the disk in which photons are merged in the first pass [m]"),
    photon_places=("integer", "photons that a light path may leave"),
    photon_pixels=("integer", "light paths whose index is below this leave photons"),
    photon_paths=("real", "how many these are in a pass, for each group of wavelengths"),
    photon_cells=("integer", "cells that are told apart, a power of two"),
    guide_side=("real", "of the cells of a guide, see kernels/transport/guiding/guide.cl [m]"),
    guide_paths=("integer", "light paths from which it learns"),
    wavelength_groups=("integer", "groups of paths that have the same wavelengths, in a pass"),
    mis_area_unit=("real", "unit of areas in kernels/transport/mis_ratio.cl, a power of two [m^2]"),
    aims=(
        "integer",
        "first float in `distributions` of the spheres at which light paths aim",
    ),
    openings=("integer", "first word in `light_params`, see kernels/lights/openings.cl"),
    opening_count=("integer", "number of openings of a room"),
    opening_share=("real", "of samples of infinite lights, through openings"),
    aim_count=("integer", "number of these spheres, see kernels/lights/aiming.cl"),
    camera_medium=("integer", "medium around the camera, see kernels/media/medium.cl"),
    camera_around=("integer", "medium around the body at the camera that absorbs; 0: none"),
    camera_bodies=("integer", "bodies around it, see kernels/media/bodies.cl"),
    second_u=(
        "integer",
        "number of the attribute vertex_u1 among those of meshes; -1: no map asks",
    ),
    second_v=("integer", "number of vertex_v1"),
    light_count=("integer", "rows in `lights`"),
    ambient=(
        "integer",
        "first word in `light_params` of the radiance that whitted adds to every surface",
    ),
    first_analytic=("integer", "row in `shapes` of the first shape that is not of triangles"),
    analytic_count=("integer", "analytic primitives: each sphere of a shape `spheres` is one"),
    single_count=("integer", "analytic primitives with a row each; the others are of `spheres`"),
    shape_count=("integer", "rows in `shapes`"),
    infinite_count=("integer", "infinite lights, which are the first rows of `lights`"),
    lambda_min=("real", "shortest wavelength [nm]"),
    lambda_max=("real", "longest wavelength [nm]"),
    tanh_min=("real", "tanh of the wavelength importance where the sensor begins to respond"),
    tanh_max=("real", "tanh of the wavelength importance where the sensor ends to respond"),
    bands=("integer", "number of bands of a spectral film"),
    density=("integer", "first word in `distributions` of the density of wavelengths"),
    film_scale=("real", "what a sum has of a value of 1: a power of two"),
    to_first=("vec3", "factors of the film's three sums in the picture's first channel"),
    to_second=("vec3", "the same of its second channel"),
    to_third=("vec3", "the same of its third channel"),
    scene_radius=("real", "radius of a sphere around the scene [m]"),
    center=("vec3", "centre of that sphere [m]"),
    **{
        f"layer_{name}": ("integer", "first word of that layer of a pixel; 0: it has none")
        for name in LAYER_PLACES
    },
    layer_denoising=("integer", "first word of the layers for denoisers, which come last"),
    layer_words=("integer", "words of a pixel that layers of the first samples have"),
    matte_object=("integer", "1 more than where the list of objects stands; 0: there is none"),
    matte_material=("integer", "1 more than where that of materials stands; 0: there is none"),
    mattes=("integer", "lists of names of a pixel"),
    material_numbers=("integer", "where in `distributions` materials have numbers; 0: nowhere"),
    primitive_rows=(
        "integer",
        "where in `distributions` rows of `shapes` have the place of their list of the caller's "
        "rows of primitives, 0: they have none; 0: no row has one",
    ),
    layer_direct=("integer", "1 more than where that of direct light stands; 0: there is none"),
    layer_indirect=("integer", "1 more than where that of indirect light stands; 0: there is none"),
    layer_groups=("integer", "1 more than where those of groups of lights begin; 0: there is none"),
    light_groups=("integer", "where in `distributions` lights have the numbers of their groups"),
    layer_times=("integer", "1 more than where those of light by time begin; 0: there is none"),
    time_bins=("integer", "number of these, without the last, which has all other light"),
    time_first=("real", "optical length where the first begins, over the camera's index [m]"),
    time_rate=("real", "bins in a metre of such lengths [1/m]"),
    near_share=("real", "distance to the camera's near plane over that from there to the far one"),
    slope_before=("integer", "words before a material's row stands 1 more than the row of slopes"),
    camera_slope=("real", "d ln n / d ln lambda at the camera's place"),
)

# the last of them, which only layers need
LAYER_SETTINGS = tuple(m.name for m in SETTINGS.members)[-len(LAYER_PLACES) - 18 :]

SHAPE = Record(
    "ShapeRow",
    "One shape.",
    kind=("integer", "0: triangles; else 1 + position in the table of analytic shapes"),
    front=("integer", "material word of its front"),
    back=("integer", "material word of its back"),
    light=("integer", "first of its rows in `lights`; -1: it does not emit"),
    flags=("integer", "SHAPE_ bits, see CONSTANTS"),
    prim=("integer", "its first primitive"),
    params=("integer", "first word of its parameters in `geometry`; analytic shapes"),
    number=("integer", "its index in the scene's shapes"),
    attributes=("integer", "first word in `attributes` of where each of them lies; 0: it has none"),
)

INSTANCE = Record(
    "InstanceRow",
    "A placed copy of a group's triangles. The origin of their space is the centre of their box.",
    origin=("vec3", "that origin in the world [m]"),
    x=("vec3", "first row of the 3x3 matrix from the world to the group"),
    y=("vec3", "second row of that matrix"),
    z=("vec3", "third row of that matrix"),
    nodes=("natural", "where the nodes of the group's tree begin, in steps of 32 bytes"),
    leaves=("natural", "where the leaves of the group's tree begin, in steps of 32 bytes"),
    prim=("integer", "first primitive of the group"),
    number=("integer", "its index in the scene's shapes"),
)

LIGHT = Record(
    "LightRow",
    "One light that can be chosen: a light off all shapes, an analytic shape, or one triangle.",
    kind=("integer", "position in the table of device lights"),
    params=("integer", "first word of its parameters, in `geometry` or `light_params`"),
    pmf=("real", "probability that it is chosen"),
    keep=("real", "probability that the alias table keeps this row"),
    alias=("integer", "row that the alias table takes otherwise"),
    shape=("integer", "row of its shape in `shapes`; -1: not on a shape"),
    radiance=("integer", "first word of its emission parameter in `light_params`"),
    emission_mode=("integer", "where a shape's light leaves it, see kernels/lights/area.cl"),
)

PHOTON = Record(
    "Photon",
    "A light path where it has met a surface, or collided in a medium, by something sharp.",
    p=("vec3", "where [m]"),
    power=("spectrum", "light that it stands for [W nm^-1]"),
    ratio=("spectrum", "density of the path at each wavelength, over the mean of the four"),
    to_light=("natural", "direction to where it came from, see kernels/core/warp.cl"),
    normal=("natural", "geometric normal, likewise; in a medium its name"),
    mis_ratio=(
        "real",
        "of its light path, over the cosine there, see kernels/transport/mis_ratio.cl",
    ),
    depth=("integer", "surfaces that the light path has met; its group from bit 16 up"),
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
        "values of meshes per vertex or face, see clpt.render.geometry.encode",
    ),
    "shapes": ("uint", "ShapeRow per shape"),
    "instances": ("uint", "InstanceRow per instance"),
    "geometry": ("uint", "parameters of analytic shapes, and of shapes as lights"),
    "spheres": ("float", "x y z and radius per sphere of the shapes `spheres` [m]"),
    "materials": ("uint", "parameters of the leaf materials, a row each"),
    "media": ("uint", "media inside and outside of each shape, see kernels/media/medium.cl"),
    "mixtures": ("uint", "rules of masks and blends, see kernels/stage/mix.cl"),
    "lights": ("uint", "LightRow per light, infinite ones first; then a tree over many"),
    "light_params": ("uint", "parameters of the lights that are not shapes, and emissions"),
    "spectra": ("float", "tabulated spectra on the common grid"),
    "textures": ("uint", "parameters of the textures, a row each"),
    "images": ("uint", "texels of bitmaps, see clpt.render.textures.bitmaps"),
    "texels": ("float", "texels of environment maps, and of bitmaps of spectra"),
    "distributions": (
        "float",
        "tables of filter, environment maps, wavelengths, re-radiation, aims",
    ),
    "camera": ("float", "parameters of the camera"),
}

# Numbers that both sides know. A kernel file includes them as generated/<name>.cl.
SHAPE_BITS = bits(
    "SHAPE_",
    "Bits of ShapeRow.flags.",
    normals="its vertices have normals",
    uvs="its vertices have uv",
    two_sided="the back is shaded as if it were a front",
    one_light="all of its primitives are one row of `lights`",
    many="a primitive is one of its spheres; attributes are per sphere",
    tangents="its vertices have tangents of their own",
    deforms="its vertices move by themselves",
)
MEDIUM_BITS = bits(
    "MEDIUM_",
    "Bits of a medium's name.",
    1 << 26,
    dyed="a dye gives out light",
    sealed="no ray to a light leaves it: its boundaries bend light",
    bytes="its density has 8 bits for each number",
    grid="a density on a grid multiplies its coefficients",
    flies="the stage `flight` takes rays through it",
)
PATH_BITS = bits(
    "PATH_",
    "Bits of Path.state, above its depth and below the number of its shadow rays.",
    1 << 12,
    alive="a ray is in flight",
    fresh="no sample has been begun: there is nothing to deposit",
    done="the slot is at the end of its work list",
    sharp="a surface of a light path was sharp, or all of a camera's path were",
)
LOBE_BITS = bits(
    "LOBE_",
    "Bits of BsdfSample.lobe.",
    reflect="",
    transmit="",
    delta="a direction out of finitely many; pdf is then a probability",
    disperse="the direction holds for the hero wavelength only",
    null="it goes on as if nothing were there, but for its weight",
)
COUNTER_NUMBERS = Constants(
    "COUNTER_",
    "Counters that the host reads while it enqueues, two words each, the lower first.",
    done=(0, "slots that have come to the end of their work list"),
    samples=(1, "paths put on the film"),
    closest=(2, "rays of them"),
    shadow=(3, "shadow rays of them"),
    rejected=(4, "samples that were not finite, or too bright, and count as black"),
    full=(5, "times when a sum was found near the end of its range"),
)
PHOTON_NUMBERS = Constants(
    "PHOTON_",
    "Numbers of photons.",
    unsigned=True,
    none=(0xFFFFFFFF, "stands for the cell of one where there is none"),
    run=(1024, "cells that a work-item sums"),
)
RAY_ORDER = Constants(
    "RAY_",
    "The coarse order of rays: octants of directions, and cells of origins in them.",
    cells=(4, "along each axis"),
    keys=(8 * 4**3 + 1, "octants and cells, and the last for slots without a ray"),
    window=(1 << 14, "slots that are sorted together"),
)
BRICK_SIZES = Constants(
    "BRICK_",
    "Sizes of the bricks of a grid.",
    unsigned=True,
    words=(365, "of its 9^3 points, two in each"),
)
BRICK_CELLS = Constants(
    "BRICK_",
    "Cells of the bricks of a grid along each axis.",
    cells=(8, ""),
    points=(9, "the ends of these cells"),
)
LAYER_SIZES = Constants(
    "LAYER_",
    "Sizes of layers of the first samples of a pixel.",
    most_words=(64, "of all layers together"),
    long_words=(4, "of a number of any size"),
    matte_slots=(12, "names that a matte keeps"),
)
MOTION_SIZES = Constants("MOTION_", "Sizes of tables of motion.", step=(29, "floats of one"))
RERADIATION_SIZES = Constants(
    "RERADIATION_",
    "Sizes of tables of re-radiation.",
    step=(5, "between the nodes of a matrix [nm]"),
)
DENSITY_SIZES = Constants(
    "DENSITY_",
    "Sizes of tables of wavelengths.",
    guides=(1024, "a power of two, so that u * DENSITY_GUIDES is exact"),
)
TREE_BITS = Constants(
    "BVH_",
    "Bits of a link of a tree over boxes.",
    unsigned=True,
    leaf=(0x80000000, "it names an item, no node"),
)
TREE_SIZES = Constants(
    "BVH_",
    "Sizes of trees.",
    depth=(48, "most levels of a leaf below the root"),
    levels=(16, "most levels of nodes 8 wide: a third of that"),
    shapes_depth=(30, "most levels of a leaf below the root of a binary tree over shapes"),
)
TREE_REACHES = Constants(
    "BVH_",
    "How far a tree reaches.",
    reach=(1e12, "[m] so that products of three coordinates stay inside a float"),
)
CURVE_KEYS = Constants(
    "CURVE_",
    "Keys of items on a curve through space.",
    index=(31, "bits of the index of an item, below its code"),
)
CURVE_SIZES = Constants("CURVE_", "Sizes of tables of strands.", words=(24, "of a piece"))
QUERY_SIZES = Constants("QUERY_", "Sizes of queries.", rays=(64, "that a work-item traces"))
GRATING_SIZES = Constants(
    "GRATING_", "Sizes of gratings.", orders=(8, "highest order of diffraction that is followed")
)
GRID_SIZES = Constants(
    "GRID_", "Sizes of tables of directions.", side=(8, "parts along a side of the octahedron")
)
SKY_SIZES = Constants(
    "SKY_",
    "Sizes of the image of the sun.",
    sun_rows=(24, "from its lower edge to its upper one"),
    sun_columns=(12, "from its edge to the middle"),
)
IMPORTANCE = Constants(
    "IMPORTANCE_",
    "The density by which wavelengths are sampled, see `clpt.spectra.cie.sampled`.",
    slope=(0.0072, "[1/nm]"),
    peak=(538.0, "[nm]"),
)
CLOUD_OCTAVES = Constants(
    "CLOUD_",
    "The noise of a cloud.",
    finer=(1.99, "how much finer each octave is than the one before"),
)
MATERIAL_KINDS = Constants(
    "MATERIAL_", "Kinds of material words.", mixture=(0xFF, "of a mask or a blend, no leaf")
)

CONSTANTS: dict[str, Constants[int] | Constants[float]] = {
    "shape_bits": SHAPE_BITS,
    "medium_bits": MEDIUM_BITS,
    "path_bits": PATH_BITS,
    "lobe_bits": LOBE_BITS,
    "counter_numbers": COUNTER_NUMBERS,
    "photon_numbers": PHOTON_NUMBERS,
    "ray_order": RAY_ORDER,
    "brick_sizes": BRICK_SIZES,
    "brick_cells": BRICK_CELLS,
    "layer_sizes": LAYER_SIZES,
    "reradiation_sizes": RERADIATION_SIZES,
    "motion_sizes": MOTION_SIZES,
    "density_sizes": DENSITY_SIZES,
    "tree_bits": TREE_BITS,
    "tree_sizes": TREE_SIZES,
    "tree_reaches": TREE_REACHES,
    "curve_keys": CURVE_KEYS,
    "curve_sizes": CURVE_SIZES,
    "query_sizes": QUERY_SIZES,
    "grating_sizes": GRATING_SIZES,
    "grid_sizes": GRID_SIZES,
    "sky_sizes": SKY_SIZES,
    "importance": IMPORTANCE,
    "cloud_octaves": CLOUD_OCTAVES,
    "material_kinds": MATERIAL_KINDS,
}


def constant_files() -> dict[str, str]:
    """Return the text of CONSTANTS by the names under which kernels include it."""
    return {f"generated/{name}.cl": constants.text() for name, constants in CONSTANTS.items()}
