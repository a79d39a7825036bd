"""The workers of a cluster: a client that they are reached by, and what is told of them."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from ...cluster import keys as cluster_keys
from ...cluster import processes
from ...cluster.blocks import WorkerRecord
from ...cluster.cluster_renderer import ClusterRenderer
from ...errors import ClusterError
from ..options.scene_options import Machine
from ..options.workers import Workers
from ..printing.display import Display

if TYPE_CHECKING:
    from distributed import Client

MOST_LISTED = 16  # workers of which each has a line


@contextmanager
def connected(workers: Workers, machine: Machine, shown: Display) -> Iterator[Client]:
    """Yield a client of the scheduler at an address, or of one with workers of our own.

    machine: what our own workers render with. Raises ClusterError.
    """
    if workers.number is not None:
        device, threads = machine.device, machine.threads
        with processes.local_cluster(workers.number, device=device, threads=threads) as (client, _):
            yield client
        return
    processes.configure()
    from distributed import Client

    security = cluster_keys.security(workers.keys)
    with shown.phase(f"connecting to {workers.cluster}"):
        try:
            client = Client(workers.cluster, security=security, timeout=10)
        except OSError as error:
            message = f"there is no scheduler at {workers.cluster}: {error}"
            raise ClusterError(message) from None
    with client:
        yield client


class Watch:
    """Tells of workers that come, go, or are refused; of: returns renderers of one cluster."""

    def __init__(self, of: Callable[[], list[ClusterRenderer]], shown: Display):
        self._of, self._shown = of, shown
        self._known: set[str] = set()
        self._refused: set[str] = set()
        self._warned: set[str] = set()
        self._lock = threading.Lock()

    def look(self) -> None:
        """Note what has changed since the last look."""
        with self._lock:
            renderers = self._of()
            refused = {name: why for one in renderers for name, why in one.refused.items()}
            workers = {name for one in renderers for name in one.workers} - refused.keys()
            for name in sorted(refused.keys() - self._refused):
                self._shown.note(f"clpt: warning: {name} is refused: {refused[name]}")
            for name in sorted(self._known - workers - refused.keys()):
                self._shown.note(f"clpt: warning: {name} is gone; others render its samples")
            for name in sorted(workers - self._known):
                self._shown.note(f"{name} renders")
            for warning in (text for one in renderers for text in one.warnings):
                if warning not in self._warned:
                    self._shown.note(f"clpt: warning: {warning}")
                self._warned.add(warning)
            self._known, self._refused = workers, set(refused)

    def report(self) -> None:
        """Note what each worker has done."""
        renderers = self._of()
        records: dict[str, list[WorkerRecord]] = {}
        for name, record in (pair for one in renderers for pair in one.workers.items()):
            records.setdefault(name, []).append(record)
        for name, of_worker in sorted(records.items())[:MOST_LISTED]:
            samples = sum(record.samples for record in of_worker)
            blocks = sum(record.blocks for record in of_worker)
            failures = sum(record.failures for record in of_worker)
            self._shown.note(
                f"{name}  {samples:.5g} spp in {blocks} blocks, {of_worker[-1].rate:.3g} spp/s, "
                f"{failures} failures"
            )
        lost = max((one.lost for one in renderers), default=0)
        self._shown.note(f"{len(records)} workers, {lost} lost")
