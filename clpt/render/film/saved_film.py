"""A film with all that continues it: the origin of its samples, and the sessions of rendering."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from clpt.errors import SceneError
from clpt.render.film.developed import Developed
from clpt.render.film.pictures import PictureForm, Pictures
from clpt.render.film.state import FilmState, Ranges
from clpt.scene.fingerprint import Fingerprint, Plain
from clpt.scene.integrators import Integrator, Path, Vcm

MOST_NAMED = 8  # differences that an error names


@dataclass(frozen=True)
class Session:
    """A session of rendering: a process added samples to a film.

    began: ISO 8601 in UTC; seconds: of rendering; clpt: its version; device: label, driver, lanes
    of its kernels and layout of its trees; the last bits depend on them.
    """

    began: str
    seconds: float
    clpt: str
    device: Mapping[str, Plain]


@dataclass(frozen=True)
class Origin:
    """The origin of a film's samples.

    scene: its fingerprint; settings: choices that were made for it, such as the integrator of
    `auto`; kernels: the digest of their texts; clpt: the version that has these kernels.
    """

    scene: Fingerprint
    settings: Mapping[str, Plain]
    kernels: str
    clpt: str

    def differences(self, other: Origin) -> list[str]:
        """Return why the samples of another film differ, such as "seed: 0 -> 3"."""
        differences = self.scene.differences(other.scene)
        differences += Fingerprint(self.settings).differences(Fingerprint(other.settings))
        if self.kernels != other.kernels:
            differences.append(f"kernels: of clpt {self.clpt} -> others, of clpt {other.clpt}")
        return differences

    @property
    def chosen_integrator(self) -> Integrator | None:
        """The integrator, without its depths, that `auto` may have chosen; else None."""
        names = ("integrator", "light_paths", "guide_paths")
        kind, paths, guide = (self.settings.get(f"chosen.{name}") for name in names)
        if kind == Vcm.kind:
            return Vcm(light_paths=int(paths or 1))
        if kind == Path.kind:
            count = int(guide or 0)
            return Path(light_paths=float(paths or 0), guiding=count > 0, guide_paths=count)
        return None

    def check_same(self, other: Origin) -> None:
        """Raise SceneError, which names the differences, if samples of another film differ."""
        if differences := self.differences(other):
            raise SceneError(f"the film is of something else: {differences_text(differences)}")


@dataclass(frozen=True, eq=False)
class SavedFilm(Pictures):
    """A film with all that continues it, as `Renderer.save_state` writes it.

    form: how its words become pictures; counts: of paths and rays, by name; sessions: of rendering;
    adaptive: arrays of the state of adaptive sampling by name, empty without it.
    """

    film: FilmState
    origin: Origin
    form: PictureForm
    counts: Mapping[str, int]
    sessions: tuple[Session, ...]
    adaptive: Mapping[str, NDArray[Any]]

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        """Restore a pickle; in old pickles `counts` is a tuple of length 1."""
        self.__dict__.update(state)
        if isinstance(state["counts"], tuple):
            (self.__dict__["counts"],) = state["counts"]

    def developed(self, *words: str) -> Developed:
        """Return the pictures of the film."""
        return Developed(self.film, self.form)

    def check_fits(self, origin: Origin, film: FilmState) -> None:
        """Raise SceneError if its samples have another origin, or `film` has other shapes."""
        self.origin.check_same(origin)
        saved = self.film.arrays
        if any(array.shape != saved[name].shape for name, array in film.arrays.items()):
            raise SceneError("the film has another form than this scene's")

    def saved_film(self, *, held: bool = False) -> SavedFilm:
        """Return itself; held: has a meaning only for renderers."""
        return self

    @property
    def seconds(self) -> float:
        """The time that all sessions have rendered [s]."""
        return sum(session.seconds for session in self.sessions)

    def merged(self, other: SavedFilm) -> SavedFilm:
        """Return the film of the samples of both.

        Raises SceneError if their origins differ, or a sample is in both.
        """
        self.origin.check_same(other.origin)
        counts = {name: value + other.counts[name] for name, value in self.counts.items()}
        return dataclasses.replace(
            self,
            film=self.film.merged(other.film),
            form=dataclasses.replace(self.form, adaptive=self.form.adaptive or other.form.adaptive),
            counts=counts,
            sessions=(*self.sessions, *other.sessions),
            adaptive={},
        )


def other_devices(sessions: Iterable[Session], device: Mapping[str, Plain]) -> list[str]:
    """Return how the devices of a film's sessions differ from `device`; empty if they do not."""
    named: dict[str, None] = {}
    for session in sessions:
        for name, value in session.device.items():
            if value != device.get(name):
                named[f"{name}: {value} -> {device.get(name)}"] = None
    return list(named)


def classes_text(others: list[str]) -> str:
    """Return a warning that names the differences from `other_devices`."""
    return "samples of several classes of devices are in one film: " + "; ".join(others)


def differences_text(differences: list[str]) -> str:
    """Return differences for people, at most MOST_NAMED of them."""
    more = len(differences) - MOST_NAMED
    return "; ".join(differences[:MOST_NAMED]) + (f"; and {more} more" if more > 0 else "")


def ranges_text(taken: Ranges) -> str:
    """Return ranges of samples for people, such as "0 to 1023"."""
    return ", ".join(f"{first} to {end - 1}" for first, end in taken) or "none"
