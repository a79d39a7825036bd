"""Scenes as plain data, without OpenCL. `KINDS` is the table of all kinds by category."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import FunctionType, ModuleType
from typing import Any, ClassVar

import numpy as np

from clpt.arrays import is_number, whole
from clpt.choices import MOST_SEED
from clpt.errors import SceneError
from clpt.files.budget import Account
from clpt.scene import (
    cameras,
    integrators,
    lights,
    materials,
    media,
    paths,
    phases,
    shapes,
    simulations,
    studio,
    textures,
    trimeshes,
)
from clpt.scene.integrators import Auto, Film, Sobol
from clpt.scene.lights import Light
from clpt.scene.params import Kind
from clpt.scene.shapes import Shape
from clpt.scene.studio import Up

__all__ = [
    "KINDS",
    "Film",
    "Scene",
    "cameras",
    "integrators",
    "kinds",
    "lights",
    "materials",
    "media",
    "phases",
    "shapes",
    "textures",
]

KINDS: dict[str, tuple[type[Kind], ...]] = {
    "material": materials.KINDS,
    "medium": media.KINDS,
    "phase": phases.KINDS,
    "light": lights.KINDS,
    "shape": shapes.KINDS,
    "camera": cameras.KINDS,
    "texture": textures.KINDS,
    "integrator": integrators.KINDS,
    "sampler": integrators.SAMPLERS,
    "filter": integrators.FILTERS,
}


def __dir__() -> list[str]:
    return __all__


def _show_own(module: ModuleType) -> None:
    """Let TAB after a module's name show its definitions without its imports."""
    defined = (type, FunctionType)
    names = [
        name
        for name, value in vars(module).items()
        if not name.startswith("_")
        and (
            name.isupper()
            or (isinstance(value, defined) and value.__module__.startswith(module.__name__))
        )
    ]
    vars(module)["__dir__"] = lambda: names


for _module in (cameras, integrators, lights, materials, media, phases, shapes, textures):
    _show_own(_module)


def kinds(category: str) -> dict[str, type[Kind]]:
    """Return the kinds of a category by their names in scene files."""
    return {cls.kind: cls for cls in KINDS[category]}


