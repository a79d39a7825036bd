"""An open stage at a time code: values, placements, prims by role, and what a reader leaves out.

Files that a stage names lie beside it, or in a .usdz package. Prims that are invisible or of
another purpose are not shown.
"""

from __future__ import annotations

import re
import tempfile
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Ar, Sdf, Usd, UsdGeom, Vt

from clpt import images
from clpt.arrays import Matrix
from clpt.errors import SceneError
from clpt.files import budget, input_files
from clpt.formats.reading import Once
from clpt.scene.studio import Up

MOST_TOLD = 4  # prims that a warning names


class Document(Once):
    """A stage that is read at one time code.

    file: of the root layer; code: the time code; metres: of a unit of the stage; up: "y" or "z";
    level: of subdivision, None for that which suits each mesh. left_out: prim paths by message.
    """

    def __init__(self, file: Path, stage: Usd.Stage, time: float, level: int | None = None):
        super().__init__()
        self.file, self.stage, self.level = file, stage, level
        # As a double or, in old files, as a float, which UsdGeom.GetStageMetersPerUnit refuses.
        self.metres = float(stage.GetMetadata(UsdGeom.Tokens.metersPerUnit))
        self.up: Up = "z" if UsdGeom.GetStageUpAxis(stage) == "Z" else "y"
        self.to_metres = np.diag([self.metres] * 3 + [1.0])
        self.left_out: dict[str, list[str]] = {}
        self.set_time(time)

    def set_time(self, code: float) -> None:
        """Read at another time code from now on."""
        self.code, self.time = code, Usd.TimeCode(code)
        self.transforms = UsdGeom.XformCache(self.time)

    def warn(self, message: str, path: object) -> None:
        """Note what is left out or replaced at a prim."""
        paths = self.left_out.setdefault(message, [])
        if str(path) not in paths:
            paths.append(str(path))

    def warnings(self) -> list[str]:
        """Return a warning for each message, which names its first prims."""
        lines = []
        for message, paths in self.left_out.items():
            more = f" and {len(paths) - MOST_TOLD} more" if len(paths) > MOST_TOLD else ""
            lines.append(f"{', '.join(paths[:MOST_TOLD])}{more}: {message}")
        return lines

    def error(self, message: str, path: object) -> SceneError:
        """Return the error of a prim."""
        return SceneError(message, file=self.file, where=str(path))

    def value(self, prim: Usd.Prim, name: str, default: object = None) -> Any:
        """Return an attribute's value at the time; `default` for none."""
        value = prim.GetAttribute(name).Get(self.time)
        return default if value is None else value

    def number(self, prim: Usd.Prim, name: str, default: float) -> float:
        """Return an attribute that is a finite number. Raises SceneError for another."""
        value = self.value(prim, name, default)
        if not isinstance(value, (int, float)) or not np.isfinite(value):
            raise self.error(f"{name} must be a finite number, not {value!r}", prim.GetPath())
        return float(value)

    def array(self, prim: Usd.Prim, name: str, width: int, kind: type = np.float32) -> Any:
        """Return an attribute's rows, (n, width), or (n,) where width is 0; None for none."""
        value = self.value(prim, name)
        if value is None:
            return None
        size = len(value) * max(width, 1) * np.dtype(kind).itemsize
        budget.check(size, f"{name} of {prim.GetPath()}", self.file)
        return rows(value, width, kind)

    def points(self, prim: Usd.Prim) -> Any:
        """Return a prim's points (n, 3); None for none, and with a warning for one not finite."""
        points = self.array(prim, "points", 3)
        if points is None or np.isfinite(points).all():
            return points
        self.warn("left out, as a point of it is not finite", prim.GetPath())
        return None

    def placement(self, prim: Usd.Prim) -> Matrix:
        """Return a prim's transform to the world, or of a prototype's prim to the prototype."""
        return self.placements([prim])[0]

    def placements(self, prims: list[Usd.Prim]) -> Matrix:
        """Return the transforms of prims, (n, 4, 4), each as `placement` does."""
        local_to_world = self.transforms.GetLocalToWorldTransform
        stored = Vt.Matrix4dArray([local_to_world(prim) for prim in prims])
        matrices = np.array(stored, np.float64).reshape(-1, 4, 4).swapaxes(1, 2)
        finite = np.isfinite(matrices).all(axis=(1, 2))
        if not finite.all():
            path = prims[int(np.argmin(finite))].GetPath()
            raise self.error("its transform is not finite", path)
        return matrices


