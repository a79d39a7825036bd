"""Agreement of stages: the words that a device writes beside a witness's words.

The witness is a CPU of another platform, or else the device with a program that its compiler did
not optimise. Most faults of drivers are faults of optimisers.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from clpt import device
from clpt.bench.figures import Figure
from clpt.bench.launches import PLAIN, Comparison, Flight, launches
from clpt.errors import ClptError, UnknownKindError
from clpt.scene import Scene

PART = "agreement"
SLOTS = 1 << 12
WARM = 4  # bounces before the check, so that paths of all depths are in flight


@dataclass(frozen=True)
class Witness:
    """A device that repeats launches, its compiler's options, and its name."""

    on: device.Device
    options: tuple[str, ...]
    name: str


def witness_of(on: device.Device) -> Witness:
    """Return the witness of a device."""
    for info in device.devices():
        if info.is_cpu and info.platform != on.info.platform:
            try:
                return Witness(device.choose(info.index), (), info.label)
            except ClptError:
                continue
    return Witness(on, PLAIN, "the same text without the compiler's optimiser")


def checked(
    on: device.Device, scene: Scene, witness: Witness, only: Sequence[str] = ()
) -> Iterator[Comparison]:
    """Run a bounce of a scene; compare each stage with the witness's words.

    only: names of stages, by default all. Raises UnknownKindError for another name; errors of
    Flight; KernelBuildError, DeviceError, MemoryBudgetError of the witness.
    """
    flight = Flight(on, scene, SLOTS)
    for _ in range(WARM):
        flight.bounce()
    names = [step.name for step in flight.wavefront.stages]
    for name in only:
        if name not in names:
            raise UnknownKindError("stage", name, names)
    for launch in launches(flight):
        if not only or launch.stage in only:
            expected = launch.expecting(launch.again(witness.on, witness.options), flight)
            yield expected.compare(launch.after, flight)


def measure(on: device.Device, scene: Scene, only: Sequence[str] = ()) -> Iterator[Figure]:
    """Yield figures of a bounce's stages: the share of written words that agree with the witness.

    only: names of stages, by default all. Raises like `checked`.
    """
    witness = witness_of(on)
    for comparison in checked(on, scene, witness, only):
        stage, share = comparison.launch.stage, 100.0 * (1.0 - comparison.share)
        more = {"witness": witness.name, "stage": stage, "mode": scene.film.mode}
        figure = Figure(PART, stage, "%", (share,), scene.name, more)
        wrong = comparison.problem and f"wrong: {comparison.problem}, beside {witness.name}"
        yield figure.refuse(wrong)


def first_wrong(on: device.Device, scene: Scene) -> str:
    """Return a line on the first stage with wrong words, or that all stages are right."""
    witness = witness_of(on)
    for comparison in checked(on, scene, witness):
        if comparison.problem:
            stage = comparison.launch.stage.replace("_", " ")
            return f"first in {stage}: {comparison.problem}, beside {witness.name}"
    return f"its rays are right, and its stages agree with {witness.name}: look at accumulate"
