"""Options of a render: what `clpt.render` and `Renderer` take beside the scene and a device."""

from __future__ import annotations

import dataclasses
import difflib
from collections.abc import Iterable, Mapping
from typing import Any, TypedDict, get_args

import pyopencl as cl

from clpt import bvh
from clpt.arrays import check_unmasked, flag, is_number, whole
from clpt.choices import Programs
from clpt.denoise import needs, oidn
from clpt.errors import SceneError, UnknownKindError, nearest
from clpt.scene import Scene
from clpt.scene.cameras import Camera
from clpt.scene.params import Kind, params


class RenderOptions(TypedDict, total=False):
    """Named arguments of `clpt.render` and `clpt.Renderer`. Pictures are right without them.

    queue: a `pyopencl.CommandQueue` of the caller, instead of a device: all buffers and programs
    are made in its context, all commands go there, and no other OpenCL object is made or changed.
    threads: how many cores of a CPU take part at most.
    profiling: whether the queue that is made measures times, for `Renderer.stats`.
    texture_budget: [bytes] for bitmaps; larger bitmaps are halved. By default half of the free
    memory of the device.
    layout: of the trees over triangles, a name in clpt.bvh.LAYOUTS.
    tree_quality: "high", or "fast", which is built sooner and traced a little slower.
    slots: paths in flight.
    queued: whether stages that the host enqueues take slots from queues: of a material, of paths
    that have ended, of shadow rays. It is possible, and the default, for work-items that shade a
    single path, as on GPUs. The loop on the device sorts by itself.
    sorted_rays: whether the rays of trees are put into a coarse order first, where `queued`. By
    default a trial on a GPU decides.
    looped: whether a kernel on the device runs all bounces.
    first_sample: the number of the first sample, 0 to 2^31 - 1, by default 0. Renderers that take
    other numbers have other samples, and their films merge, see `Renderer.merge`.
    halves: whether even and odd samples are kept apart, for `Renderer.halves`.
    denoise: oidn or statistical, for `Renderer.denoised`: the scene gets the layers that the
    denoiser needs, see clpt.denoise.needs.
    cancel_seconds: [s] from `cancel` to the end of a `run`, for interactive pictures: launches are
    shorter, and the device is a little slower.

    programs: "own", compiled for the scene, or "shared" with all scenes of the usual kinds. The
    first of these compiles for longer, the others hardly. Pictures of both have other noise.

    An option that is absent or None has a default for the device and the scene.
    """

    queue: cl.CommandQueue | None
    threads: int | None
    profiling: bool
    texture_budget: int | None
    layout: str | None
    tree_quality: bvh.Quality
    slots: int | None
    queued: bool | None
    sorted_rays: bool | None
    looped: bool | None
    first_sample: int
    halves: bool
    denoise: str | None
    cancel_seconds: float | None
    programs: Programs


def check_scene(scene: object) -> None:
    """Raise TypeError unless `scene` is a Scene."""
    if isinstance(scene, Scene):
        return
    value = f"{scene!r}" if isinstance(scene, str) else type(scene).__name__
    advice = f"clpt.load({scene!r}) reads one" if isinstance(scene, str) else "clpt.load reads one"
    raise TypeError(f"the scene must be a clpt.Scene, not {value}; {advice} from a file")


def check_options(scene: Scene, options: Mapping[str, Any]) -> None:
    """Check the names and values of options.

    Raises TypeError as `check_names` does, and for a queue that is none; SceneError,
    UnknownKindError for other values.
    """
    check_names(scene, options, RenderOptions.__annotations__)
    queue, layout = options.get("queue"), options.get("layout")
    if queue is not None and not isinstance(queue, cl.CommandQueue):
        message = f"queue must be a pyopencl.CommandQueue, not {type(queue).__name__}"
        raise TypeError(f"{message}; a device is chosen by its name or index: device={queue!r}")
    if layout is not None and layout not in bvh.LAYOUTS:
        raise UnknownKindError("layout", str(layout), bvh.LAYOUTS, where="layout")
    if options.get("denoise") is not None and needs.check_method(options["denoise"]) == "oidn":
        oidn.check_installed()
    quality = options.get("tree_quality", "high")
    if quality not in get_args(bvh.Quality):
        raise UnknownKindError("quality", str(quality), get_args(bvh.Quality), where="tree_quality")
    programs = options.get("programs", "own")
    if programs not in get_args(Programs):
        raise UnknownKindError("programs", str(programs), get_args(Programs), where="programs")
    for name in ("queued", "sorted_rays", "looped", "halves", "profiling"):
        if options.get(name) is not None:
            flag(options[name], name)
    seconds = options.get("cancel_seconds")
    if seconds is not None and not (is_number(seconds) and seconds > 0.0):
        raise SceneError(f"must be seconds above 0, not {seconds!r}", where="cancel_seconds")
    for name, least in (("slots", 1), ("texture_budget", 0), ("first_sample", 0)):
        if options.get(name) is not None:
            whole(options[name], least, where=name)


def check_changes(camera: object, **by_key: object) -> None:
    """Raise SceneError for a camera or changes by key that `Renderer.update` cannot take."""
    if camera is not None and not isinstance(camera, Camera):
        message = f"must be a camera, such as clpt.scene.cameras.Perspective, not {camera!r}"
        raise SceneError(message, where="camera")
    for name, changes in by_key.items():
        if changes is not None and not isinstance(changes, Mapping):
            message = f"must be a dict by shape, as {name}={{scene.shapes[0]: ..}}, not {changes!r}"
            raise SceneError(message, where=name)
        for values in (changes or {}).values():
            check_unmasked(values, name)


def check_names(scene: Scene, names: Iterable[str], known: Iterable[str]) -> None:
    """Raise TypeError for a name that is no option, and say where such a value belongs.

    known: the options that there are.
    """
    known = tuple(known)
    for name in names:
        if name not in known:
            places = {
                other: at
                for other, at in _places(film=scene.film, integrator=scene.integrator).items()
                if other not in known
            }
            near = difflib.get_close_matches(name, (*known, *places), n=1)
            cure = places.get(name) or nearest(name, known)
            if name not in places and near and near[0] in places:
                cure = f"; did you mean {near[0]!r}{places[near[0]]}"
            raise TypeError(f"there is no option {name!r}{cure}")


def _places(**parts: Kind) -> dict[str, str]:
    """Return the end of a message for each name that belongs to a scene, or to a part of it."""
    places = {
        name: f"; it is the {owner}'s: scene.{owner} = "
        f"dataclasses.replace(scene.{owner}, {name}=..)"
        for owner, part in parts.items()
        for name in params(type(part))
    }
    size = "; it is the film's: scene.film = dataclasses.replace(scene.film, width=.., height=..)"
    of_scene = {
        field.name: f"; it is the scene's: scene.{field.name} = .."
        for field in dataclasses.fields(Scene)
    }
    return {**places, "size": size, **of_scene}
