"""Ground truth of a picture by single rays through the middles of its pixels.

An object is all shapes of one name; shapes without a name are background. Its category is the name
without a number at the end: `cup.003` and `cup.017` are two cups.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from clpt.arrays import Floats, Integers
from clpt.render.renderer import Renderer
from clpt.scene import Scene
from clpt.scene import materials as mt
from clpt.scene.cameras import Calibrated, Perspective
from clpt.scene.conventions import calibrated, pose
from clpt.scene.integrators import Box, Path
from clpt.scene.motion import rotations
from clpt.scene.shapes import Shape
from clpt.scene.studio import shape_bounds

NUMBER = re.compile(r"[._#/ -]?\d+$")
WHITE = mt.Diffuse()
OPAQUE = (  # to layers, which are of the first surface
    mt.Diffuse, mt.OrenNayar, mt.Phong, mt.Ward, mt.AshikhminShirley, mt.Dielectric,
    mt.RoughDielectric, mt.ThinDielectric, mt.Conductor, mt.RoughConductor, mt.Plastic,
    mt.RoughPlastic, mt.CoatedConductor, mt.Principled,
)  # fmt: skip
LAYERS = ("position", "shape_id", "geometric_normal")


@dataclass(frozen=True)
class Truth:
    """Ground truth of a picture of h rows and w columns, and of its n objects.

    names, categories (n,): of the objects, in the order of the scene's shapes. instances (h, w)
    int32: object i is i + 1, background 0. depth (h, w): along the camera's axis [m], 0 where
    nothing is. position, normal (h, w, 3): in the world [m]; normal in camera space is `normal`
    turned by `camera`. camera (4, 4): world to OpenCV's camera space. matrix (3, 3): of intrinsics,
    OpenCV's K, or None for a camera without. poses (n, 4, 4): rigid, object to world, without
    scales. sizes (n, 2, 3): lowest and highest corner in that object's space [m]. visible (n,):
    pixels of each. silhouettes (n, h, w) bool: each object without the others, or None.
    """

    names: tuple[str, ...]
    categories: tuple[str, ...]
    instances: Integers
    depth: Floats
    position: Floats
    normal: Floats
    camera: Floats
    matrix: Floats | None
    poses: Floats
    sizes: Floats
    visible: Integers
    silhouettes: np.ndarray | None

    @property
    def visibility(self) -> Floats | None:
        """Visible pixels over those of the silhouettes (n,); NaN outside the film."""
        if self.silhouettes is None:
            return None
        with np.errstate(invalid="ignore"):
            return np.asarray(self.visible / self.silhouettes.sum(axis=(1, 2)))

    @property
    def boxes(self) -> Integers:
        """Boxes (n, 4) of the visible pixels: x, y, width, height [pixels]; 0 if hidden."""
        return _boxes(np.arange(1, len(self.names) + 1)[:, None, None] == self.instances)

    @property
    def amodal_boxes(self) -> Integers | None:
        """Boxes (n, 4) of the silhouettes, as far as the film reaches."""
        return None if self.silhouettes is None else _boxes(self.silhouettes)

    @property
    def corners(self) -> Floats:
        """Corners (n, 8, 3) of the 3D boxes in the world [m], x fastest."""
        unit = np.stack(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij"), -1).reshape(-1, 3)
        low, high = self.sizes[:, :1], self.sizes[:, 1:]
        points = low + (high - low) * unit[:, ::-1]
        return points @ self.poses[:, :3, :3].transpose(0, 2, 1) + self.poses[:, None, :3, 3]


def ground_truth(
    scene: Scene, renderer: Renderer | None = None, *, silhouettes: bool = False
) -> Truth:
    """Return the ground truth of a scene's picture, at the time 0 of its motion.

    renderer: of any `truth_scene`; it gets this one. silhouettes: render each object alone, too.
    Raises as `clpt.Renderer` does.
    """
    bare = truth_scene(scene)
    used = Renderer(bare) if renderer is None else renderer
    try:
        return _read(used, scene, bare, silhouettes)
    finally:
        if renderer is None:
            used.close()


def _read(renderer: Renderer, scene: Scene, bare: Scene, silhouettes: bool) -> Truth:
    layers = _layers(renderer, bare)
    rows = objects(scene)
    numbers = np.zeros(len(scene.shapes) + 1, np.int32)  # the last is of nothing, -1
    for number, shapes in enumerate(rows.values(), 1):
        numbers[shapes] = number
    instances = numbers[layers["shape_id"].astype(int)]
    camera = pose(np.asarray(scene.camera.to_world, np.float64), "opencv")
    hit = layers["shape_id"] >= 0
    depth = np.where(hit, layers["position"] @ camera[2, :3] + camera[2, 3], 0.0)
    poses, sizes = _placed([[scene.shapes[i] for i in shapes] for shapes in rows.values()])
    alone = None
    if silhouettes:
        alone = np.zeros((len(rows), *hit.shape), bool)
        for i, shapes in enumerate(rows.values()):
            single = truth_scene(scene, [scene.shapes[j] for j in shapes])
            alone[i] = _layers(renderer, single)["shape_id"] >= 0
    return Truth(
        names=tuple(rows), categories=tuple(map(category, rows)), instances=instances,
        depth=depth, position=layers["position"], normal=layers["geometric_normal"],
        camera=camera, matrix=_intrinsics(scene),
        poses=poses, sizes=sizes,
        visible=np.bincount(instances.ravel(), minlength=len(rows) + 1)[1:], silhouettes=alone,
    )  # fmt: skip


def objects(scene: Scene) -> dict[str, list[int]]:
    """Return the rows of shapes of each named object."""
    rows: dict[str, list[int]] = {}
    for i, shape in enumerate(scene.shapes):
        if shape.name:
            rows.setdefault(shape.name, []).append(i)
    return rows


def category(name: str) -> str:
    """Return the category of an object's name."""
    return NUMBER.sub("", name) or name


