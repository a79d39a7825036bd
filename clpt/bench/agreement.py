"""Agreement of stages: the words that a device writes beside a witness's words.

The witness is a CPU of another platform, or else the device with a program that its compiler did
not optimise. Most faults of drivers are faults of optimisers.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from clpt import device
from clpt.bench.figures import Figure
from clpt.bench.launches import PLAIN, Comparison, Flight, Launch, launches
from clpt.errors import ClptError, UnknownKindError
from clpt.layout import SLAB_BLOCK
from clpt.records import SLABS
from clpt.scene import Scene

PART = "agreement"
SLOTS = 1 << 12
WARM = 4  # bounces before the check, so that paths of all depths are in flight
NAMED = 4  # the most members in a message


@dataclass(frozen=True)
class Witness:
    """A device that repeats launches, its compiler's options, and its name."""

    on: device.Device
    options: tuple[str, ...]
    name: str


@dataclass(frozen=True, eq=False)
class Checked:
    """A launch with the witness's words, the device's comparison, and the members that differ."""

    launch: Launch
    comparison: Comparison
    members: Sequence[str]

    @property
    def problem(self) -> str:
        """The error as text, or ""."""
        if not self.comparison.wrong:
            return ""
        names = ", ".join(self.members[:NAMED]) + (", ..." if len(self.members) > NAMED else "")
        share = max(self.comparison.share, 0.01)
        return f"{share:.0%} of what it writes is wrong ({names})".replace("%", " %")


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
) -> Iterator[Checked]:
    """Run a bounce of a scene; yield each stage's launch beside the witness's.

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
            comparison = expected.compare(launch.after)
            yield Checked(expected, comparison, members(flight, comparison))


def measure(on: device.Device, scene: Scene, only: Sequence[str] = ()) -> Iterator[Figure]:
    """Yield figures of a bounce's stages: the share of written words that agree with the witness.

    only: names of stages, by default all. Raises like `checked`.
    """
    witness = witness_of(on)
    for result in checked(on, scene, witness, only):
        stage, share = result.launch.stage, 100.0 * (1.0 - result.comparison.share)
        more = {"witness": witness.name, "stage": stage, "mode": scene.film.mode}
        figure = Figure(PART, stage, "%", (share,), scene.name, more)
        problem = result.problem and f"wrong: {result.problem}, beside {witness.name}"
        yield figure.refuse(problem)


def first_wrong(on: device.Device, scene: Scene) -> str:
    """Return a line on the first stage with wrong words, or that all stages are right."""
    witness = witness_of(on)
    for result in checked(on, scene, witness):
        if result.problem:
            stage = result.launch.stage.replace("_", " ")
            return f"first in {stage}: {result.problem}, beside {witness.name}"
    return f"its rays are right, and its stages agree with {witness.name}: look at accumulate"


def members(flight: Flight, comparison: Comparison) -> list[str]:
    """Return the names of slabs' members, and of other buffers, with wrong words."""
    names: dict[str, None] = {}
    for name, words in comparison.off.items():
        record = next((slab for slab in SLABS if f"{slab.name.lower()}_words" == name), None)
        if record is None:
            names |= dict.fromkeys([name] if len(words) else [])
            continue
        stride = flight.wavefront.paths.rows(record, 0).pitch // 4
        in_blocks = flight.wavefront.lanes == 1
        rows = words // SLAB_BLOCK % record.step if in_blocks else words // stride
        for member in record.members:
            if ((rows >= member.word) & (rows < member.word + member.words)).any():
                names[member.name] = None
    return list(names)
