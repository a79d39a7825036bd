"""A film with all that it takes to go on with it: what its samples are of, and what was done."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from clpt.errors import SceneError
from clpt.render.film.developed import Developed
from clpt.render.film.picture_form import PictureForm
from clpt.render.film.pictures import Pictures
from clpt.render.film.state import FilmState, Ranges
from clpt.scene.fingerprint import Fingerprint, Plain
from clpt.scene.integrators import Integrator, Path, Vcm

MOST_NAMED = 8  # differences that an error names


@dataclass(frozen=True)
class Session:
    """A session of rendering: what one process added to a film.

    began: when, as ISO 8601 in UTC; seconds: that it rendered; clpt: its version; device: by a
    label, driver, lanes of its kernels and layout of its trees: what decides the last bits.
    """

    began: str
    seconds: float
    clpt: str
    device: Mapping[str, Plain]


@dataclass(frozen=True)
class Origin:
    """The origin of a film's samples.

    scene: as `clpt.scene.fingerprint` has it; settings: choices that were made for it, such as the
    integrator of `auto`; kernels: the digest of their texts; clpt: the version that has them.
    """

    scene: Fingerprint
    settings: Mapping[str, Plain]
    kernels: str
    clpt: str

    def differences(self, other: Origin) -> list[str]:
        """Return why the samples of another film are others, such as "seed: 0 -> 3"."""
        found = self.scene.differences(other.scene)
        found += Fingerprint(self.settings).differences(Fingerprint(other.settings))
        if self.kernels != other.kernels:
            found.append(f"kernels: of clpt {self.clpt} -> others, of clpt {other.clpt}")
        return found

    @property
    def way(self) -> Integrator | None:
        """The integrator, without its depths, if it is one that may have been chosen."""
        names = ("integrator", "light_paths", "guide_paths")
        kind, paths, guide = (self.settings.get(f"chosen.{name}") for name in names)
        if kind == Vcm.kind:
            return Vcm(light_paths=int(paths or 1))
        if kind == Path.kind:
            count = int(guide or 0)
            return Path(light_paths=float(paths or 0), guiding=count > 0, guide_paths=count)
        return None

    def check_same(self, other: Origin) -> None:
        """Raise SceneError, which says what differs, if the samples of another film are others."""
        if found := self.differences(other):
            raise SceneError(f"the film is of something else: {differences_text(found)}")


@dataclass(frozen=True, eq=False)
class SavedFilm(Pictures):
    """A film, and all that it takes to go on with it, as `Renderer.save_state` writes it.

    form: how its pictures are made; counts: paths and rays by name; sessions: what was
    done; adaptive: the state of adaptive sampling, arrays by name, empty without.
    """

    film: FilmState
    origin: Origin
    form: PictureForm
    counts: Mapping[str, int]
    sessions: tuple[Session, ...]
    adaptive: Mapping[str, NDArray[Any]]

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        """Take what a pickle holds; in older ones `counts` are a tuple of always one."""
        self.__dict__.update(state)
        if isinstance(state["counts"], tuple):
            (self.__dict__["counts"],) = state["counts"]

    @property
    def _form(self) -> PictureForm:  # type: ignore[override]
        """The way from the film's words to a picture."""
        return self.form

    def _developed(self, *words: str) -> Developed:
        """Return the pictures of the film."""
        return Developed(self.film, self.form)

    def check_fits(self, origin: Origin, film: FilmState) -> None:
        """Raise SceneError where its samples are of something else, or a film has another form."""
        self.origin.check_same(origin)
        given = self.film.arrays
        if any(array.shape != given[name].shape for name, array in film.arrays.items()):
            raise SceneError("the film has another form than this scene's")

    def _saved_film(self, *, held: bool = False) -> SavedFilm:
        """Return itself; held: as of a renderer, here without a meaning."""
        return self

    @property
    def seconds(self) -> float:
        """The time that all sessions have rendered [s]."""
        return sum(session.seconds for session in self.sessions)

    def merged(self, other: SavedFilm) -> SavedFilm:
        """Return the film of the samples of both.

        Raises SceneError where they are not of the same scene, or a sample is in both.
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
    """Return how devices that took a film's samples differ from another one, perhaps nothing."""
    named: dict[str, None] = {}
    for session in sessions:
        for name, value in session.device.items():
            if value != device.get(name):
                named[f"{name}: {value} -> {device.get(name)}"] = None
    return list(named)


def classes_text(others: list[str]) -> str:
    """Return a warning of devices that differ, from `other_devices`."""
    return "samples of several classes of devices are in one film: " + "; ".join(others)


def differences_text(differences: list[str]) -> str:
    """Return differences for people, no more than a few."""
    more = len(differences) - MOST_NAMED
    return "; ".join(differences[:MOST_NAMED]) + (f"; and {more} more" if more > 0 else "")


def ranges_text(taken: Ranges) -> str:
    """Return ranges of samples for people, such as "0 to 1023"."""
    return ", ".join(f"{first} to {end - 1}" for first, end in taken) or "none"
