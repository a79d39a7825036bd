"""Scenes of MuJoCo and PyVista as clpt has them: shapes, materials, lights and the camera."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import images, transforms
from clpt.arrays import Floats
from clpt.errors import SceneError
from clpt.scene import lights, shapes
from clpt.scene.cameras import Camera, Orthographic, Perspective
from clpt.scene.materials import Diffuse, Mask, Material, Principled, TwoSided
from clpt.scene.trimeshes import coloured
from clpt.spectra import RGBIlluminant

# Of packages that need not be installed.
MjModel = Any
MjData = Any
Plotter = Any
VtkObject = Any

PLANE, SPHERE, CAPSULE, ELLIPSOID, CYLINDER, BOX, MESH = 0, 2, 3, 4, 5, 6, 7  # mjtGeom
SPOT, DIRECTIONAL = 0, 1  # mjtLightType
UNSAID = (0.5, 0.5, 0.5, 1.0)  # rgba of a geom without a color
WIDE = 1000.0  # half a side of an infinite plane [m]
PHYSICAL = 3  # of VTK's kinds of shading


def _linear(rgb: ArrayLike) -> tuple[float, float, float]:
    """Return a color of a screen, such as MuJoCo's and VTK's, as linear Rec. 709."""
    r, g, b = images.srgb_to_linear(np.clip(np.asarray(rgb, np.float32)[:3], 0.0, 1.0))
    return float(r), float(g), float(b)


def mujoco_shapes(model: MjModel, state: MjData, groups: int) -> Iterator[shapes.Shape]:
    """Yield shapes of the geoms of a MuJoCo model in a state; those without a shape have none.

    A geom has its name, else that of its body with its number.
    """
    for i in range(model.ngeom):
        rgba = model.geom_rgba[i]
        number = int(model.geom_matid[i])
        if number >= 0 and np.allclose(rgba, UNSAID):
            rgba = model.mat_rgba[number]
        if model.geom_group[i] >= groups or not rgba[3] > 0.0:
            continue
        place = np.eye(4)
        place[:3, :3] = np.reshape(state.geom_xmat[i], (3, 3))
        place[:3, 3] = state.geom_xpos[i]
        body = model.body(int(model.geom_bodyid[i])).name
        shared: dict[str, Any] = {
            "material": _mujoco_material(model, number, rgba),
            "name": model.geom(i).name or f"{body}.{i:03d}",
        }
        if number >= 0 and model.mat_emission[number] > 0.0:
            glow = float(model.mat_emission[number]) * np.array(_linear(rgba))
            shared["emission"] = lights.Area(radiance=RGBIlluminant(*map(float, glow)))
        yield from _geom(model, i, place, shared)


def _geom(model: MjModel, i: int, place: Floats, shared: dict[str, Any]) -> Iterator[shapes.Shape]:
    kind, (a, b, c) = int(model.geom_type[i]), map(float, model.geom_size[i])
    if kind == PLANE:
        scale = transforms.scale([a or WIDE, b or WIDE, 1.0])
        yield shapes.Rectangle(to_world=place @ scale, **shared)
    elif kind == BOX:
        yield shapes.Cube(to_world=place @ transforms.scale([a, b, c]), **shared)
    elif kind == SPHERE:
        yield shapes.Sphere(radius=a, to_world=place, **shared)
    elif kind == ELLIPSOID:
        vertices, faces = _ball()
        stretched = (vertices * [a, b, c]).astype(np.float32)
        yield shapes.Mesh(vertices=stretched, faces=faces, to_world=place, **shared)
    elif kind in (CAPSULE, CYLINDER):
        yield shapes.Cylinder(p0=(0, 0, -b), p1=(0, 0, b), radius=a, to_world=place, **shared)
        for end in (-b, b):
            shift = place @ transforms.translate([0.0, 0.0, end])
            if kind == CAPSULE:
                yield shapes.Sphere(radius=a, to_world=shift, **shared)
            else:
                turn = transforms.rotate([1, 0, 0], 180.0 if end < 0.0 else 0.0)
                yield shapes.Disk(to_world=shift @ turn @ transforms.scale([a, a, 1.0]), **shared)
    elif kind == MESH:
        number = int(model.geom_dataid[i])
        first, face = int(model.mesh_vertadr[number]), int(model.mesh_faceadr[number])
        vertices = model.mesh_vert[first : first + int(model.mesh_vertnum[number])]
        faces = model.mesh_face[face : face + int(model.mesh_facenum[number])]
        yield shapes.Mesh(
            vertices=np.array(vertices, np.float32), faces=np.array(faces, np.uint32),
            to_world=place, **shared,
        )  # fmt: skip


def mujoco_warnings(model: MjModel) -> list[str]:
    """Return what `mujoco_shapes` leaves out of a model."""
    known = (PLANE, SPHERE, CAPSULE, ELLIPSOID, CYLINDER, BOX, MESH)
    found = [f"geom {i}: its type {kind} has no shape here, left out"
             for i, kind in enumerate(model.geom_type) if kind not in known]  # fmt: skip
    if np.any(np.asarray(model.mat_texid) >= 0):
        found.append("textures of materials are left out: their colors stay")
    return found


def _ball() -> tuple[NDArray[np.float64], NDArray[np.uint32]]:
    """Return a unit ball of 64 x 32 quadrilaterals as vertices and faces."""
    around, down = 64, 32
    theta = np.linspace(0.0, np.pi, down + 1)[:, None]
    phi = np.arange(around) / around * 2.0 * np.pi
    parts = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)
    vertices = np.stack(np.broadcast_arrays(*parts), axis=-1).reshape(-1, 3)
    row, column = (index.ravel() for index in np.mgrid[:down, :around])
    a, b = row * around + column, row * around + (column + 1) % around
    faces = np.concatenate(
        [np.stack([a, a + around, b + around], 1), np.stack([a, b + around, b], 1)]
    )
    return vertices, faces.astype(np.uint32)


def _mujoco_material(model: MjModel, number: int, rgba: ArrayLike) -> Material:
    """Return a matt surface, or one as shiny and metallic as its material; see through by alpha."""
    color = _linear(rgba)
    material: Material = Diffuse(reflectance=color)
    if number >= 0:
        said = float(model.mat_roughness[number]), float(model.mat_metallic[number])
        rough = said[0] if said[0] >= 0.0 else 1.0 - float(model.mat_shininess[number])
        material = Principled(
            base_color=color, roughness=min(max(rough, 0.02), 1.0), metallic=max(said[1], 0.0)
        )
    alpha = float(np.asarray(rgba)[3])
    return TwoSided(front=material) if alpha >= 1.0 else Mask(material=material, opacity=alpha)


def mujoco_lights(model: MjModel, state: MjData, view: Camera) -> list[lights.Light]:
    """Return the lights of a model, with its ambient light and its headlight along the view.

    MuJoCo's numbers have no unit. A light's diffuse color d makes a white surface that faces it as
    bright as d; a spot's at the middle of the model.
    """
    head = model.vis.headlight
    ambient = np.array(head.ambient) if head.active else np.zeros(3)
    found: list[lights.Light] = []
    if head.active and np.any(head.diffuse):
        found.append(_distant(np.asarray(view.to_world)[:3, 2], head.diffuse))
    types = model.light_type if hasattr(model, "light_type") else model.light_directional
    for i in range(model.nlight):
        if not model.light_active[i]:
            continue
        ambient = ambient + model.light_ambient[i]
        position, direction = (np.array(a[i]) for a in (state.light_xpos, state.light_xdir))
        if types[i] == DIRECTIONAL:
            found.append(_distant(direction, model.light_diffuse[i]))
            continue
        square = float(((model.stat.center - position) ** 2).sum())
        intensity = RGBIlluminant(*(np.pi * max(square, 1e-6) * np.array(model.light_diffuse[i])))
        cutoff = float(model.light_cutoff[i])
        if types[i] == SPOT and cutoff < 180.0:
            up = [1.0, 0.0, 0.0] if abs(direction[2]) > 0.9 else [0.0, 0.0, 1.0]
            place = transforms.look_at(position, position + direction, up)
            found.append(lights.Spot(to_world=place, intensity=intensity, cutoff=cutoff,
                                     beam_width=0.8 * cutoff))  # fmt: skip
        else:
            found.append(lights.Point(position=tuple(position), intensity=intensity))
    if ambient.any():
        found.append(lights.Constant(radiance=RGBIlluminant(*map(float, ambient))))
    return found


def _distant(direction: ArrayLike, diffuse: ArrayLike) -> lights.Light:
    irradiance = RGBIlluminant(*(float(np.pi * level) for level in np.asarray(diffuse)))
    return lights.Directional(direction=tuple(np.asarray(direction)), irradiance=irradiance)


def mujoco_camera(model: MjModel, state: MjData, camera: str | int | None) -> Perspective:
    """Return a camera of a model by its name or number; None: the free camera at its beginning.

    Raises SceneError for a camera that the model lacks.
    """
    if camera is None:
        view, extent = model.vis.global_, float(model.stat.extent)
        azimuth, elevation = np.radians(view.azimuth), np.radians(view.elevation)
        level = np.cos(elevation)
        ahead = np.array([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)])
        middle = np.array(model.stat.center)
        place = transforms.look_at(middle - 1.5 * extent * ahead, middle, [0.0, 0.0, 1.0])
        return Perspective(to_world=place, fov=float(view.fovy), fov_axis="y")
    names = [model.camera(i).name for i in range(model.ncam)]
    if camera not in names and camera not in range(model.ncam):
        raise SceneError(
            f"has no camera {camera!r}, but {', '.join(names) or 'none'}", where="model"
        )
    number = names.index(camera) if isinstance(camera, str) else camera
    place = np.eye(4)
    place[:3, :3] = np.reshape(state.cam_xmat[number], (3, 3)) @ np.diag([-1.0, 1.0, -1.0])
    place[:3, 3] = state.cam_xpos[number]
    return Perspective(to_world=place, fov=float(model.cam_fovy[number]), fov_axis="y")


def pyvista_shapes(plotter: Plotter) -> Iterator[shapes.Mesh]:
    """Yield meshes of the visible actors of a PyVista plotter, as they are colored there."""
    for name, actor in plotter.renderer.actors.items():
        mapper = actor.mapper if hasattr(actor, "mapper") else None
        if mapper is None or not hasattr(mapper, "dataset") or not actor.GetVisibility():
            continue
        data = mapper.dataset.copy(deep=False)
        if not data.n_cells:
            continue
        colors = _mapped(mapper)
        home = ""
        if colors is not None:
            per_point = colors.GetNumberOfTuples() == data.n_points
            home = "vertex_color" if per_point else "face_color"
            (data.point_data if per_point else data.cell_data)[home] = _bytes(colors)
        surface = data.extract_surface().triangulate()
        if not surface.n_cells:
            continue
        matrix = actor.GetMatrix()
        place = np.array([[matrix.GetElement(i, j) for j in range(4)] for i in range(4)])
        attributes = {}
        if home:
            levels = np.asarray(surface[home])[:, :3].astype(np.float32) / np.float32(255.0)
            attributes[home] = images.srgb_to_linear(levels)
        yield shapes.Mesh(
            vertices=np.asarray(surface.points, np.float32),
            faces=np.asarray(surface.faces).reshape(-1, 4)[:, 1:].astype(np.uint32),
            attributes=attributes, to_world=place, name=str(name),
            material=_pyvista_material(actor.prop, home),
        )  # fmt: skip


def _mapped(mapper: VtkObject) -> Any:
    """Return the colors of a mapper's scalars as an array of VTK, or None."""
    if not mapper.GetScalarVisibility():
        return None
    before = mapper.GetInterpolateScalarsBeforeMapping()  # it gives places in a texture
    mapper.SetInterpolateScalarsBeforeMapping(False)
    colors = mapper.MapScalars(1.0)
    mapper.SetInterpolateScalarsBeforeMapping(before)
    return colors


