"""Functions that a client calls in a worker's process.

They take and return numbers, texts, bytes and arrays. Open jobs stay open for the next call. Errors
return as texts, so that a worker survives every call.
"""

from __future__ import annotations

import asyncio
import concurrent.futures
import hashlib
import json
import logging
import secrets
import time
import traceback
from collections.abc import Callable, Collection, Coroutine
from contextlib import ExitStack
from dataclasses import replace
from typing import TYPE_CHECKING, Any, get_args

import numpy as np

from clpt import device as dev
from clpt.cluster.bundle import Bundle, Store, canonical, from_json, to_json
from clpt.cluster.multi_renderer import MultiRenderer
from clpt.errors import ClptError, ClusterError, MemoryBudgetError, SceneError
from clpt.render.film.state import DIMENSIONS, FilmState
from clpt.render.film_renderer import maker_of
from clpt.render.makers.device_film import kernels_digest
from clpt.render.makers.maker import Tick
from clpt.render.renderer import Renderer
from clpt.render.wavefront.tracer import Paths, Selection
from clpt.scene import Scene
from clpt.version import VERSION as VERSION_OF_CLPT

if TYPE_CHECKING:
    from distributed import Client

log = logging.getLogger(__name__)

VERSION = 3  # of the protocol between client and worker
OPTIONS = (
    "halves",
    "layout",
    "queued",
    "sorted_rays",
    "looped",
    "slots",
    "texture_budget",
    "tree_quality",
    "programs",
)
MOST_OPEN = 2  # open jobs of a worker, each with device memory
COUNTED = ("samples", "rays", "rejected", "full")  # counts in a reply
ENDS = np.dtype("<u4")  # dtype of a packed selection's ends

Reply = dict[str, Any]

_device: dict[str, Any] = {"which": None, "threads": None}  # this worker's choice
_open: dict[str, _Job] = {}  # by digest, in the order of their last use
_stopped: set[str] = set()  # digests of jobs that must end soon
MOST_HELD = 4  # films that are received at a time; others wait at their workers

Call = concurrent.futures.Future[Reply]


class _Job:
    """A renderer of a job's scene, kept between tasks; kind: see `device_class`."""

    kind = ""

    def __init__(self, scene: Scene, devices: list[dev.Device], options: dict[str, Any]):
        self.renderer: Renderer | MultiRenderer = (
            MultiRenderer(scene, devices, **options)
            if len(devices) > 1
            else Renderer(scene, devices[0], **options)
        )
        self.options, self._tracer = options, maker_of(self.renderer).tracer()
        self._packed: Reply | None = None  # the last selection
        self._selection: Selection | None = None

    def try_scene(self, scene: Scene) -> bool:
        """Update the renderer to another scene; return whether this succeeded."""
        try:
            self.renderer.update(scene=scene)
            self.renderer.prepare()
        except (SceneError, MemoryBudgetError) as error:
            log.debug("a renderer cannot take the next scene: %s", error)
            return False
        self._tracer = maker_of(self.renderer).tracer()
        return True

    def block(self, first: int, end: int, packed: Reply | None, wanted: Tick) -> Reply:
        """Render samples first to end - 1; return the film with its time and counts.

        packed: a selection from `pack_selection`; None selects every pixel.
        """
        began, renderer = time.perf_counter(), self.renderer
        renderer.reset(first_sample=0 if packed else first)
        before = renderer.counts
        if packed != self._packed:
            self._selection = None if packed is None else unpack_selection(packed)
            self._packed = packed
            if packed is None:
                self._tracer.use_all_pixels()
        if self._selection is None:
            whole = renderer.run(end - first, lambda _: wanted())
        else:
            whole = self._tracer.add(self._selection, first, end, lambda _: wanted())
        state = replace(renderer.film_state(), taken=((first, end),))
        after = renderer.counts
        return {
            **state_to_arrays(state),
            "whole": whole,
            "seconds": time.perf_counter() - began,
            **{name: getattr(after, name) - getattr(before, name) for name in COUNTED},
        }


