"""The base of all renderers, be it on a device, on several, or on a cluster.

Samples are asked for here, and the film that they make is denoised, saved and gone on with. Heirs
say who takes the samples.
"""

from __future__ import annotations

import logging
import time
from abc import abstractmethod
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from clpt import images
from clpt.arrays import Image
from clpt.choices import MOST_SAMPLES, Exposure
from clpt.colour.view import View
from clpt.errors import SceneError
from clpt.render.contents import FilmOwner
from clpt.render.contract.features import Features
from clpt.render.film import film_file
from clpt.render.film.denoised_picture import DenoisedPicture
from clpt.render.film.developed import Developed
from clpt.render.film.layer_channels import write_layers
from clpt.render.film.pictures import Pictures
from clpt.render.film.saved_film import (
    Origin,
    SavedFilm,
    Session,
    classes_text,
    other_devices,
)
from clpt.render.locking import Stop, synchronized
from clpt.render.progress import Progress
from clpt.render.wavefront import adaptive
from clpt.render.wavefront.adaptive import Adaptive
from clpt.render.wavefront.film_state import FilmState
from clpt.render.wavefront.wavefront import Counts
from clpt.scene import Scene
from clpt.scene.cameras import Camera
from clpt.scene.fingerprint import Plain
from clpt.version import VERSION

if TYPE_CHECKING:
    from typing_extensions import Self


log = logging.getLogger(__name__)

OnProgress = Callable[[Progress], bool | None]


