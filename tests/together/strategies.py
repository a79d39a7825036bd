"""Whole random scenes, drawn from the tables of kinds: `scenes()` is a strategy of Hypothesis.

A kind is drawn by being listed, and its parameters by their roles (`clpt.scene.roles`);
a new role or form needs an entry in ROLES or FORMS here. Images and grids are tiny. The first
choice is always the plainest, so that a scene shrinks to what a failure needs. What the rules of
`clpt.render.flow.check` refuse is left out of parts and of scenes, but of a few.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import Any

import hypothesis.strategies as st
import numpy as np

from clpt import bvh, measured, spectra, transforms
from clpt.errors import SceneError
from clpt.geometry import shapes as geometry
from clpt.images.spectral_exr import SpectralImage
from clpt.lenses import Prescription, Surface
from clpt.render.camera import check_camera
from clpt.render.flow.check import check
from clpt.render.geometry.check import check_shapes
from clpt.render.lights.check import check_light
from clpt.render.materials.check import check_material
from clpt.scene import (
    Scene,
    cameras,
    integrators,
    lights,
    materials,
    media,
    phases,
    roles,
    shapes,
    textures,
)
from clpt.scene.air import clear_air
from clpt.scene.layers import LAYERS
from clpt.scene.motion import Deformation, Keys, Shutter
from clpt.scene.params import Kind, defaults, params
from clpt.scene.roles import Param
from clpt.scene.textures import check_textures
from tests.together.builds import FORMS as FORMS_OF_PROGRAMS
from tests.together.builds import Way

DEEPEST = 3  # kinds in kinds
MOST_GIVEN = 4  # parameters of a kind that are not its defaults
BANDS = np.array([400.0, 500.0, 600.0, 700.0])  # [nm]
SIZE = 4  # pixels of a film's side
PLAIN = integrators.Film(width=SIZE, height=SIZE)


class Drawer:
    """Draws a scene by choices: `choose(n)` is a number from 0 to n. Parts are used again, too."""

    def __init__(self, choose: Callable[[int], int]):
        self.choose = choose
        self.depth = 0
        self.rigid = False  # what is drawn may be turned and moved alone
        self.on_shapes: Sequence[type[Kind]] = (lights.Area,)
        self.made: dict[type, list[Any]] = {}

    def one(self, values: Sequence[Any]) -> Any:
        return values[self.choose(len(values) - 1)] if len(values) > 1 else values[0]

    def maybe(self) -> bool:
        return self.choose(1) == 1

    def several(self, most: int, least: int = 0) -> Iterator[int]:
        """Numbers from 0. A choice before each tells whether it is there, so that all that follows
        from one can be left out by itself."""
        for number in range(most):
            if number >= least and self.choose(2) == 0:
                return
            yield number

    def some(self, values: Sequence[Any], most: int) -> list[Any]:
        """Up to so many of the values, each once."""
        left = list(values)
        found = self.several(min(most, len(left)))
        return [left.pop(self.choose(len(left) - 1)) for _ in found]

    def again(self, base: type, draw: Callable[[], Any]) -> Any:
        """A new part, or one that the scene has already."""
        found = self.made.setdefault(base, [])
        number = self.choose(len(found)) if found else 0
        if number:
            return found[number - 1]
        part = draw()
        found.append(part)
        return part

    def kind(self, classes: Sequence[type[Kind]], **given: Any) -> Any:
        """A kind of these, with some of its parameters; as the constructor's checks allow."""
        cls = self.one(classes)
        declared = params(cls)
        own = WHOLE[cls](self) if cls in WHOLE else {}
        names = [
            name
            for name, param in declared.items()
            if name not in {**own, **given}
            and name not in UNDRAWN
            and param.role.name not in GEOMETRY
        ]
        chosen = self.some(names, MOST_GIVEN)
        self.depth += 1
        for name, param in declared.items():
            needed = param.role.name in NEEDED and defaults(cls)[name] is None
            if name in chosen or (needed and name not in {**own, **given}):
                own[name] = self.value(cls, name, param)
        self.depth -= 1
        return _valid(cls, {**own, **given}, drop=[*chosen, *LOOSE])

    def value(self, cls: type, name: str, param: Param) -> Any:
        if param.textured and self.depth <= DEEPEST and self.maybe():
            return self.texture()
        if name in NAMED:
            return self.one(NAMED[name])
        default = defaults(cls)[name]
        return (FORMS if param.role.place == "host" else ROLES)[param.role.name](
            self, param, default
        )

    def nested(self, base: type, classes: Sequence[type[Kind]], plain: Any) -> Any:
        if self.depth > DEEPEST:
            return plain
        return self.again(base, lambda: self.kind(classes))

    def texture(self, classes: Sequence[type[Kind]] = textures.KINDS) -> Any:
        return self.nested(textures.Texture, classes, textures.Bitmap(image=_image(self)))

    def material(self) -> Any:
        return self.nested(materials.Material, materials.KINDS, materials.Diffuse())

    def medium(self) -> Any:
        if self.depth <= 1 and self.choose(15) == 15:
            return self.again(media.Medium, lambda: clear_air(4.0, 4.0, layers=3))
        return self.nested(media.Medium, media.KINDS, media.Homogeneous(sigma_t=1.0))


