"""Scenes as stages: meshes, instances, lights and the camera, with OpenPBR and previews of it."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdRender, UsdShade, UsdUtils, Vt

from clpt import images, transforms
from clpt.arrays import Floats, on_host
from clpt.errors import SceneError
from clpt.files import output_files
from clpt.formats import as_meshes
from clpt.formats.as_openpbr import MIRRORED, rgb, split
from clpt.formats.gltf.cameras_lights import FROM_GLTF
from clpt.formats.usd.export_materials import MaterialWriter, unused
from clpt.formats.usd.lights import TURNED
from clpt.geometry import lamps
from clpt.scene import Scene, lights
from clpt.scene import shapes as kinds
from clpt.scene.cameras import Orthographic, Perspective, ThinLens
from clpt.scene.motion import Keys
from clpt.scene.pixels import image_file
from clpt.scene.shapes import Group, Shape
from clpt.scene.viewpoint import upright

RATE = 24.0  # time codes in a second
WIDTH = 0.36  # of a camera's aperture, in tenths of a metre: 36 mm
BALL = 0.01  # radius of what stands for a point that shines [m]
CURVES = {"bspline": "bspline", "bezier": "bezier", "catmull_rom": "catmullRom"}
STEPS = 16  # samples from a key of motion to the next: OpenUSD does not turn between them
TYPES = Sdf.ValueTypeNames
_Array = TypeVar("_Array", Vt.Vec2fArray, Vt.Vec3fArray)


def save(scene: Scene, path: Path) -> list[str]:
    """Write a scene as a stage; return what was lost, a sentence each.

    path: .usd, .usda, .usdc, or .usdz for a package with its images. Raises SceneError where it
    cannot be written.
    """
    try:
        if path.suffix.lower() != ".usdz":
            with output_files.replacing(path) as partial:
                return _written(scene, partial)
        with output_files.replacing(path) as partial, tempfile.TemporaryDirectory() as folder:
            layer = Path(folder) / "scene.usdc"
            lost = _written(scene, layer)
            partial.unlink(missing_ok=True)
            if not UsdUtils.CreateNewUsdzPackage(str(layer), str(partial)):
                raise SceneError("cannot be written: OpenUSD refuses to pack it", file=path)
            return lost
    except OSError as error:
        raise SceneError(f"cannot be written: {error.strerror}", file=path) from None


def _written(scene: Scene, path: Path) -> list[str]:
    path.unlink(missing_ok=True)
    stage = Usd.Stage.CreateNew(str(path))
    writer = _Writer(stage, path.parent)
    writer.scene(lamps.plainly_lit(scene))
    stage.GetRootLayer().Save()
    return list(writer.materials.lost)


class _Writer:
    """Writes a scene; materials and groups that several shapes share are written once."""

    def __init__(self, stage: Usd.Stage, folder: Path):
        self.stage = stage
        self.materials = MaterialWriter(stage, folder)
        self.groups: dict[int, str] = {}
        self.one_sided = 0

    def warn(self, message: str) -> None:
        self.materials.warn(message)

    def scene(self, scene: Scene) -> None:
        stage = self.stage
        axis = int(np.argmax(np.abs(upright(scene.camera))))
        UsdGeom.SetStageUpAxis(stage, "Z" if axis == 2 else "Y")
        UsdGeom.SetStageMetersPerUnit(stage, 1.0)
        stage.SetTimeCodesPerSecond(RATE)
        world = UsdGeom.Xform.Define(stage, "/World")
        stage.SetDefaultPrim(world.GetPrim())
        UsdGeom.Scope.Define(stage, "/Materials")
        for shape in scene.shapes:
            self.shape(shape, "/World")
        for light in scene.lights:
            self.light(light)
        camera = self.camera(scene)
        settings = UsdRender.Settings.Define(stage, "/Render/settings")
        settings.CreateResolutionAttr(Gf.Vec2i(scene.film.width, scene.film.height))
        if camera is not None:
            settings.CreateCameraRel().SetTargets([camera])
        stage.SetMetadata("renderSettingsPrimPath", "/Render/settings")
        if scene.camera.medium is not None:
            self.warn("the medium around the camera")

    def shape(self, shape: Shape, parent: str) -> None:
        """Write a shape below a prim, with its place, its motion and its material."""
        path = unused(self.stage, parent, shape.name or shape.kind)
        if shape.priority:
            self.warn("which body fills a place where bodies overlap")
        if shape.exterior is not None and shape.exterior is not shape.interior:
            self.warn("media in front of shapes")
        if shape.group is not None:
            prim = self.stage.DefinePrim(path, "Xform")
            prim.GetReferences().AddInternalReference(self.group(shape.group))
            prim.SetInstanceable(True)
            matrix = np.asarray(shape.to_world, float)
            self.place(UsdGeom.Xformable(prim), matrix, shape.motion)
            return
        gprim = self.gprim(shape, path)
        matrix = np.asarray(shape.to_world, float)
        if isinstance(shape, kinds.Sphere):
            matrix = matrix @ transforms.translate(*np.asarray(shape.center, float))
        self.place(gprim, matrix, shape.motion)
        if shape.flip_normals:
            gprim.CreateOrientationAttr("leftHanded")
        emission = shape.emission
        if emission is not None and not isinstance(emission, lights.Area):
            self.warn(f"the light {emission.kind} of shapes")
            emission = None
        if emission is not None:
            gprim.CreateDoubleSidedAttr(emission.two_sided)
            if not emission.visible:
                self.warn("that lamps are not visible")
        material = self.materials.material(shape.material, emission, shape.interior)
        UsdShade.MaterialBindingAPI.Apply(gprim.GetPrim()).Bind(material)

    def place(
        self, prim: UsdGeom.Xformable, matrix: NDArray[Any], motion: Keys | None = None
    ) -> None:
        """Write a transform (4, 4), which a motion then moves."""
        if motion is None and np.array_equal(matrix, np.eye(4)):
            return
        operation = prim.AddTransformOp()
        if motion is None:
            operation.Set(_matrix(matrix))
            return
        keys = np.asarray(motion.times)
        steps = np.linspace(keys[:-1], keys[1:], STEPS, endpoint=False).T.reshape(-1)
        for time in [*steps.tolist(), float(keys[-1])]:
            operation.Set(_matrix(motion.at(time) @ matrix), time * RATE)

    def group(self, group: Group) -> str:
        """Return the path of a group's prototype, which is nowhere by itself."""
        if id(group) not in self.groups:
            path = unused(self.stage, "/Prototypes", group.name or "group")
            self.stage.CreateClassPrim(path)
            self.groups[id(group)] = path
            for shape in group.shapes:
                self.shape(shape, path)
        return self.groups[id(group)]

    def gprim(self, shape: Shape, path: str) -> UsdGeom.Gprim:
        """Write the geometry of a shape; kinds that USD lacks become meshes."""
        if isinstance(shape, kinds.Sphere):
            sphere = UsdGeom.Sphere.Define(self.stage, path)
            sphere.CreateRadiusAttr(float(shape.radius))
            return sphere
        if isinstance(shape, kinds.Curves):
            return self.curves(shape, path)
        if isinstance(shape, kinds.Spheres):
            return self.points(shape, path)
        return self.mesh(shape, path)

    def mesh(self, shape: Shape, path: str) -> UsdGeom.Mesh:
        mesh = UsdGeom.Mesh.Define(self.stage, path)
        vertices, faces, normals, uvs = as_meshes.local(shape)
        mesh.CreateSubdivisionSchemeAttr("none")
        mesh.CreatePointsAttr(_rows(vertices, Vt.Vec3fArray))
        mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(faces), 3, np.int32)))
        corners = np.ascontiguousarray(faces, np.int32).reshape(-1)
        mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(corners))
        if normals is not None:
            mesh.CreateNormalsAttr(_rows(normals, Vt.Vec3fArray))
            mesh.SetNormalsInterpolation("vertex")
        primvars = UsdGeom.PrimvarsAPI(mesh)
        if uvs is not None:
            st = primvars.CreatePrimvar("st", TYPES.TexCoord2fArray, "vertex")
            st.Set(_rows(uvs, Vt.Vec2fArray))
        if isinstance(shape, kinds.Mesh):
            self.attributes(primvars, shape, len(vertices))
            self.deformed(mesh, shape)
        return mesh

    def attributes(self, primvars: UsdGeom.PrimvarsAPI, shape: kinds.Mesh, count: int) -> None:
        if shape.tangents is not None:
            self.warn("tangents of meshes; they follow from the texture coordinates")
        columns = [shape.attributes.get(f"vertex_{axis}1") for axis in "uv"]
        for name, values in shape.attributes.items():
            array = np.asarray(on_host(values), np.float32)
            per_vertex = name.startswith("vertex_") and len(array) == count
            if not per_vertex and not name.startswith("face_"):
                self.warn("attributes of meshes that are subdivided")
                continue
            if name in ("vertex_u1", "vertex_v1"):
                continue
            wide = array.shape[1] == 3
            kind = TYPES.Color3fArray if wide else TYPES.FloatArray
            primvar = primvars.CreatePrimvar(
                name.split("_", 1)[1], kind, "vertex" if per_vertex else "uniform"
            )
            flat = Vt.FloatArray.FromNumpy(np.ascontiguousarray(array[:, 0]))
            primvar.Set(_rows(array, Vt.Vec3fArray) if wide else flat)
        if None not in [None if column is None else 0 for column in columns]:
            second = np.hstack([np.asarray(on_host(column)) for column in columns])
            st = primvars.CreatePrimvar("st1", TYPES.TexCoord2fArray, "vertex")
            st.Set(_rows(second, Vt.Vec2fArray))

    def deformed(self, mesh: UsdGeom.Mesh, shape: kinds.Mesh) -> None:
        if shape.deformation is None:
            return
        for i, time in enumerate(shape.deformation.times):
            points = np.asarray(on_host(shape.deformation.points))[i]
            mesh.GetPointsAttr().Set(_rows(points, Vt.Vec3fArray), time * RATE)
            if shape.deformation.normals is not None:
                normals = np.asarray(on_host(shape.deformation.normals))[i]
                mesh.GetNormalsAttr().Set(_rows(normals, Vt.Vec3fArray), time * RATE)

    def curves(self, shape: kinds.Curves, path: str) -> UsdGeom.BasisCurves:
        curves = UsdGeom.BasisCurves.Define(self.stage, path)
        points = np.asarray(on_host(shape.points), np.float32)
        lengths = np.asarray(shape.lengths or [len(points)], np.int32)
        cubic = shape.basis in CURVES
        curves.CreateTypeAttr("cubic" if cubic else "linear")
        if cubic:
            curves.CreateBasisAttr(CURVES[shape.basis])
        curves.CreateCurveVertexCountsAttr(Vt.IntArray.FromNumpy(lengths))
        curves.CreatePointsAttr(_rows(points[:, :3], Vt.Vec3fArray))
        widths = np.ascontiguousarray(2.0 * points[:, 3])
        curves.CreateWidthsAttr(Vt.FloatArray.FromNumpy(widths))
        curves.SetWidthsInterpolation("vertex")
        if shape.deformation is not None:
            self.warn("the motion of points within curves")
        return curves

    def points(self, shape: kinds.Spheres, path: str) -> UsdGeom.Points:
        points = UsdGeom.Points.Define(self.stage, path)
        rows = np.asarray(on_host(shape.centers), np.float32)
        radii = rows[:, 3] if rows.shape[1] == 4 else np.broadcast_to(shape.radii, len(rows))
        points.CreatePointsAttr(_rows(rows[:, :3], Vt.Vec3fArray))
        widths = np.ascontiguousarray(2.0 * np.asarray(radii), np.float32)
        points.CreateWidthsAttr(Vt.FloatArray.FromNumpy(widths))
        if shape.attributes or shape.deformation is not None:
            self.warn("attributes and motion of single spheres")
        return points

    def light(self, light: lights.Light) -> None:
        path = unused(self.stage, "/World", light.kind)
        if isinstance(light, lights.Point) and light.falloff:
            place = transforms.translate(*np.asarray(light.position, float))
            self.ball(path, rgb(light.intensity, "emission"), place, light.motion)
        elif isinstance(light, lights.Spot):
            prim = self.ball(
                path, rgb(light.intensity, "emission"),
                np.asarray(light.to_world, float) @ TURNED, light.motion,
            )  # fmt: skip
            shaping = UsdLux.ShapingAPI.Apply(prim.GetPrim())
            shaping.CreateShapingConeAngleAttr(float(light.cutoff))
            shaping.CreateShapingConeSoftnessAttr(1.0 - min(light.beam_width / light.cutoff, 1.0))
            if light.edge == "linear":
                self.warn("that a spot's edge is linear; it is smooth")
        elif isinstance(light, lights.Directional):
            prim = UsdLux.DistantLight.Define(self.stage, path)
            prim.CreateAngleAttr(float(light.angle))
            prim.CreateNormalizeAttr(True)
            _shine(prim, rgb(light.irradiance, "emission"))
            self.place(prim, _facing(np.asarray(light.direction, float)), light.motion)
        elif isinstance(light, lights.Constant):
            _shine(UsdLux.DomeLight.Define(self.stage, path), rgb(light.radiance, "emission"))
        elif isinstance(light, lights.Envmap):
            self.dome(path, light)
        else:
            self.warn(f"the light {light.kind}")

    def ball(
        self, path: str, intensity: Floats, place: NDArray[Any], motion: Keys | None
    ) -> UsdLux.SphereLight:
        """Write a point that shines as a small ball of the same intensity."""
        prim = UsdLux.SphereLight.Define(self.stage, path)
        prim.CreateRadiusAttr(BALL)
        prim.CreateTreatAsPointAttr(True)
        _shine(prim, intensity / (math.pi * BALL**2))
        self.place(prim, place, motion)
        return prim

    def dome(self, path: str, light: lights.Envmap) -> None:
        prim = UsdLux.DomeLight.Define(self.stage, path)
        _shine(prim, np.full(3, float(light.scale)))
        folder = self.materials.folder / "textures"
        folder.mkdir(exist_ok=True)
        file = image_file(light.image)
        stored = images.read_stored(file).decoded() if file else np.asarray(on_host(light.image))
        name = f"{Path(path).name}.exr"
        images.write(folder / name, np.ascontiguousarray(stored[..., :3], np.float32))
        prim.CreateTextureFileAttr(Sdf.AssetPath(f"./textures/{name}"))
        prim.CreateTextureFormatAttr("latlong")
        self.place(prim, np.asarray(light.to_world, float), light.motion)

    def camera(self, scene: Scene) -> str | None:
        """Write the camera; return its path, None for a kind that USD lacks."""
        camera, film = scene.camera, scene.film
        if not isinstance(camera, (Perspective, Orthographic)):
            self.warn(f"the camera {camera.kind}")
            return None
        path = "/World/camera"
        prim = UsdGeom.Camera.Define(self.stage, path)
        to_world = np.asarray(camera.to_world, float)
        if transforms.flips_handedness(to_world):
            self.warn(MIRRORED)
        aspect = film.height / film.width
        if isinstance(camera, Orthographic):
            width = 20.0 * float(np.linalg.norm(to_world[:3, 0]))
            prim.CreateProjectionAttr("orthographic")
        else:
            width = WIDTH
            across, _ = camera.extent(film.width, film.height)
            prim.CreateFocalLengthAttr(width / across)
            prim.CreateHorizontalApertureOffsetAttr(camera.offset_x * width)
            prim.CreateVerticalApertureOffsetAttr(-camera.offset_y * width * aspect)
        prim.CreateHorizontalApertureAttr(width)
        prim.CreateVerticalApertureAttr(width * aspect)
        prim.CreateClippingRangeAttr(Gf.Vec2f(float(camera.near), float(camera.far)))
        if isinstance(camera, ThinLens) and camera.aperture_radius > 0.0:
            focal = 0.1 * prim.GetFocalLengthAttr().Get()
            prim.CreateFStopAttr(0.5 * focal / camera.aperture_radius)
            prim.CreateFocusDistanceAttr(float(camera.focus_distance))
        stops = film.display_exposure + math.log2(max(film.exposure, 1e-30))
        if stops:
            prim.CreateExposureAttr(stops)
        shutter = camera.shutter
        if shutter is not None and shutter.close > shutter.open:
            prim.CreateShutterOpenAttr(shutter.open * RATE)
            prim.CreateShutterCloseAttr(shutter.close * RATE)
        self.place(prim, transforms.unmirrored(to_world) @ FROM_GLTF, camera.motion)
        return path


def _matrix(matrix: NDArray[Any]) -> Gf.Matrix4d:
    return Gf.Matrix4d(np.asarray(matrix, float).T.tolist())


def _rows(rows: ArrayLike, kind: type[_Array]) -> _Array:
    return kind.FromNumpy(np.ascontiguousarray(rows, np.float32))


def _shine(prim: UsdLux.BoundableLightBase | UsdLux.NonboundableLightBase, color: Floats) -> None:
    """Set the intensity of a light, and its color with a greatest part of 1."""
    strength, share = split(color)
    prim.CreateIntensityAttr(strength)
    prim.CreateColorAttr(Gf.Vec3f(*share.tolist()))


def _facing(direction: Floats) -> NDArray[Any]:
    """Return a rotation (4, 4) that takes -z to a direction."""
    up = np.eye(3)[int(np.argmin(np.abs(direction)))]
    return transforms.look_at(np.zeros(3), direction, up) @ TURNED