@dataclass
class Scene:
    """A whole scene.

    camera: the view. shapes, lights: the content; a light on a surface is its shape's `emission`.
    integrator: the algorithm that follows light; sampler: the source of its random numbers; film:
    size, mode, filter and colours of the picture. spp: samples of a pixel, for `clpt.render`;
    noise: pixels below this relative noise get no more samples, None for no such limit, see
    clpt.render.wavefront.adaptive; seed: of the random numbers. name: for messages and files.
    warnings: features of a file that its loader ignored; extra: further content of the file, for
    people; account: the memory and time that loading took; lowering draws from it too.

    Raises SceneError unless `spp` is a whole number above 0 and `noise` a number above 0 or None.
    """

    camera: cameras.Camera
    shapes: list[shapes.Shape] = field(default_factory=list)
    lights: list[lights.Light] = field(default_factory=list)
    integrator: integrators.Integrator = field(default_factory=Auto)
    sampler: integrators.Sampler = field(default_factory=Sobol)
    film: Film = field(default_factory=Film)
    spp: int = 64
    noise: float | None = None
    seed: int = 0
    name: str = ""
    warnings: list[str] = field(default_factory=list)
    extra: dict[str, Any] = field(default_factory=dict)
    account: Account | None = field(default=None, repr=False, compare=False)

    # Renders the picture for a notebook; clpt/__init__ sets it, since scenes import no renderer.
    _picture: ClassVar[Callable[[Scene], bytes] | None] = None

    def _repr_png_(self) -> bytes | None:
        """Return a small picture of the scene as PNG, for notebooks."""
        return None if Scene._picture is None else Scene._picture(self)

    @classmethod
    def studio(
        cls,
        subject: object,
        *,
        camera: cameras.Camera | None = None,
        lights: Sequence[Light] = (),
        up: Up = "y",
        name: str = "",
    ) -> Scene:
        """Return a scene of shapes in a photographer's studio, as `clpt render mesh.ply` makes it.

        subject: a shape, a `trimesh.Trimesh`, or a list of them. camera: by default it looks from
        the front and above, and frames the whole subject. lights: by default a warm key light and
        a cool fill, over a ground that curves up to a backdrop. up: "y", with +z as the front; or
        "z" as in CAD, with -y as the front. name: of the scene.

        Raises SceneError for shapes too large to be framed.
        """
        listed = [subject] if trimeshes.is_mesh(subject) else _listed(subject, "shapes")
        shown: list[Shape] = []
        for i, part in enumerate(listed):
            if not isinstance(part, Shape):
                if trimeshes.is_mesh(part):
                    part = shapes.Mesh.from_trimesh(part)
                _check_kind(part, Shape, f"shapes[{i}]")
            shown.append(part)
        parts = studio.parts(shown, camera=camera, own_lights=lights, up=up)
        return cls(**parts, name=name)

    @classmethod
    def from_trimesh(cls, scene: Any, *, up: Up = "y", name: str = "") -> Scene:
        """Return a `trimesh.Scene` in the studio: its meshes where they are, with their materials.

        Its camera takes the place of the studio's, if it has a camera. up, name: see `studio`.
        Geometry other than meshes, such as a path, is left out with a warning.

        Raises SceneError for an object that is not a scene of trimesh.
        """
        if not trimeshes.is_scene(scene):
            message = f"must be a trimesh.Scene, not {type(scene).__name__}; "
            raise SceneError(message + "Scene.studio takes a mesh", where="scene")
        meshes: dict[str, shapes.Mesh] = {}
        placed: list[Shape] = []
        left_out: list[str] = []
        for node in scene.graph.nodes_geometry:
            to_world, key = scene.graph[node]
            geometry = scene.geometry[key]
            if not trimeshes.is_mesh(geometry):
                left_out.append(f"{key}: a {type(geometry).__name__} is no mesh, left out")
                continue
            if key not in meshes:
                meshes[key] = shapes.Mesh.from_trimesh(geometry, name=str(key))
            placed.append(replace(meshes[key], to_world=np.array(to_world), name=str(node)))
        camera = None
        if scene.has_camera:
            camera = trimeshes.camera_of(scene.camera, scene.camera_transform)
        built = cls.studio(placed, camera=camera, up=up, name=name)
        built.warnings = list(dict.fromkeys(left_out))
        return built

    @classmethod
    def from_mujoco(
        cls,
        model: simulations.MjModel,
        state: simulations.MjData,
        *,
        camera: str | int | None = None,
        groups: int = 3,
    ) -> Scene:
        """Return a `mujoco.MjModel` in a state, a `mujoco.MjData`: geoms, lights and a camera.

        camera: by name or number; None: the free camera as it begins. groups: of geoms from 0 on
        that are shown. Textures are left out with a warning.

        Raises SceneError for other objects, and for a camera that the model lacks.
        """
        if not hasattr(model, "ngeom") or not hasattr(state, "geom_xpos"):
            message = f"must be a mujoco.MjModel and its MjData, not {type(model).__name__}"
            raise SceneError(message, where="model")
        view = simulations.mujoco_camera(model, state, camera)
        return cls(
            camera=view,
            shapes=list(simulations.mujoco_shapes(model, state, groups)),
            lights=simulations.mujoco_lights(model, state, view),
            warnings=simulations.mujoco_warnings(model),
        )

    @classmethod
    def from_pyvista(cls, plotter: simulations.Plotter, *, up: Up = "z") -> Scene:
        """Return the meshes of a `pyvista.Plotter` in the studio, seen by its camera and window.

        Colors of scalars are those of the plotter's tables. up: see `studio`.

        Raises SceneError for an object that is no plotter, and as `studio` does.
        """
        if not hasattr(plotter, "renderer") or not hasattr(plotter, "window_size"):
            message = f"must be a pyvista.Plotter, not {type(plotter).__name__}"
            raise SceneError(message, where="plotter")
        placed = list(simulations.pyvista_shapes(plotter))
        built = cls.studio(placed, camera=simulations.pyvista_camera(plotter), up=up)
        width, height = plotter.window_size
        return replace(built, film=replace(built.film, width=int(width), height=int(height)))

    def parameters(self) -> dict[str, Any]:
        """Return all parameters by their paths, as "ball.material.reflectance", in their order.

        A path begins with camera, film, integrator, sampler, spp, noise or seed; with the name of
        a shape or of a material; or with shapes[0] or lights[0]. See also `changed`.
        """
        return paths.parameters(self)

    def __getitem__(self, path: str) -> Any:
        """Return the parameter or the object at a path, see `parameters`.

        Raises SceneError, with the nearest names, for a path that leads to nothing.
        """
        return paths.get(self, path)

    def changed(self, values: Mapping[str, Any]) -> Scene:
        """Return a copy of the scene with other values, by their paths.

        `renderer.update(scene=scene.changed({"ball.material.reflectance": 0.2}))` renders it. An
        object that several shapes share, such as a material, changes at all of them.

        Raises SceneError for a path that leads to nothing, and a value that its parameter refuses.
        """
        scene = self
        for path, value in values.items():
            parts: dict[str, Any] = paths.changes(scene, path, value)
            scene = replace(scene, **parts)
        return scene

    def __post_init__(self) -> None:
        self.shapes, self.lights = _listed(self.shapes, "shapes"), _listed(self.lights, "lights")
        check_parts(self)
        self.spp = whole(self.spp, 1, where="spp")
        self.seed = checked_seed(self.seed)
        if self.noise is not None:
            self.noise = checked_noise(self.noise)


