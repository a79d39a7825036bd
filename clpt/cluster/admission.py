"""Admission of workers to a render: each must open the job and compute equal bits."""

from __future__ import annotations

import concurrent.futures
import logging
import time
from collections import Counter
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from clpt.cluster import tasks
from clpt.cluster.blocks import WorkerRecord
from clpt.cluster.bundle import Bundle
from clpt.cluster.tasks import Call, Calls, reply_of
from clpt.errors import ClusterError
from clpt.scene.fingerprint import Plain

log = logging.getLogger(__name__)

LOOK_SECONDS = 0.5  # between two queries of the scheduler for its workers
ANSWER_SECONDS = 30.0  # timeout of a scheduler's answer
GONE = "the scheduler is gone"


@dataclass(frozen=True)
class Job:
    """A render job as it is sent to workers.

    text: from `tasks.describe_job`; bundle: of the scene; folder: holds the files of the bundle.
    """

    text: str
    bundle: Bundle
    folder: Path

    @cached_property
    def digest(self) -> str:
        """The job's SHA-256 for workers: of scene, options, kernels and version."""
        return tasks.digest_of(self.text)


@dataclass
class Agreed:
    """State that parallel renderers of a cluster share.

    kind: the device class that may take part, set by the first worker; "" before the first.
    checked: workers whose trial sample equalled another worker's.
    """

    kind: str = ""
    checked: set[str] = field(default_factory=set)


@dataclass
class Known:
    """The workers of a cluster, remembered between the runs of a render.

    mixed: whether several device classes take part; patience: seconds without a worker until the
    render fails. records: of participating workers, by address; refused: reasons, by address;
    lost: the number of workers that left; classes: of participating devices, by their text.
    """

    mixed: bool
    patience: float
    records: dict[str, WorkerRecord] = field(default_factory=dict)
    refused: dict[str, str] = field(default_factory=dict)
    lost: int = 0
    classes: dict[str, dict[str, Plain]] = field(default_factory=dict)
    agreed: Agreed = field(default_factory=Agreed)


