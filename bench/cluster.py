"""Two workers of this machine, a core each: what a cluster costs, and how soon there is a picture.

    python -m bench.cluster [SCENE] [--seconds 20] [--rounds 3] [--noise .02]

First each worker renders a long block, at the same time; then a `ClusterRenderer` renders as much
of the same scene with them. The two alternate. efficiency: the rate of the cluster over the sum of
both workers' rates; first: from `run` to the first added film, with warm workers: the scene is new
to them, their kernels are not. cpu: processor time of a sample by the workers alone, over that by
the cluster, client and scheduler included: other work on the machine hardly moves it, but it does
not see waiting workers. The output is a JSON line.

With --noise a process and the workers render the same scene to the same noise: noise_cpu is the
processor time of the process over the workers', and both films must be equal.
"""

from __future__ import annotations

import argparse
import dataclasses
import itertools
import json
import statistics
import time
from pathlib import Path
from typing import Any

import psutil

import clpt
from clpt.cluster import processes, tasks
from clpt.cluster.cluster_renderer import ClusterRenderer

ROOT = Path(__file__).resolve().parents[1]
WORKERS = 2
MOST = 4096  # samples of a pixel, with noise


def alone(client: Any, digest: str, samples: int, names: Any) -> float:
    """Return the rate of all workers with a block each [samples/s]."""
    blocks = [
        client.submit(
            tasks.render_block, digest, 0, samples, workers=[address], key=f"alone-{next(names)}"
        )
        for address in sorted(client.nthreads())
    ]
    return sum(samples / reply["seconds"] for reply in client.gather(blocks))


def together(scene: Any, client: Any, samples: int) -> tuple[float, float]:
    """The rate of a `ClusterRenderer` [samples/s], and seconds to its first film."""
    with ClusterRenderer(scene, client) as renderer:
        first: list[float] = []
        began = time.perf_counter()

        def note(progress: Any) -> None:
            if progress.samples and not first:
                first.append(time.perf_counter() - began)

        renderer.run(samples, note)
        return samples / (time.perf_counter() - began), first[0]


def noisy(scene: Any, client: Any, started: Any, noise: float) -> float:
    """Return processor time of a process over a cluster's, at the same noise."""
    with clpt.Renderer(scene, threads=WORKERS) as single, ClusterRenderer(scene, client) as several:
        for renderer in (single, several):
            renderer.run(1)
        before = processor_time(started)
        single.run(MOST, noise=noise)
        between = processor_time(started)
        several.run(MOST, noise=noise)
        after = processor_time(started)
        films = [tasks.film_digest(renderer.film_state()) for renderer in (single, several)]
    if films[0] != films[1]:
        raise SystemExit("the cluster's film differs from that of one process")
    return (between - before) / (after - between)


def processor_time(processes: Any) -> float:
    """Return the processor time of these processes and this process so far [s]."""
    times = [psutil.Process(process.pid).cpu_times() for process in processes]
    return time.process_time() + sum(t.user + t.system for t in times)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", nargs="?", type=Path, default=ROOT / "scenes/cornell_box")
    parser.add_argument("--seconds", type=float, default=20.0, help="of each measurement")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--noise", type=float, default=0.0)
    args = parser.parse_args()
    scene, names = clpt.load(args.scene), itertools.count()
    with processes.local_cluster(WORKERS, threads=1) as (client, started):
        client.wait_for_workers(WORKERS)
        with ClusterRenderer(scene, client) as renderer:  # kernels are built
            renderer.run(4)
            digest = renderer.digest
        rate = alone(client, digest, 8, names)
        share = max(1, int(rate / WORKERS * args.seconds))
        rounds = []
        for number in range(args.rounds):
            before = processor_time(started)
            singly = alone(client, digest, share, names)
            between = processor_time(started)
            whole, _ = together(scene, client, WORKERS * share)
            after = processor_time(started)
            other = dataclasses.replace(scene, seed=1000 + number)  # it is sent and opened
            _, first = together(other, client, 8)
            cpu = (between - before) / (after - between)
            rounds.append({"alone": singly, "together": whole, "first": first, "cpu": cpu})
            if args.noise:
                rounds[-1]["noise_cpu"] = noisy(scene, client, started, args.noise)
    print(json.dumps({
        "scene": args.scene.name,
        "size": [scene.film.width, scene.film.height],
        "workers": WORKERS,
        "efficiency": round(statistics.median(r["together"] / r["alone"] for r in rounds), 3),
        "cpu": round(statistics.median(r["cpu"] for r in rounds), 3),
        "first": round(statistics.median(r["first"] for r in rounds), 2),
        **({"noise": args.noise} if args.noise else {}),
        "rounds": [{name: round(value, 3) for name, value in r.items()} for r in rounds],
    }))  # fmt: skip


if __name__ == "__main__":
    main()