def rows(value: object, width: int, kind: type = np.float32) -> Any:
    """Return USD's array as numpy's, (n, width), or (n,) where width is 0."""
    array: NDArray[Any] = np.asarray(value, kind)
    return array.reshape(-1) if width == 0 else array.reshape(-1, width)


def read_image(document: Document, asset: Sdf.AssetPath) -> images.Stored:
    """Return the image that an asset names. Raises SceneError."""
    if not Ar.IsPackageRelativePath(asset.resolvedPath):
        return images.read_stored(file_of(document, asset))
    name = Path(Ar.SplitPackageRelativePathInner(asset.resolvedPath)[1])
    # Readers of images take files: OpenEXR has no other way in.
    with tempfile.TemporaryDirectory(prefix="clpt-usdz-") as folder:
        copy = Path(folder) / f"image{name.suffix.lower()}"
        copy.write_bytes(packed(document, asset))
        try:
            return images.read_stored(copy)
        except SceneError as error:
            raise SceneError(error.message) from None


def file_of(document: Document, asset: Sdf.AssetPath) -> Path:
    """Return the file that an asset names. Raises SceneError where there is none to be read."""
    if not asset.resolvedPath:
        raise SceneError(f"there is no file {asset.path!r}")
    return input_files.named("usd", document.file.parent, Path(asset.resolvedPath))


def packed(document: Document, asset: Sdf.AssetPath) -> bytes:
    """Return the bytes of a file in a package. Raises SceneError."""
    outer = Path(Ar.SplitPackageRelativePathOuter(asset.resolvedPath)[0])
    input_files.named("usd", document.file.parent, outer)
    opened = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(asset.resolvedPath))
    if opened is None:
        raise SceneError(f"there is no file {asset.path!r}")
    budget.take(opened.GetSize(), "files of the package", document.file)
    return bytes(opened.GetBuffer())


LIGHTS = frozenset(
    (
        "RectLight", "DiskLight", "SphereLight", "CylinderLight", "DistantLight", "DomeLight",
        "DomeLight_1", "PortalLight", "GeometryLight", "PluginLight",
    )
)  # fmt: skip
GPRIMS = frozenset(
    ("Mesh", "Sphere", "Cube", "Cylinder", "Cylinder_1", "Cone", "Capsule", "Capsule_1", "Plane",
     "BasisCurves", "Points")
)  # fmt: skip
UNREAD = frozenset(
    ("NurbsPatch", "NurbsCurves", "HermiteCurves", "TetMesh", "LightFilter", "PluginLightFilter",
     "ParticleField3DGaussianSplat", "ParticleField")
)  # fmt: skip
BINDING = re.compile("material:binding(:|$)")
HIDDEN = ("proxy", "guide")  # purposes that no picture shows


Shown = dict[str, list[Usd.Prim]]  # prims by role: see ROLES, "instances" and "bindings"
ROLES = {
    **dict.fromkeys(GPRIMS, "gprims"), **dict.fromkeys(LIGHTS, "lights"), "Camera": "cameras",
    "PointInstancer": "instancers", "Volume": "volumes", "RenderSettings": "settings",
}  # fmt: skip


def shown(document: Document, root: Usd.Prim, *, defined: bool = True) -> Shown:
    """Return the prims that are shown below a prim, and that prim.

    Prims are shown if they and those above are visible and of a purpose that is shown; cameras
    always. defined: leave out prims that only `over` speaks of, as a stage does; prototypes may be
    below such prims. Under "bindings" stand prims that bind a material, if any does.
    """
    prims: Shown = defaultdict(list)
    known: set[tuple[str, ...]] = set()  # many prims author the same properties
    anywhere = Usd.PrimIsActive & Usd.PrimIsLoaded & ~Usd.PrimIsAbstract
    iterator = iter(Usd.PrimRange(root, Usd.PrimDefaultPredicate if defined else anywhere))
    for prim in iterator:
        name, authored = prim.GetTypeName(), tuple(prim.GetAuthoredPropertyNames())
        if authored not in known:
            known.add(authored)
            if any(BINDING.match(property_name) for property_name in authored):
                prims["bindings"].append(prim)
        if "visibility" in authored and document.value(prim, "visibility") == "invisible":
            iterator.PruneChildren()
            if name != "Camera":
                continue
        elif "purpose" in authored and prim.GetAttribute("purpose").Get() in HIDDEN:
            iterator.PruneChildren()
            continue
        if name in ROLES:
            prims[ROLES[name]].append(prim)
            if name == "PointInstancer":
                iterator.PruneChildren()
        elif name in UNREAD:
            document.warn(f"{name} is not read", prim.GetPath())
        elif prim.IsInstance():
            prims["instances"].append(prim)
    return prims