def _valid(cls: type[Kind], given: dict[str, Any], drop: Sequence[str]) -> Any:
    """A kind without those parameters that contradict the others: one, or the first of them."""
    names = [name for name in drop if name in given]
    without = [[], *([name] for name in names), *(names[:n] for n in range(2, len(names) + 1))]
    for left_out in without:
        try:
            part = cls(**{name: value for name, value in given.items() if name not in left_out})
            _check(part)
            return part
        except SceneError as error:
            refused = error
    raise refused


def _check(part: Kind) -> None:
    """Raise SceneError for a part that no scene may have."""
    if isinstance(part, shapes.Shape):
        check_shapes([part])
    elif isinstance(part, cameras.Camera):
        check_camera(part, PLAIN)
    elif isinstance(part, materials.Material):
        check_material(part, PLAIN)
    elif isinstance(part, lights.ON_SHAPES):
        check_textures(part)
    elif isinstance(part, lights.Light):
        check_light(part)


# Parameters by role --------------------------------------------------------------------------


def _number(self: Drawer, param: Param, default: Any) -> float:
    low, high = max(param.low, -4.0), min(param.high, 4.0)
    if param.low > 4.0 or param.high < -4.0 or high - low < 1e-3:
        low, high = param.low, min(param.high, 2.0 * param.low + 1.0)
    values = [default, 0.5 * (low + high), high, low]
    if param.positive:
        values = [v for v in values if v]
    return float(self.one([v for v in values if param.low <= v <= param.high]))


def _spectrum(self: Drawer, param: Param, default: Any) -> Any:
    least = 1.0 if param.role is roles.INDEX else max(param.low, 0.0)
    most = min(param.high, 2.0)
    a, b, c = least, 0.5 * (least + most), most
    values: list[Any] = [default, b, (a, b, c), spectra.Tabulated(BANDS, [a, b, c, b], "hold"), c]
    if param.role is not roles.INDEX and not param.positive:
        values.append(0.0)
    if param.role is roles.INDEX:
        values += ["bk7", "gold", spectra.Cauchy(1.5, 0.005)]
    if param.role is roles.EMISSION:
        values += ["d50", spectra.Blackbody(3000.0), spectra.Lines([550.0], [1.0])]
    return self.one(values)


@cache
def _measurement() -> Any:
    even = np.full(4, 0.5 / np.pi)
    directions = {"theta_i": (0.2, 1.2), "phi_i": (-np.pi, 0.0, np.pi)}
    return measured.fit(
        lambda wo, wi: np.broadcast_to(even, (*wi.shape[:-1], 4)), BANDS, normals=4, size=4,
        **directions,
    )  # fmt: skip


@cache
def _dyes() -> tuple[Any, ...]:
    absorbs = spectra.Tabulated(BANDS, [0.5, 0.2, 0.0, 0.0])
    emits = spectra.Tabulated(BANDS, [0.0, 0.5, 1.0, 0.0])
    rows = ((0.0, 0.0), (0.001, 0.0), (0.001, 0.0))
    return (
        spectra.Fluorophore(absorbs, emits),
        spectra.Donaldson((500.0, 550.0, 600.0), (400.0, 450.0), rows),
    )


def _layers(self: Drawer, param: Param, default: Any) -> Any:
    return tuple(self.kind((materials.Layer,)) for _ in self.several(2, 1))


