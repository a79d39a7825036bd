"""What a process of clpt accepts from the network.

Dask sends Python objects as pickles, and a pickle can name any function, which is then called.
Here only the names in ALLOWED can stand in one: clpt's tasks, and the plain containers that Dask
puts around them. All else is refused before anything of it is made. TLS decides who may connect;
this decides what those can do.
"""

from __future__ import annotations

import io
import pickle
from collections.abc import Iterable
from types import SimpleNamespace
from typing import Any

TASKS = ("give", "open_job", "render_block", "stop_job", "close_job")
ALLOWED = {
    "clpt.cluster.tasks": TASKS,
    "builtins": ("bytearray", "bytes", "complex", "dict", "frozenset", "list", "set", "tuple"),
    "collections": ("OrderedDict", "deque"),
    "dask._expr": ("Expr._reconstruct", "LLGExpr"),
    "dask._task_spec": (
        "Alias", "DataNode", "Dict", "Dict.constructor", "List", "NestedContainer.to_container",
        "Set", "Task", "TaskRef", "Tuple",
    ),
    "numpy": ("dtype", "ndarray"),
    "numpy._core.multiarray": ("_reconstruct", "scalar"),
    "numpy._core.numeric": ("_frombuffer",),
    "numpy.core.multiarray": ("_reconstruct", "scalar"),
    "numpy.core.numeric": ("_frombuffer",),
}  # fmt: skip
# Of Dask's servers: what runs or imports what a client sends, beside tasks.
BLOCKED = (
    "actor_attribute", "actor_execute", "plugin-add", "plugin-remove", "run_coroutine",
    "run_function", "register_scheduler_plugin", "register_worker_plugin", "register_nanny_plugin",
    "upload_file", "set_restrictions", "benchmark_disk", "benchmark_memory", "benchmark_network",
)  # fmt: skip


SHUFFLE = "distributed.shuffle._worker_plugin", "ShuffleWorkerPlugin"  # every scheduler sends it


class _Unpickler(pickle.Unpickler):
    """Reads pickles that name nothing but what is allowed."""

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) == SHUFFLE:
            from distributed.diagnostics.plugin import WorkerPlugin

            return WorkerPlugin  # which does nothing
        if name not in ALLOWED.get(module, ()):
            raise pickle.UnpicklingError(f"refused by clpt: {module}.{name} is no task of clpt")
        return super().find_class(module, name)


def loads(data: Any, /, *, buffers: Iterable[Any] | None = None) -> Any:
    """Return what a pickle holds. Raises pickle.UnpicklingError for names that are not allowed."""
    return _Unpickler(io.BytesIO(data), buffers=buffers).load()


def restrict() -> None:
    """Let Dask read pickles in this process by `loads` alone, and refuse BLOCKED."""
    import dask
    from distributed.protocol import pickle as dask_pickle

    dask_pickle.pickle = SimpleNamespace(
        **{name: getattr(pickle, name) for name in dir(pickle) if not name.startswith("_")}
        | {"loads": loads}
    )
    dask.config.set({
        "distributed.worker.blocked-handlers": list(BLOCKED),
        "distributed.scheduler.blocked-handlers": list(BLOCKED),
    })  # fmt: skip