class FilmRenderer(FilmOwner, Pictures):
    """Base of renderers: what adds samples of a scene to a film.

    scene: that is rendered; warnings: for people; shows_meanwhile: whether there is a picture to
    show while samples are taken.
    """

    scene: Scene
    warnings: list[str]
    _shows_meanwhile = False

    def __init__(self) -> None:
        super().__init__()
        self._stop = Stop()
        self._first_sample = 0
        self._start = time.perf_counter()
        self._seconds: dict[str, float] = {}
        self._seconds_rendered = 0.0  # since the film was empty, or gone on with
        self._telling = False  # of progress, while samples are taken

    # ---- what there is

    @property
    def _device_text(self) -> str:
        """Names of the devices that take the samples, for people."""
        return " and ".join(on.info.label for on in self.devices)

    @property
    @abstractmethod
    def counts(self) -> Counts:
        """Counts of what has happened so far."""

    @property
    def samples(self) -> int:
        """The number of the next sample: of all so far, where they began at number 0."""
        taken = self._known.taken
        return taken[-1][1] if taken else self._first_sample

    @property
    def first_sample(self) -> int:
        """The number of the first sample of the film, or of the first one to come."""
        taken = self._known.taken
        return taken[0][0] if taken else self._first_sample

    @property
    def active(self) -> float:
        """The share of the pixels that would get more samples, 1 but for `run` with `noise`."""
        chosen = self._adaptive
        return 1.0 if chosen is None else chosen.active

    @property
    def _former_seconds(self) -> float:
        """Seconds for which others rendered the film, before this renderer went on with it."""
        return sum(session.seconds for session in self._known.sessions)

    @property
    def _adaptive(self) -> Adaptive | None:
        """Which pixels get more samples, None before that was asked."""
        return self._known.adaptive

    def _progress_so_far(self, device: Mapping[str, Plain]) -> dict[str, Any]:
        """Return what a saved film has beside its words and origin; device: the class it is of."""
        now, chosen = self._settled, self._adaptive
        session = Session(now.began, self._seconds_rendered, VERSION, device)
        return {
            "taken": now.taken,
            "counts": dict(vars(self.counts)),
            "sessions": (*now.sessions, session),
            "adaptive": {} if chosen is None else chosen.arrays(),
        }

    @abstractmethod
    def _origin(self) -> Origin:
        """Return what the samples are of. Raises SceneError for a scene that cannot be read."""

    def _warn_of_others(self, sessions: Iterable[Session], device: Mapping[str, Plain]) -> None:
        """Warn where sessions had other classes of devices than this one."""
        if others := other_devices(sessions, device):
            self.warnings.append(classes_text(others))
            log.warning("%s", self.warnings[-1])

    # ---- samples

    def prepare(self) -> None:
        """Get ready, so that the first samples come at once; others may do so by themselves."""

    @abstractmethod
    def update(self, *, camera: Camera | None = None, scene: Scene | None = None) -> Any:
        """Render another scene from now on, or another camera, and begin again at sample 0."""

    @synchronized
    def run(
        self, samples: int, progress: OnProgress | None = None, *, noise: float | None = None
    ) -> bool:
        """Add samples to every pixel and wait; `self.samples` is then the next one's number.

        noise: leave pixels as soon as the noise around them is as low, relative to the picture,
        such as 0.02; `samples` is then the most that a pixel gets, see
        clpt.render.wavefront.adaptive. A renderer with `denoise` counts what is left after that.
        progress: called every few milliseconds to seconds; if it returns False the run stops soon,
        as after `cancel`. Returns whether it came to its end. What progress raises, or Ctrl+C at
        any line, is raised when the paths in flight have ended. The film is whole after a stop too:
        its pixels have fewer samples, and the numbers of those left out are not used again.

        Raises SceneError for noise that makes no sense with the scene, and for more than 2^31 - 1
        samples.
        """
        first, end = next_range(self.samples, samples)
        if self._stop.is_set():  # before it began: nothing is taken
            self._rest()
            return False
        if noise is not None:
            noise = adaptive.checked(noise, self._features)
        watch = Watch(self, progress, end)
        try:
            finished = self._add_samples(first, end, noise, watch)
        finally:
            self._seconds_rendered += watch.seconds
            self._rest()
        if watch.raised is not None:
            raise watch.raised
        return finished

    @property
    @abstractmethod
    def _features(self) -> Features:
        """The features of the scene."""

    @abstractmethod
    def _add_samples(self, first: int, end: int, noise: float | None, watch: Watch) -> bool:
        """Add samples first to end - 1, or those of pixels with noise; return whether all were.

        watch: called all the while.
        """

    @property
    @abstractmethod
    def _pixels(self) -> int:
        """The number of pixels that are sampled."""

    def _so_far(self, end: int, seconds: float) -> Progress:
        """Return how far a run is after some seconds; end: the number after its last sample."""
        counts, chosen = self.counts, self._adaptive
        mean = counts.samples / self._pixels
        noise = None if chosen is None else chosen.level
        return Progress(mean, end, counts.samples, counts.rays, seconds, self.active, noise)

    def cancel(self, *, discard: bool = False) -> None:
        """Let the `run` of another thread, or else the next one, stop soon and return False.

        discard: the film is of no use any more, which one device makes use of: paths in flight are
        left as they are, which is sooner, and a run that has begun leaves the film as after
        `reset`. A step is not stopped. It may be called from anywhere, also from a signal's
        handler, and waits for nothing.
        """
        self._stop.set()

    def _rest(self) -> None:
        """Note that no run is under way, nor to be stopped any more."""
        self._telling = False
        self._stop.clear()

    # ---- the film, its pictures, and its files

    @synchronized
    def _developed(self, *words: str) -> Developed:
        """Return the pictures of the film as it is now, which then stay; see `Pictures`."""
        return Developed(self.film_state(), self._form)

    @abstractmethod
    def film_state(self) -> FilmState:
        """Return what the film holds, as whole numbers on the host; wait for it."""

    @abstractmethod
    def merge(self, state: FilmState) -> None:
        """Add the samples of another film of the same scene to this one, and wait."""

    @abstractmethod
    def _hold(self) -> None:
        """Keep the film as it is now, for `saved_film`."""

    @abstractmethod
    def _saved_film(self, *, held: bool = False) -> SavedFilm:
        """Return the film with all that it takes to go on with it; held: as it was when held."""

    @abstractmethod
    def _restore(self, saved: SavedFilm) -> None:
        """Go on from a saved film, as `load_state` does. Raises SceneError."""

    def _follow(self, origin: Origin) -> None:
        """Render in the way that made a film, if that can be; the film may be empty then.

        What is "auto" may depend on how many samples are wanted, which the film did not know.
        """

    def denoised(self, method: str | None = None) -> Image:
        """The picture so far without most of its noise, as `image` returns it.

        method: oidn or statistical, by default what the renderer was made for, else oidn. Make the
        renderer with the option `denoise`: so the film has what the denoiser wants. See
        `clpt.DenoisedPicture`, also for what it raises.
        """
        return DenoisedPicture(self, method).image()

    def save(
        self,
        path: str | Path,
        *,
        exposure: Exposure = 0.0,
        tone: str = "none",
        view: View | None = None,
    ) -> None:
        """Write the picture so far to a file, in the format of the path's suffix; wait for it.

        An .exr has the film's layers. A renderer with `denoise` writes what is denoised.
        exposure [stops], tone, view: of files for screens, see `clpt.write_image`.

        Raises SceneError for an unknown suffix, and for a file that cannot be written.
        """
        path, film = Path(path), self.scene.film
        if film.layers and path.suffix.lower() == ".exr" and self.denoise is None:
            write_layers(path, self)
            return
        plain = self.image() if film.bands == 0 else self.colours()
        picture = plain if self.denoise is None else self.denoised()
        space = film.output_space
        images.write(path, picture, exposure=exposure, space=space, tone=tone, view=view)

    def save_state(self, path: str | Path) -> None:
        """Write the film to a file, from which `load_state` goes on, in another process too.

        path: of the file; the former one is replaced.

        Raises SceneError for a file that cannot be written: the former one is then as it was.
        """
        saved = self._saved_film()
        try:
            film_file.write(path, saved)
        except OSError as error:
            raise SceneError(f"cannot be written: {error}", file=path) from error

    def load_state(self, path: str | Path) -> None:
        """Go on from a file of `save_state`, of any renderer: what the film held before is gone.

        path: of the file.

        All that follows is to the bit as if nothing had been interrupted, where the device is of
        the class that took the samples; `warnings` tells where it is not.

        Raises SceneError for a file that cannot be read, is damaged, or is of another scene, other
        settings or other kernels: it says what differs, and nothing has changed.
        """
        saved = film_file.read(path)
        try:
            self._restore(saved)
        except SceneError as error:
            raise SceneError(error.message, file=path) from None

    # ---- the end

    @abstractmethod
    def close(self) -> None:
        """Give back what it holds; it is of no use afterwards."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


class Watch:
    """Called while a run takes samples: it tells of them, and returns whether they go on.

    end: the number after the last sample. raised: what `progress` raised.
    """

    def __init__(self, renderer: FilmRenderer, progress: OnProgress | None, end: int):
        self._renderer, self._progress, self._end = renderer, progress, end
        self._began = time.perf_counter()
        self.raised: BaseException | None = None

    @property
    def seconds(self) -> float:
        """Seconds that the run has taken."""
        return time.perf_counter() - self._began

    def __call__(self, _: object = None) -> bool:
        renderer = self._renderer
        if renderer.counts.samples:
            taken = time.perf_counter() - renderer._start
            renderer._seconds.setdefault("first_sample", taken)
        if renderer._stop.is_set() or self._progress is None:
            return not renderer._stop.is_set()
        renderer._telling = True
        try:
            if self._progress(renderer._so_far(self._end, self.seconds)) is False:
                renderer._stop.set()
        except BaseException as error:
            self.raised = error
            renderer._stop.set()
        finally:
            renderer._telling = False
        return not renderer._stop.is_set()


def next_range(first: int, samples: int) -> tuple[int, int]:
    """Return the numbers, first and end, of so many samples from the first. Raises SceneError."""
    return first, checked_number(first + checked_samples(samples))


def checked_number(number: int) -> int:
    """Return a sample's number. Raises SceneError for one that is too large."""
    if number > MOST_SAMPLES:
        raise SceneError(f"a pixel cannot have more than {MOST_SAMPLES} samples", where="samples")
    return number


def checked_samples(samples: int) -> int:
    """Return a number of samples. Raises SceneError for one that is none."""
    if isinstance(samples, bool) or not isinstance(samples, (int, np.integer)) or samples < 1:
        raise SceneError(f"samples per pixel must be a whole number above zero, not {samples!r}")
    return int(samples)