ROLES: dict[str, Callable[[Drawer, Param, Any], Any]] = {
    **dict.fromkeys(
        ("reflectance", "emission", "index", "factor", "coefficient", "quantity"), _spectrum
    ),
    "angular": lambda self, p, d: self.one([(1.0, 1.0), (1.0, 0.5, 2.0)]),
    "real": _number,
    "reradiation": lambda self, p, d: self.one(_dyes()),
    "measurement": lambda self, p, d: _measurement(),
    "merl": lambda self, p, d: measured.MerlTable(values=np.full((2, 2, 2, 3), 0.3, np.float32)),
    "flag": lambda self, p, d: not d,
    "choice": lambda self, p, d: self.one(p.choices),
    "orders": lambda self, p, d: (0.5, 1.0, 0.5),
    "layers": _layers,
}

# Parameters of the host by form --------------------------------------------------------------


def _image(self: Drawer, *_: Any) -> Any:
    return self.one(_images())


@cache
def _images() -> tuple[Any, ...]:
    values = np.linspace(0.1, 0.9, 2 * 4 * 4, dtype=np.float32).reshape(2, 4, 4)
    return (
        values[..., :3],
        (values * 255.0).astype(np.uint8)[..., :3],
        values[..., 0],
        values,
        (values * 255.0).astype(np.uint8),
        SpectralImage(values, BANDS),
        SpectralImage(values, BANDS, emissive=True),
    )


def _cube(self: Drawer, *_: Any) -> Any:
    return self.one([[np.full((2, 2, 3), 0.1 * i, np.float32) for i in range(6)]])


def _volume(self: Drawer, *_: Any) -> Any:
    return self.one(
        [np.full(s, v, np.float32) for s, v in (((2, 2, 2), 1.0), ((3, 2, 1), 0.5), ((1, 1, 1), 0))]
    )


def _temperature(self: Drawer, *_: Any) -> Any:
    return self.one([np.full((2, 2, 2), 2000.0, np.float32), np.full((2, 2, 2), 50.0, np.float32)])


def _colours(self: Drawer, *_: Any) -> Any:
    return np.linspace(0.1, 0.9, 24, dtype=np.float32).reshape(2, 2, 2, 3)


def _matrix(self: Drawer, *_: Any) -> Any:
    rigid = [transforms.translate([0.3, 0.1, 0.2]), transforms.rotate([1.0, 2.0, 0.5], 40.0)]
    sizes = [2.0, 2.0, 2.0], [-1.0, 1.0, 1.0], [1.0, 2.0, 0.5]
    return self.one([*rigid, *([] if self.rigid else map(transforms.scale, sizes))])


def _keys(self: Drawer, *_: Any) -> Any:
    moved = [transforms.translate([0.5, 0.0, 0.0]), transforms.rotate([0.0, 1.0, 0.0], 30.0)]
    moved += [np.eye(4), *([] if self.rigid else [transforms.scale([1.5, 1.5, 1.5])])]
    return Keys((0.0, 1.0), np.array([np.eye(4), self.one(moved)]))


def _lens(self: Drawer, *_: Any) -> Any:
    flint = spectra.Cauchy(1.5, 0.006)
    surfaces = (
        Surface(40.0, 5.0, flint, 10.0),
        Surface(0.0, 2.0, semi_diameter=8.0, stop=True),
        Surface(-40.0, 60.0, semi_diameter=10.0, conic=-0.5),
    )
    return self.one(["double_gauss", "fisheye", Prescription(surfaces)])


def _sensor(self: Drawer, *_: Any) -> Any:
    own = spectra.Sensor(tuple(spectra.Tabulated(BANDS, row) for row in np.eye(4)[:3] + 0.1))
    return self.one(["cie1931", "cie1964", own])


def _shutter(self: Drawer, *_: Any) -> Any:
    return self.one(
        [Shutter(), Shutter(0.0, 1.0, "triangle"), Shutter(0.2, 0.7, [1.0, 2.0]), Shutter(0.5, 0.5)]
    )


def _integer(self: Drawer, param: Param, default: int) -> int:
    return self.one([default, 1, 0, 2, 3, 8])


def _host_number(self: Drawer, param: Param, default: float) -> float:
    return self.one([default, 0.5, 2.0])


def _area_light(self: Drawer, *_: Any) -> Any:
    return self.again(lights.Light, lambda: self.kind(self.on_shapes, motion=None))


def _group(self: Drawer, *_: Any) -> Any:
    def draw() -> Any:
        inner = [cls for cls in shapes.KINDS if cls is not shapes.Instance]
        return shapes.Group(tuple(self.kind(inner, motion=None) for _ in self.several(2, 1)))

    return self.again(shapes.Group, draw)