def checked_seed(seed: object) -> int:
    """Return a seed. Raises SceneError unless it is a whole number of 32 bits, as in kernels."""
    return whole(seed, 0, MOST_SEED, where="seed")


def check_parts(scene: Scene) -> None:
    """Raise SceneError for a part of a scene of the wrong category."""
    _check_kind(scene.camera, cameras.Camera, "camera")
    _check_kind(scene.integrator, integrators.Integrator, "integrator")
    _check_kind(scene.sampler, integrators.Sampler, "sampler")
    _check_kind(scene.film, Film, "film")
    held: tuple[tuple[str, Sequence[object], type[Kind]], ...] = (
        ("shapes", scene.shapes, Shape),
        ("lights", scene.lights, Light),
    )
    for name, members, base in held:
        for i, member in enumerate(members):
            if not isinstance(member, base):  # there may be a million
                _check_kind(member, base, f"{name}[{i}]")


def _listed(value: object, name: str) -> list[Any]:
    """Return a list unchanged, a kind or another iterable as a list. Raises SceneError."""
    if isinstance(value, (list, Kind)):
        return value if isinstance(value, list) else [value]
    try:
        return list(value)  # type: ignore[call-overload]
    except TypeError:
        raise SceneError(f"must be a list of {name}, not {value!r}", where=name) from None


def _check_kind(value: object, base: type[Kind], where: str) -> None:
    """Raise SceneError for a value that is no kind of a category."""
    if not isinstance(value, base):
        message = f"must be of a kind of {base.__name__.lower()}, not {value!r}"
        raise SceneError(message, where=where)


def checked_noise(noise: object) -> float:
    """Return a limit of noise. Raises SceneError unless it is a finite number above 0."""
    if not is_number(noise) or not 0.0 < noise < math.inf:
        message = f"must be a number above zero, such as 0.02, not {noise!r}"
        raise SceneError(message, where="noise")
    return float(noise)
