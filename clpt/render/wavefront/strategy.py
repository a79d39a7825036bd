"""How a device renders a scene: the layout of its trees, its queues, and who runs the bounce loop.

Every choice is made before anything is compiled or allocated. No choice changes the picture's
expectation, and queues and the loop do not change a bit of it.
"""

from __future__ import annotations

from dataclasses import dataclass

from clpt import bvh, device
from clpt.errors import SceneError
from clpt.render.lowering.scene import Lowered
from clpt.render.wavefront import queues

BRUTE_SHAPES = 32  # analytic shapes up to which a ray tests all of them
UNSORTED_KINDS = 4  # of cheap materials, up to which sorting costs more; see bench/NOTES.md
INTERLEAVED_TRIANGLES = 1 << 20  # from which interleaved rays pay; measured, see bench/NOTES.md
LOOP_PATHS = 1 << 22  # paths of a render from which a loop is worth its compilation


@dataclass(frozen=True)
class Tuning:
    """What the caller wants of a `Strategy`; None for what suits the device and the scene.

    queued: True for the way that suits the device.
    """

    layout: str | None = None
    queued: bool | str | None = None


@dataclass(frozen=True)
class Strategy:
    """How kernels trace and shade the paths of a scene.

    layout: of the trees over triangles, a name in clpt.bvh.LAYOUTS; queued: how slots are queued by
    material before they are shaded, one of clpt.render.wavefront.queues.WAYS, or "" for no queues;
    interleaved: whether a work-item traces the rays of several paths at once.
    """

    layout: str
    queued: str
    interleaved: bool


def choose(on: device.Device, lowered: Lowered, tuning: Tuning) -> Strategy:
    """Return how a device renders a scene.

    Raises SceneError for a layout that cannot hold the scene, and for an unknown way to queue.
    """
    layout = _layout(on, lowered, tuning.layout)
    queued = _queued(on, lowered, tuning.queued)
    return Strategy(layout, queued, _interleaved(on, lowered, layout))


def use_loop(on: device.Device, queued: str, paths: int) -> bool:
    """Return whether a kernel on the device that runs all bounces pays for that many paths."""
    return on.info.is_cpu and not queued and paths >= LOOP_PATHS


def _layout(on: device.Device, lowered: Lowered, layout: str | None) -> str:
    instances = lowered.features.instances
    if layout == "brute" and instances:
        raise SceneError(f"the layout brute holds no instances; choose {' or '.join(bvh.TREES)}")
    if layout is not None:
        return layout
    suited = bvh.choose_layout(on, len(lowered.faces))
    if suited == "brute" and (instances or len(lowered.boxes) > BRUTE_SHAPES):
        return bvh.choose_tree(on)
    return suited


def _queued(on: device.Device, lowered: Lowered, queued: bool | str | None) -> str:
    if queued is None:
        features = lowered.features
        unsorted = 1 if not on.info.is_cpu or features.costly else UNSORTED_KINDS
        queued = len(features.materials) > unsorted
    if queued is True:
        return "sort" if on.info.is_cpu else "append"
    if queued and queued not in queues.WAYS:
        raise SceneError(f"{queued!r} is none of {', '.join(queues.WAYS)}", where="queued")
    return queued or ""


def _interleaved(on: device.Device, lowered: Lowered, layout: str) -> bool:
    """Whether interleaved rays pay: in trees of nothing but triangles, larger than the caches."""
    features, count = lowered.features, len(lowered.faces)
    only_triangles = not (features.instances or features.analytic)
    large = count >= INTERLEAVED_TRIANGLES and bvh.outgrows_caches(on, layout, count)
    return only_triangles and large