FORMS: dict[str, Callable[[Drawer, Param, Any], Any]] = {
    "boolean": lambda self, p, d: not d,
    "integer": _integer,
    "number": _host_number,
    "optional_number": lambda self, p, d: self.one([None, 3000.0]),
    "text": lambda self, p, d: self.one(["a", "b"]),
    "names": lambda self, p, d: tuple(self.some(tuple(LAYERS), 5)),
    "vector": lambda self, p, d: self.one([(0.5, 0.25, 1.5), (-0.5, 0.0, 2.0)]),
    "direction": lambda self, p, d: self.one([(0.0, -1.0, 0.2), (1.0, 0.0, 0.0)]),
    "matrix3": lambda self, p, d: np.diag([2.0, 3.0, 1.0]),
    "matrix4": _matrix,
    "material": lambda self, p, d: self.material(),
    "medium": lambda self, p, d: self.medium(),
    "media": lambda self, p, d: tuple(self.medium() for _ in self.several(2, 1)),
    "phase": lambda self, p, d: self.nested(phases.Phase, phases.KINDS, phases.Isotropic()),
    "texture": lambda self, p, d: self.texture((textures.Bitmap,)),
    "textures": lambda self, p, d: (textures.Bitmap(image=_image(self)),),
    "nodes": lambda self, p, d: self.one(GRAPHS),
    "filter": lambda self, p, d: self.kind(integrators.FILTERS),
    "area_light": _area_light,
    "group": _group,
    "grid": lambda self, p, d: d[::2, ::2, ::2],
    "image": _image,
    "volume": _volume,
    "colour_volume": _colours,
    "cube_images": _cube,
    "crop": lambda self, p, d: (1, 1, 2, 2),
    "sensor": _sensor,
    "white_balance": lambda self, p, d: self.one(["d50", 3000.0, (0.33, 0.33)]),
    "number_or_auto": lambda self, p, d: self.one([d, 0, 1, 0.25, 3]),
    "lens": _lens,
    "keys": _keys,
    "shutter": _shutter,
}
GRAPHS: tuple[dict[str, Any], ...] = (
    {"a": {"type": "noise3d", "channels": 3}, "b": {"type": "clamp", "in": "a"}},
    {"a": {"type": "ramplr", "valuer": (0.9, 0.5, 0.1)}},
    {"a": {"type": "fractal2d"}, "b": {"type": "ramp", "in": "a"}},
    {
        "a": {"type": "multiply", "in1": "texcoord1"},
        "b": {"type": "worleynoise2d", "texcoord": "a"},
    },
    {"a": {"type": "extract", "in": "position"}},
)
NEEDED = ("image", "cube_images", "group")  # forms that a kind cannot be without
NAMED: dict[str, Sequence[Any]] = {  # parameters that few values suit
    "max_depth": (8, -1, 1, 2, 3),
    "bits": (16, 8),
    "bands": (0, 3),
    "octaves": (8, 1, 3),
    "resolution": (4,),
    "photon_memory": (1,),
    "subdivision": (1,),
    "displacement_edge": (1.0,),
}
UNDRAWN = ("name", "priority")
GEOMETRY = (  # forms of what depends on one another: functions of WHOLE draw it
    "rows2", "rows3", "rows4", "normals", "triangles", "attributes", "lengths", "number_or_list",
    "deformation", "numbers",
)  # fmt: skip

# Geometry ------------------------------------------------------------------------------------

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32)
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], np.uint32)


def _mesh(self: Drawer) -> dict[str, Any]:
    made: dict[str, Any] = {"vertices": CORNERS, "faces": FACES}
    if self.maybe():
        made["uvs"] = CORNERS[:, :2] + CORNERS[:, 2:]
    if self.maybe():
        up = np.tile(np.float32([0.0, 0.0, 1.0]), (4, 1))
        made["normals"] = self.one([shapes.SMOOTH, up])
        if self.maybe() and made["normals"] is up:
            made["tangents"] = np.tile(np.float32([1.0, 0.0, 0.0, 1.0]), (4, 1))
    if self.maybe():
        made["attributes"] = {
            "vertex_color": CORNERS * 0.5 + 0.2,
            "face_color": np.full((4, 1), 0.5, np.float32),
            "vertex_u1": CORNERS[:, :1],
            "vertex_v1": CORNERS[:, 1:2],
        }
    made["deformation"] = _deformation(self, CORNERS)
    return made


def _deformation(self: Drawer, points: np.ndarray) -> Deformation | None:
    if self.choose(3) != 3:
        return None
    later = points.copy()
    later[:, 0] += 0.25
    return Deformation((0.0, 1.0), np.array([points, later]))


