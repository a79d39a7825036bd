"""The way a device renders a scene: layout of trees, queues, and who runs the bounce loop.

Every choice is made before anything is compiled or allocated. No choice changes the picture's
expectation, and queues and the loop do not change a bit of it.
"""

from __future__ import annotations

from dataclasses import dataclass

from clpt import bvh, device
from clpt.device import choosing
from clpt.errors import SceneError
from clpt.render.flow.scene_to_tables import Lowered
from clpt.render.records import Features

BRUTE_SHAPES = 32  # the most analytic shapes that a ray tests without a tree
INTERLEAVED_TRIANGLES = 1 << 20  # least number for interleaved rays: bench/notes/traversal.md
INTERLEAVED_PIECES = 1 << 14  # of curves; see bench/notes/traversal.md
FEW_OTHERS = 64  # the most other analytic shapes beside curves, which all lanes test
SORTED_GAIN = 1.05  # rays are sorted if a trial gains at least this
SORTED_ROUNDS = 4  # of that trial
SHARE = 512  # slots of a work-item of the loop on a CPU, which fit into the second cache of a core


@dataclass(frozen=True)
class Tuning:
    """Wishes of the caller; None: the default of the device and the scene.

    layout, queued: as in `Strategy`; looped: whether a kernel on the device runs all bounces;
    cancel_seconds: the longest time from a request to stop to the end of the run [s]; sorted_rays:
    as in `Strategy`.
    """

    layout: str | None = None
    queued: bool | None = None
    looped: bool | None = None
    cancel_seconds: float | None = None
    sorted_rays: bool | None = None


UNTUNED = Tuning()


@dataclass(frozen=True)
class Strategy:
    """Choices for the kernels that trace and shade the paths of a scene.

    layout: of the trees over triangles, a name in clpt.bvh.LAYOUTS; queued: whether stages that the
    host enqueues take slots from queues; interleaved: whether a work-item traces the rays of
    several paths at once; sorted_rays: whether `intersect` gets the slots in a coarse order of
    their rays, see kernels/stage/sort_rays.cl; None: as a trial says, see `sorting_pays`.
    """

    layout: str
    queued: bool
    interleaved: bool
    sorted_rays: bool | None


def choose(on: device.Device, lowered: Lowered, tuning: Tuning) -> Strategy:
    """Return how a device renders a scene.

    Raises SceneError for a layout that cannot hold the scene.
    """
    layout = _layout(on, lowered, tuning.layout)
    queued = _queued(on, tuning.queued)
    sorted_rays = _sorted(on, layout, tuning.sorted_rays) if queued else False
    return Strategy(layout, queued, _interleaved(on, lowered, layout), sorted_rays)


def use_loop(on: device.Device) -> bool:
    """Return whether a kernel on the device runs all bounces: on CPUs, whose caches it suits."""
    return on.info.is_cpu and on.info.links


def loop_share(on: device.Device) -> int:
    """Return how many slots a work-item of the loop takes."""
    return SHARE if on.info.is_cpu else on.lanes


def _layout(on: device.Device, lowered: Lowered, layout: str | None) -> str:
    instances = lowered.features.geometry.instances
    if layout == "brute" and instances:
        raise SceneError(f"the layout brute holds no instances; choose {' or '.join(bvh.TREES)}")
    if layout is not None:
        return layout
    suited = bvh.choose_layout(on, len(lowered.faces))
    if suited == "brute" and (instances or len(lowered.boxes) > BRUTE_SHAPES):
        return bvh.choose_tree(on)
    return suited


def _queued(on: device.Device, wanted: bool | None) -> bool:
    """Whether there are queues: only for work-items that shade a single path."""
    return on.lanes == 1 and wanted is not False


def _sorted(on: device.Device, layout: str, wanted: bool | None) -> bool | None:
    """Whether rays that work-items take from a queue are sorted: only for trees."""
    if layout == "brute" or (on.info.is_cpu and wanted is None):
        return False
    return wanted


def sorting_pays(
    on: device.Device, names: list[str], plain: choosing.Run, sorts: choosing.Run
) -> bool:
    """Return whether it is faster to sort rays; a trial says so once for a device.

    names: texts that identify the trial beside the device; plain, sorts: find the closest hits of
    the same rays, and wait.
    """
    seconds = choosing.remembered(
        [choosing.identity(on.info), *names],
        lambda: choosing.least_seconds([plain, sorts], SORTED_ROUNDS),
    )
    return seconds is not None and SORTED_GAIN * seconds[1] < seconds[0]


def can_interleave(features: Features, layout: str, lanes: int) -> bool:
    """Return whether a work-item can have several rays in flight.

    It can through `wide8`, among nothing but triangles, or curves that stand still.
    """
    if layout != "wide8" or lanes == 1 or features.geometry.instances:
        return False
    kinds, motion = features.geometry.analytic, features.motion
    moves = motion.shapes or motion.instances or motion.vertices or motion.spheres
    curves = "curves" in kinds and "spheres" not in kinds and not moves
    return curves or not kinds


def _interleaved(on: device.Device, lowered: Lowered, layout: str) -> bool:
    """Return whether interleaved rays pay.

    They do in trees of nothing but triangles that are larger than the caches, and where there are
    many pieces of curves, and of other shapes than triangles few.
    """
    features, count = lowered.features, len(lowered.faces)
    if not can_interleave(features, layout, on.lanes):
        return False
    if features.geometry.analytic:
        others = int(lowered.settings["single_count"])
        return others <= FEW_OTHERS and len(lowered.boxes) - others >= INTERLEAVED_PIECES
    return count >= INTERLEAVED_TRIANGLES and bvh.outgrows_caches(on, layout, count)