def truth_scene(scene: Scene, shapes: list[Shape] | None = None) -> Scene:
    """Return a scene for `ground_truth`: single rays, no lights. shapes: of these alone."""
    film = dataclasses.replace(
        scene.film, mode="rgb", bands=0, time_bins=0, layers=LAYERS, filter=Box(radius=0.01),
        filtering="importance", alpha=False,
    )  # fmt: skip
    hide = scene.integrator.hide_lights
    kept = [_plain(shape, hide) for shape in (scene.shapes if shapes is None else shapes)]
    return dataclasses.replace(
        scene, shapes=kept, lights=[], film=film, noise=None,
        integrator=Path(max_depth=1, light_paths=0, hide_lights=hide),
    )  # fmt: skip


def _plain(shape: Shape, hide_lights: bool) -> Shape:
    """Return a shape that rays meet in the same places, white if its material lets none through.

    Scenes of the same kinds of shapes then have the same programs.
    """
    hidden = shape.emission is not None and hide_lights
    bounds = shape.interior is not None or shape.exterior is not None  # of a medium
    if hidden or bounds or not isinstance(shape.material, OPAQUE):
        return shape
    return shape.altered(material=WHITE, emission=None)


def _layers(renderer: Renderer, bare: Scene) -> dict[str, Floats]:
    renderer.update(scene=bare)
    renderer.run(1)
    layers = renderer.layers()
    arrays = {name: np.asarray(layers[name], np.float64) for name in LAYERS}
    return {
        name: values[..., 0] if values.shape[2] == 1 else values for name, values in arrays.items()
    }


def _placed(by_object: list[list[Shape]]) -> tuple[Floats, Floats]:
    """Return rigid poses (n, 4, 4) of objects, and their lowest and highest corners (n, 2, 3)."""
    placed = [np.asarray(shapes[0].to_world, np.float64) for shapes in by_object]
    poses, sizes = np.array(placed).reshape(-1, 4, 4), np.zeros((len(placed), 2, 3))
    poses[:, :3, :3] = rotations(poses[:, :3, :3])
    for back, shapes, size in zip(np.linalg.inv(poses), by_object, sizes, strict=True):
        boxes = [shape_bounds(shape.placed(back @ np.asarray(shape.to_world))) for shape in shapes]
        low, high = zip(*boxes, strict=True)
        size[:] = np.min(low, axis=0), np.max(high, axis=0)
    return poses, sizes


def _intrinsics(scene: Scene) -> Floats | None:
    """Return K (3, 3) of a pinhole or a calibrated camera, for the film's size."""
    if not isinstance(scene.camera, Calibrated) and type(scene.camera) is not Perspective:
        return None
    size = scene.film.width, scene.film.height
    camera = calibrated(scene.camera, *size)
    scale = np.divide(size, tuple(camera.size) or size)
    fx, fy, cx, cy = np.asarray(camera.intrinsics, np.float64)
    cx, cy = (np.array([cx, cy]) + 0.5) * scale - 0.5
    return np.array([[fx * scale[0], 0.0, cx], [0.0, fy * scale[1], cy], [0.0, 0.0, 1.0]])


def _boxes(masks: np.ndarray) -> Integers:
    """Return boxes (n, 4) of masks (n, h, w): x, y, width, height."""
    boxes = np.zeros((len(masks), 4), np.int64)
    for box, mask in zip(boxes, masks, strict=True):
        y, x = (np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0))
        if len(x):
            box[:] = x[0], y[0], x[-1] - x[0] + 1, y[-1] - y[0] + 1
    return boxes


def scene_flow(first: Truth, second: Truth) -> Floats:
    """Return how points of the first picture move in the world to the second (h, w, 3) [m].

    Objects move rigidly by their poses, the background stays. NaN where nothing is, and for an
    object that the second picture lacks. For flow backwards, swap the pictures.
    """
    flow = np.zeros_like(first.position)
    flow[first.depth == 0.0] = np.nan
    for number, motion in _motions(first, second):
        mask = first.instances == number
        points = first.position[mask]
        flow[mask] = points @ (motion[:3, :3] - np.eye(3)).T + motion[:3, 3]
    return flow


def optical_flow(first: Truth, second: Truth, scene: Scene) -> Floats:
    """Return how pixels of the first picture move in the film to the second (h, w, 2) [pixels].

    scene: of the second picture, whose camera may have moved and have any calibration. NaN where
    `scene_flow` is, and where the second camera does not see a point, as it lies behind.
    """
    height, width = first.depth.shape
    camera = calibrated(scene.camera, width, height)
    points = first.position + scene_flow(first, second)
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    return camera.project(points, width, height) - np.stack([x, y], -1)


def _motions(first: Truth, second: Truth) -> Iterator[tuple[int, Floats]]:
    """Yield each object's number in the first picture, and its motion (4, 4) in the world."""
    later = dict(zip(second.names, second.poses, strict=True))
    for number, (name, matrix) in enumerate(zip(first.names, first.poses, strict=True), 1):
        motion = np.full((4, 4), np.nan)
        yield number, later[name] @ np.linalg.inv(matrix) if name in later else motion