def _spheres(self: Drawer) -> dict[str, Any]:
    centers = np.float32([[0, 0, 0], [1, 0, 0.5], [0, 1.5, 0]])
    made: dict[str, Any] = {"centers": centers, "radii": self.one([0.25, (0.1, 0.2, 0.3)])}
    if self.maybe():
        made["attributes"] = {"vertex_color": np.full((3, 3), 0.5, np.float32)}
    made["deformation"] = _deformation(self, centers)
    return made


def _curves(self: Drawer) -> dict[str, Any]:
    points = np.float32([[0, 0, 0, 0.1], [0.3, 0, 1, 0.1], [0, 0.2, 2, 0.08], [0, 0, 3, 0.05]])
    return {
        "points": points,
        "basis": self.one(shapes.BASES),
        "deformation": _deformation(self, points),
    }


def _sdf_grid(self: Drawer) -> dict[str, Any]:
    return {"values": defaults(shapes.SdfGrid)["values"][::2, ::2, ::2], "pieces": self.one([1, 2])}


def _cloud(self: Drawer) -> dict[str, Any]:
    return {"resolution": 4}


def _sky(self: Drawer) -> dict[str, Any]:
    """One of two skies, as each takes seconds."""
    given = [n for n, p in params(lights.Sky).items() if p.role is roles.REAL and "scale" not in n]
    usual = defaults(lights.Sky)
    low = {"sun_elevation": -5.0, "altitude": 3000.0}
    return {**{name: usual[name] for name in given}, **self.one([{}, low]), "ground": 0.2}


def _envmap(self: Drawer) -> dict[str, Any]:
    return {"image": self.one([one for one in _images() if getattr(one, "emissive", True)])}


def _tabulated(self: Drawer) -> dict[str, Any]:
    return self.one(
        [
            {"values": (1.0, 0.5, 2.0)},
            {"values": ((1.0, 2.0), (2.0, 1.0)), "wavelengths": (450.0, 600.0)},
        ]
    )


LOOSE = ("deformation", "attributes", "tangents", "normals", "uvs")  # that a mesh may do without
WHOLE: dict[type, Callable[[Drawer], dict[str, Any]]] = {  # parameters that depend on one another
    shapes.Mesh: _mesh,
    shapes.Spheres: _spheres,
    shapes.Curves: _curves,
    shapes.SdfGrid: _sdf_grid,
    media.Cloud: _cloud,
    phases.Tabulated: _tabulated,
    lights.Sky: _sky,
    lights.Envmap: _envmap,
}

# Scenes --------------------------------------------------------------------------------------

PLACED_LIGHTS = tuple(cls for cls in lights.KINDS if cls not in lights.ON_SHAPES)


def scene_of(choose: Callable[[int], int]) -> Scene:
    """A scene of the tables' kinds, by choices as `Drawer` has them; of zeros alone the plainest.

    What `check` refuses is rare, but not left out.
    """
    scene = _any_scene(choose)
    return scene if choose(FEW) == FEW else accepted(scene)


FEW = 15  # scenes of which one may have what is refused
MOST_LEFT_OUT = 16


def accepted(scene: Scene) -> Scene:
    """A scene without what `check` refuses in it, one after the other."""
    for _ in range(MOST_LEFT_OUT):
        try:
            check(scene)
            break
        except SceneError as error:
            scene = _plainer(scene, error.where or "")
    return scene


def _plainer(scene: Scene, where: str) -> Scene:
    """A scene in which what stands there is as plain as can be."""
    part, _, name = where.partition(".")
    if part == "film":
        film = dataclasses.replace(scene.film, **{name: defaults(integrators.Film)[name]})
        return dataclasses.replace(scene, film=film)
    if part.startswith("lights["):
        at = int(part[len("lights[") : -1])
        return dataclasses.replace(scene, lights=[*scene.lights[:at], *scene.lights[at + 1 :]])
    if part == "integrator":
        return dataclasses.replace(scene, integrator=integrators.Path())
    left = [_plain_shape(shape, where) for shape in scene.shapes]
    if any(new is not old for new, old in zip(left, scene.shapes, strict=True)):
        return dataclasses.replace(scene, shapes=[one for one in left if one is not None])
    return dataclasses.replace(scene, camera=cameras.Perspective())