def choose_devices(which: str | None, threads: int | None = None) -> list[dev.Device]:
    """Choose this worker's devices and return them. Raises DeviceError."""
    _device.update(which=which, threads=threads)
    return _devices()


def _devices() -> list[dev.Device]:
    which, threads = _device["which"], _device["threads"]
    if dev.names_several(which):
        return dev.choose_all(which, threads=threads)
    return [dev.choose(which, threads=threads)]


def describe_job(bundle: Bundle, options: dict[str, Any]) -> str:
    """Return a job's description as JSON; its SHA-256 is the job's digest."""
    return canonical({
        "format": "clpt job", "version": VERSION, "clpt": VERSION_OF_CLPT,
        "kernels": kernels_digest(), "bundle": to_json(bundle), "options": options,
    })  # fmt: skip


def digest_of(job: str) -> str:
    """Return the SHA-256 of a job's description."""
    return hashlib.sha256(job.encode()).hexdigest()


def give(content: bytes) -> bytes:
    """Return a file of a bundle, as the result of a Dask task that workers share."""
    return content


def open_job(job: str, files: dict[str, bytes]) -> Reply:
    """Open a job's scene for rendering.

    job: from `describe_job`; files: contents by digest, to keep. Returns "lacks", digests of
    missing files; or "kind", the device class as text, "class", the class by property, "device",
    the device's name, and "seconds"; or "refused", the reason why this worker cannot take part.
    """
    try:
        return _open_job(job, files)
    except OSError as error:
        return {"refused": f"its disk: {error.strerror or error}"}
    except Exception as error:
        return {"refused": _error_text(error)}


def _open_job(job: str, files: dict[str, bytes]) -> Reply:
    began, document = time.perf_counter(), _parsed(job)
    for part, version in (("clpt", VERSION_OF_CLPT), ("kernels", kernels_digest())):
        if document.get(part) != version:
            theirs, ours = (str(v)[:12] for v in (document.get(part), version))
            raise ClusterError(f"it has {part} {ours}, the client {theirs}")
    bundle, store = from_json(document.get("bundle")), Store()
    options = document.get("options")
    if not isinstance(options, dict) or not options.keys() <= set(OPTIONS):
        raise ClusterError("the job has unknown options")
    digest = digest_of(job)
    _stopped.discard(digest)
    if digest not in _open:
        for file_digest, content in files.items():
            store.add(file_digest, content)
        lacks = store.lacks(bundle)
        if lacks:
            return {"lacks": lacks}
        with store.opened(bundle) as scene:
            _open_renderer(digest, scene, _devices(), options)
            _open[digest].kind = device_class(_open[digest].renderer)  # it reads files
    _open[digest] = _open.pop(digest)
    renderer = _open[digest].renderer
    return {
        "kind": _open[digest].kind,
        "class": renderer._device_class(),
        "device": " and ".join(device.info.label for device in renderer.devices),
        "seconds": time.perf_counter() - began,
    }


def _open_renderer(
    digest: str, scene: Scene, devices: list[dev.Device], options: dict[str, Any]
) -> None:
    """Create a job's renderer; least recently used jobs are closed.

    If possible, the renderer of a job with the same options is updated to the scene, so that frames
    of an animation share tables and kernels.
    """
    while len(_open) >= MOST_OPEN:
        oldest = _open.pop(next(iter(_open)))
        if oldest.options == options and oldest.try_scene(scene):
            _open[digest] = oldest
            return
        oldest.renderer.close()
    while True:
        try:
            with ExitStack() as resources:
                dev.share_compilers(devices, _device["threads"], resources)
                job = _Job(scene, devices, options)
                job.renderer.prepare()
        except MemoryBudgetError:
            if not _open:
                raise
            _close_oldest()
            continue
        finally:
            for device in devices:
                device.compilers = None
        _open[digest] = job
        return


def _close_oldest() -> None:
    _open.pop(next(iter(_open))).renderer.close()