def _bytes(colors: VtkObject) -> NDArray[np.uint8]:
    """Return the rows of an array of VTK."""
    width, count = colors.GetNumberOfComponents(), colors.GetNumberOfTuples()
    return np.frombuffer(memoryview(colors), np.uint8).reshape(count, width).copy()


def _pyvista_material(prop: VtkObject, home: str) -> Material:
    """Return the surface of an actor's property; home: the attribute of its colors, or ""."""
    color = _linear(prop.color.float_rgb)
    material: Material = TwoSided(front=Diffuse(reflectance=color))
    if home:
        material = coloured(home)
    elif int(prop.interpolation.value) == PHYSICAL:
        rough = min(max(float(prop.roughness), 0.02), 1.0)
        shiny = Principled(base_color=color, metallic=float(prop.metallic), roughness=rough)
        material = TwoSided(front=shiny)
    opacity = float(prop.opacity)
    return material if opacity >= 1.0 else Mask(material=material, opacity=opacity)


def pyvista_camera(plotter: Plotter) -> Camera:
    """Return the camera of a plotter, with its window's aspect."""
    camera, (width, height) = plotter.camera, plotter.window_size
    place = transforms.look_at(camera.position, camera.focal_point, camera.up)
    if camera.parallel_projection:
        half = float(camera.parallel_scale) * width / height
        return Orthographic(to_world=place @ transforms.scale([half, half, 1.0]))
    return Perspective(to_world=place, fov=float(camera.view_angle), fov_axis="y")