def _plain_shape(shape: Any, where: str) -> Any:
    """A shape without what its kind can do without, if it is what stands there; or nothing."""
    inner = getattr(getattr(shape, "group", None), "shapes", ())
    names = {geometry.where(one) for one in (shape, *inner)}
    if where.partition(".")[0] not in names:
        return shape
    usual = defaults(shapes.Mesh)
    plain = {name: usual[name] for name in SURFACE}
    made = None if inner else dataclasses.replace(shape, **plain)
    return made if made is None or shown(made) != shown(shape) else None


SURFACE = ("material", "emission", "interior", "exterior", "priority", "motion")


def _any_scene(choose: Callable[[int], int]) -> Scene:
    """A scene of whatever goes together, or not."""
    self = Drawer(choose)
    integrator = self.kind(integrators.KINDS)
    traced = isinstance(integrator, integrators.ParticleTracer)
    if traced:
        self.on_shapes = lights.ON_SHAPES
    things: list[Any] = []
    for _ in self.several(4, 1):
        shape = self.kind(shapes.KINDS)
        copies = self.one([1, 2, 17]) if isinstance(shape, shapes.Instance) else 1
        things += [shape] * copies
    if choose(7) == 7:
        things = [_as_body(self, thing) for thing in things]
    self.rigid = True
    lamps = [self.kind(PLACED_LIGHTS) for _ in self.several(3)]
    lamps += [lights.Point(position=(0.0, 0.0, 2.0 + i)) for i in range(self.one([0] * 7 + [17]))]
    camera = self.kind([cls for cls in cameras.KINDS if not traced or cls.connects])
    plain = {} if isinstance(integrator, integrators.HAVE_LAYERS) else {"layers": ()}
    return Scene(
        camera=camera,
        shapes=things,
        lights=lamps,
        integrator=integrator,
        sampler=self.kind(integrators.SAMPLERS),
        film=self.kind((integrators.Film,), width=SIZE, height=SIZE, **plain),
        spp=self.one([1, 4]),
        noise=self.one([None, None, 0.1]),
    )


def _as_body(self: Drawer, shape: Any) -> Any:
    """A shape that overlaps others by a priority, where it is one that can."""
    if shape.is_open or isinstance(shape, shapes.Instance):
        return shape
    if not (shape.material.bounds_body or shape.material.is_null):
        return shape
    return dataclasses.replace(shape, priority=self.one([0, 1, 2]), exterior=None)


def way_of(choose: Callable[[int], int]) -> Way:
    """How a device renders it, by choices."""
    layouts, lanes = tuple(bvh.LAYOUTS), (1, 8)
    return Way(
        layouts[choose(len(layouts) - 1)],
        lanes[choose(1)],
        FORMS_OF_PROGRAMS[choose(len(FORMS_OF_PROGRAMS) - 1)],
    )


@st.composite
def scenes(draw: Any) -> Scene:
    """`scene_of` as a strategy."""
    return scene_of(lambda most: draw(st.integers(0, most)))


@st.composite
def ways(draw: Any) -> Way:
    """`way_of` as a strategy."""
    return way_of(lambda most: draw(st.integers(0, most)))


# Printing ------------------------------------------------------------------------------------


def shown(value: Any) -> str:
    """A scene, or a part, as Python has it: only what differs from the defaults."""
    if isinstance(value, Scene):
        names = ("camera", "shapes", "lights", "integrator", "sampler", "film", "spp", "noise")
        rows = "".join(f"    {name}={shown(getattr(value, name))},\n" for name in names)
        return f"Scene(\n{rows})"
    if isinstance(value, Kind):
        usual = defaults(type(value))
        given = {
            name: shown(getattr(value, name))
            for name in params(type(value))
            if shown(getattr(value, name)) not in (shown(usual[name]), f"Constant({usual[name]})")
        }
        inner = ", ".join(f"{name}={text}" for name, text in given.items())
        return f"{type(value).__name__}({inner})"
    if isinstance(value, shapes.Group):
        return f"Group({shown(value.shapes)})"
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(shown, value))}]"
    if isinstance(value, np.ndarray):
        if value.size > 48:
            return f"array(..., {value.dtype}, shape={value.shape})"
        small = np.array2string(value, separator=", ", threshold=20).replace("\n", "")
        return f"array({small}, {value.dtype}, shape={value.shape})"
    if isinstance(value, spectra.Constant):
        return f"Constant({value.value})"
    if isinstance(value, spectra.Tabulated) and len(value.lambdas) > 8:
        return f"Tabulated({len(value.lambdas)} values)"
    return repr(value)