def render_block(digest: str, first: int, end: int, selection: Reply | None = None) -> Reply:
    """Render samples first to end - 1 of a job that `open_job` opened.

    selection: from `pack_selection`; None selects every pixel. Returns "worker", this worker's
    address, and the arrays of `state_to_arrays`; "whole", whether all samples were rendered;
    "seconds"; counts of samples, rays, and samples that the film refused. Or "closed": the job is
    not open here; or "error": a text.
    """
    wanted, address = _wanted()
    try:
        job = _open.get(digest)
        if job is None or digest in _stopped:
            return {"worker": address, "closed": True}
        _open[digest] = _open.pop(digest)
        block = job.block(first, end, selection, lambda: digest not in _stopped and wanted())
        return {"worker": address, **block}
    except Exception as error:
        return {"worker": address, "error": _error_text(error)}


def render_trial(digest: str) -> Reply:
    """Render the first sample of a job; return the reply of `render_block` without its film."""
    reply = render_block(digest, 0, 1)
    return {name: value for name, value in reply.items() if name not in DIMENSIONS}


def stop_job(digest: str) -> None:
    """Let a job's block end soon with a partial film; called from another thread."""
    _stopped.add(digest)


def close_job(digest: str) -> None:
    """Stop a job and free its memory after its last use; called from another thread."""
    _stopped.add(digest)
    job = _open.pop(digest, None)
    if job is not None:
        job.renderer.cancel()


def pack_selection(selection: Selection) -> Reply | None:
    """Return a selection for `unpack_selection`; None for samples of every pixel."""
    if selection.paths == "all":
        return None
    ends = b"" if selection.ends is None else selection.ends.astype(ENDS).tobytes()
    return {"paths": selection.paths, "pixels": selection.pixels, "ends": ends}


def unpack_selection(packed: Reply) -> Selection:
    """Return a selection. Raises ClusterError for invalid data."""
    try:
        paths, pixels = packed["paths"], int(packed["pixels"])
        ends = np.frombuffer(packed["ends"], ENDS).astype(np.int64)
    except (KeyError, TypeError, ValueError) as error:
        raise ClusterError(f"this is no selection of samples: {error}") from None
    if paths not in get_args(Paths):
        raise ClusterError(f"this is no selection of samples: {str(paths)[:80]!r}")
    return Selection(paths, pixels, ends if len(ends) else None)


def state_to_arrays(state: FilmState) -> Reply:
    """Return a film as arrays with a checksum."""
    taken = [list(pair) for pair in state.taken]
    parts: Reply = {**state.arrays, "scale": state.scale, "taken": taken}
    return {**parts, "sha256": film_digest(state)}


def state_from_arrays(reply: Reply) -> FilmState:
    """Return the film of a reply. Raises ClusterError if it is damaged."""
    try:
        arrays = {name: np.asarray(reply[name]) for name in DIMENSIONS}
        taken = tuple((int(first), int(end)) for first, end in reply["taken"])
        state = FilmState(taken=taken, scale=float(reply["scale"]), **arrays)
    except (KeyError, TypeError, ValueError) as error:
        raise ClusterError(f"this is no film: {error}") from None
    for name, array in arrays.items():
        if array.dtype != np.uint32 or array.ndim != DIMENSIONS[name]:
            raise ClusterError(f"this is no film: {name} are {array.dtype} {array.shape}")
    if film_digest(state) != reply.get("sha256"):
        raise ClusterError("the checksum of the film is wrong")
    return state


def film_digest(state: FilmState) -> str:
    """Return the SHA-256 of a film's content."""
    hashed = hashlib.sha256(f"{state.taken} {state.scale} ".encode())
    for array in state.arrays.values():
        hashed.update(f"{array.shape} ".encode())
        if array.size:
            hashed.update(np.ascontiguousarray(array).data.cast("B"))
    return hashed.hexdigest()


def device_class(renderer: Renderer | MultiRenderer) -> str:
    """Return the properties that decide a film's last bits, besides its scene, as text.

    They are device, driver, lanes, trees, and settings that depend on the device, such as the
    number of texels that its memory allows.
    """
    properties = {**renderer._device_class(), **renderer._origin().settings}
    return ", ".join(f"{name} {value}" for name, value in properties.items())