class Admission:
    """The workers that may render in a run.

    fit: device classes by address, of workers with the job open; opening: calls of workers that
    prepare; there: addresses of all workers of the scheduler.
    """

    def __init__(self, calls: Calls, job: Job, known: Known):
        self.calls, self.job, self.known = calls, job, known
        self.fit: dict[str, str] = {}
        self.opening: dict[Call, str] = {}
        self.there: set[str] = set()
        self._trials: dict[str, tuple[str, str]] = {}  # device class, and digest of a trial film
        self._looked, self._seen = -LOOK_SECONDS, time.monotonic()

    def admit(self) -> None:
        """Admit workers that have opened the job."""
        for call in [call for call in self.opening if call.done()]:
            self._admit(self.opening.pop(call), reply_of(call))

    def reopen(self, address: str) -> None:
        """Note that a worker has closed the job."""
        self.fit.pop(address, None)
        self._trials.pop(address, None)

    def follow(self) -> None:
        """Open the job at new workers; forget workers that left.

        Raises ClusterError without a scheduler, and where no worker renders or can be expected to.
        """
        if time.monotonic() < self._looked + LOOK_SECONDS:
            return
        addresses = self.look()
        known = self.known
        for address in known.records.keys() - addresses:
            log.warning("the worker %s is gone; others render its samples", address)
            self.calls.hang_up(address)
            known.lost += 1
            del known.records[address]
            self.fit.pop(address, None)
        for call in [call for call, address in self.opening.items() if address not in addresses]:
            call.cancel()
            del self.opening[call]
        for address in sorted(addresses - self.fit.keys() - known.refused.keys()):
            if address not in self.opening.values() and address not in self._trials:
                self.opening[self.calls.begin(self._open(address))] = address
        self._judge()
        if self.fit or self.opening:
            self._seen = time.monotonic()
        if addresses and addresses <= known.refused.keys():
            named = "; ".join(f"{name}: {why}" for name, why in list(known.refused.items())[:4])
            raise ClusterError(f"no worker can render this: {named}")
        if time.monotonic() - self._seen > known.patience:
            raise ClusterError(f"for {known.patience:.0f} s there was no worker")

    def look(self) -> set[str]:
        """Return the addresses of all workers. Raises ClusterError without a scheduler."""
        try:
            answer = self.calls.begin(self.calls.client.scheduler.ncores())
            addresses = set(answer.result(ANSWER_SECONDS))
        except (OSError, TimeoutError, concurrent.futures.TimeoutError, AttributeError) as error:
            raise ClusterError(f"{GONE}; what was rendered so far is kept") from error
        self._looked, self.there = time.monotonic(), addresses
        self._trials = {name: trial for name, trial in self._trials.items() if name in addresses}
        return addresses

    async def _open(self, address: str) -> tasks.Reply:
        """Open the job at a worker and return its answer; an unchecked worker renders a trial."""
        at = [address]
        reply = await self.calls.at(at, tasks.open_job, self.job.text, {})
        if "lacks" in reply:
            files = self._files(reply["lacks"])
            reply = await self.calls.at(at, tasks.open_job, self.job.text, files)
        reason = reply.get("refused") or reply.get("error")
        if reason is None and "kind" not in reply:
            reason = "it cannot keep the scene's files"
        if reason is not None:
            return {"refused": reason}
        return reply if address in self.known.agreed.checked else await self._try(address, reply)

    async def _try(self, address: str, opened: tasks.Reply) -> tasks.Reply:
        """Let a worker render a single sample and answer with the digest of its film."""
        reply = await self.calls.at([address], tasks.render_trial, self.job.digest)
        if "error" in reply:
            return reply
        return {**opened, "trial": reply.get("sha256"), "took": reply.get("seconds")}

    def _files(self, digests: list[str]) -> dict[str, Any]:
        """Return Dask tasks that give files of the bundle; workers share their results."""
        named = self.job.bundle.items()
        paths = {digest: self.job.folder / name for name, digest in named}
        return {
            digest: self.calls.client.submit(
                tasks.give, paths[digest].read_bytes(), key=f"clpt-file-{digest}"
            )
            for digest in digests
            if digest in paths
        }

    def _admit(self, address: str, reply: tasks.Reply) -> None:
        """Admit a worker with the job open, if its device class and its sample agree."""
        agreed, kind = self.known.agreed, str(reply.get("kind", ""))
        reason = reply.get("refused") or reply.get("error")
        if reason is not None:
            self.refuse(address, str(reason))
            return
        if not self.known.mixed:
            agreed.kind = agreed.kind or kind
            if kind != agreed.kind:
                reason = f"it is of another class of device: {kind}, others: {agreed.kind}"
                self.refuse(address, reason)
                return
        self.known.classes[kind] = dict(reply["class"])
        record = self.known.records.setdefault(address, WorkerRecord())
        record.kind = kind
        if reply.get("trial"):
            record.rate = record.rate or 1.0 / max(float(reply["took"]), 1e-6)
            self._trials[address] = kind, str(reply["trial"])
            self._judge()
        elif address in agreed.checked:
            self.fit[address] = kind

    def _judge(self) -> None:
        """Compare trial samples within each device class; refuse workers with a wrong sample.

        Two equal samples count as right; a lone worker is trusted. Raises ClusterError where no
        majority decides and no other worker is preparing.
        """
        checked = self.known.agreed.checked
        for kind in {kind for kind, _ in self._trials.values()}:
            films = {name: film for name, (k, film) in self._trials.items() if k == kind}
            peers = [name for name, k in self.fit.items() if k == kind and name not in films]
            if len(films) == 1 and peers:  # compare with a worker that was checked earlier
                if peers[0] not in self.opening.values():
                    opened = {"kind": kind, "class": self.known.classes[kind]}
                    self.opening[self.calls.begin(self._try(peers[0], opened))] = peers[0]
                continue
            votes: Counter[str] = Counter()
            for name, film in films.items():
                votes[film] += 2 if name in checked else 1
            (best, most), (_, second) = [*votes.most_common(2), ("", 0)][:2]
            if self.opening and (most < 2 or most == second):
                continue  # another worker is preparing
            if most == second:
                raise ClusterError(
                    f"{' and '.join(films)} have different films of a sample, though they are of "
                    "one kind; one of them computes wrongly"
                )
            for name, film in films.items():
                if film != best:
                    self.refuse(name, "its film of a sample is wrong")
                    continue
                self.fit[name] = kind
                if most > 1:
                    checked.add(name)

    def refuse(self, address: str, reason: str) -> None:
        """Exclude a worker from this render."""
        log.warning("the worker %s is refused: %s", address, reason)
        self.known.refused[address] = reason
        self.known.records.pop(address, None)
        self.fit.pop(address, None)
        self._trials.pop(address, None)
