"""Stages beside themselves: what each writes, and what a witness writes from the same words.

The witness is a CPU of another platform, or else the device itself with a program that its compiler
did not optimise. Most faults of drivers are faults of optimisers, so that they show there.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from clpt import device
from clpt.bench.figures import Figure
from clpt.bench.flight import Flight
from clpt.bench.launches import PLAIN, Comparison, Launch, launches
from clpt.errors import ClptError, UnknownKindError
from clpt.layout import SLAB_BLOCK
from clpt.records import SLABS
from clpt.scene import Scene

PART = "agreement"
SLOTS = 1 << 12
WARM = 4  # bounces before, so that paths of all depths are in flight
NAMED = 4  # members that are named at most


@dataclass(frozen=True)
class Witness:
    """A device that runs launches again, the options of its compiler, and its name in a line."""

    on: device.Device
    options: tuple[str, ...]
    name: str


@dataclass(frozen=True, eq=False)
class Checked:
    """A launch whose words after it are the witness's; what the device made of it; the members."""

    launch: Launch
    comparison: Comparison
    members: Sequence[str]

    @property
    def told(self) -> str:
        """Say what is wrong, or ""."""
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

    only: names of stages, all by default. Raises UnknownKindError for one that is not there; as
    Flight does, and KernelBuildError, DeviceError, MemoryBudgetError of the witness.
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
    """Figures of the stages of a bounce: words that agree with the witness's, of those written.

    only: names of stages, all by default. Raises as `checked` does.
    """
    witness = witness_of(on)
    for one in checked(on, scene, witness, only):
        stage, share = one.launch.stage, 100.0 * (1.0 - one.comparison.share)
        more = {"witness": witness.name, "stage": stage, "mode": scene.film.mode}
        figure = Figure(PART, stage, "%", (share,), scene.name, more)
        yield figure.refuse(f"wrong: {one.told}, beside {witness.name}" if one.told else "")


def first_wrong(on: device.Device, scene: Scene) -> str:
    """Return the first stage whose words are wrong, and how, for a line; or that all are right."""
    witness = witness_of(on)
    for one in checked(on, scene, witness):
        if one.told:
            stage = one.launch.stage.replace("_", " ")
            return f"first in {stage}: {one.told}, beside {witness.name}"
    return f"its rays are right, and its stages as those of {witness.name}: look at accumulate"


def members(flight: Flight, comparison: Comparison) -> list[str]:
    """Return the names of the members of slabs, and of other buffers, with words that are off."""
    found: dict[str, None] = {}
    for name, words in comparison.off.items():
        record = next((one for one in SLABS if f"{one.name.lower()}_words" == name), None)
        if record is None:
            found |= dict.fromkeys([name] if len(words) else [])
            continue
        stride = flight.wavefront.paths.rows(record, 0).pitch // 4
        in_blocks = flight.wavefront.lanes == 1
        rows = words // SLAB_BLOCK % record.step if in_blocks else words // stride
        for member in record.members:
            if ((rows >= member.word) & (rows < member.word + member.words)).any():
                found[member.name] = None
    return list(found)