def _parsed(job: str) -> dict[str, Any]:
    try:
        document = json.loads(job)
    except (TypeError, ValueError):
        document = None
    if not isinstance(document, dict) or document.get("format") != "clpt job":
        raise ClusterError("this is no job of clpt")
    if document.get("version") != VERSION:
        raise ClusterError(
            f"the client speaks version {document.get('version')!r}, this worker {VERSION}"
        )
    return document


def _wanted() -> tuple[Tick, str]:
    """Return a function that tells whether the task is wanted, and the worker's address."""
    from distributed.core import Status
    from distributed.worker import get_worker, thread_state

    try:
        worker, key = get_worker(), thread_state.key
    except (ValueError, AttributeError):  # called without Dask
        return lambda: True, ""

    def wanted() -> bool:
        task = worker.state.tasks.get(key)
        if task is None or task.state not in ("executing", "long-running"):
            return False
        return worker.status in (Status.running, Status.paused)

    return wanted, worker.address


def _error_text(error: Exception) -> str:
    """Return an error as a line for the client; an unexpected error is logged in full."""
    if isinstance(error, ClptError):
        return str(error)
    log.error("a task failed", exc_info=error)
    last = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {error} ({last.name}, line {last.lineno})"


class Calls:
    """Calls of a run to its workers.

    priority: among other renders of the same cluster. film_seconds: mean time to receive a film.
    """

    def __init__(self, client: Client, priority: Callable[[], float]):
        self.client, self.film_seconds = client, 0.0
        self._priority, self._gathering = priority, asyncio.Semaphore(MOST_HELD)

    def begin(self, call: Coroutine[Any, Any, Any]) -> concurrent.futures.Future[Any]:
        """Run a coroutine in Dask's event loop, from any thread."""
        return asyncio.run_coroutine_threadsafe(call, self.client.loop.asyncio_loop)

    def hang_up(self, address: str) -> None:
        """Stop waiting for a lost worker's answers: a stopped process stays silent."""
        self.client.loop.add_callback(self.client.rpc.remove, address)

    async def at(
        self, addresses: Collection[str], function: Callable[..., Any], *arguments: object
    ) -> Reply:
        """Run a function at a worker of `addresses`; return its reply, or an "error"."""
        from distributed import KilledWorker

        before = 0.0 if function is render_block else 0.5  # preparation goes first
        future = self.client.submit(
            function, *arguments, key=f"clpt-{function.__name__}-{secrets.token_hex(8)}",
            workers=[*addresses], priority=self._priority() + before,
        )  # fmt: skip
        getting: asyncio.Future[Any] | None = None
        try:
            await future._state.wait()
            async with self._gathering:
                began = time.monotonic()
                # Dask gathers for several calls at once: a cancelled call would cancel the others.
                getting = asyncio.ensure_future(self.client.gather(future, direct=True))
                reply = await asyncio.shield(getting)
                if function is render_block:
                    self.film_seconds = (time.monotonic() - began) / MOST_HELD
        except asyncio.CancelledError as error:
            if future.status != "cancelled":  # the client cancelled this call
                raise
            return {"error": f"the scheduler cancelled a task {error}"}
        except Exception as error:
            first = next(iter(str(error).splitlines()), "")
            killed = isinstance(error, KilledWorker)
            return {"error": f"{type(error).__name__}: {first}", "killed": killed}
        finally:
            future.release()
            if getting is not None:
                getting.add_done_callback(_outcome)
        return reply if isinstance(reply, dict) else {"error": "it sent no reply that can be read"}


def reply_of(call: Call) -> Reply:
    """Return the reply of a finished call."""
    return {"error": "it was cancelled"} if call.cancelled() else call.result()


def _outcome(done: asyncio.Future[Any]) -> BaseException | None:
    """Read the exception of an abandoned call, which asyncio logs otherwise."""
    return None if done.cancelled() else done.exception()
