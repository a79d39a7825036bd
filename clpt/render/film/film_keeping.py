"""What all renderers have in common that keep their film in files: they denoise it too."""

from __future__ import annotations

from pathlib import Path

from clpt.errors import SceneError
from clpt.render.film import film_file
from clpt.render.film.denoised_picture import DenoisedPicture
from clpt.render.film.pictures import Image, Pictures
from clpt.render.film.saved_film import SavedFilm, Session
from clpt.scene import Scene


class FilmKeeping(Pictures):
    """Base of renderers whose film is saved to a file, and gone on with from one."""

    scene: Scene
    _sessions: tuple[Session, ...]  # that the film has from before

    @property
    def former_seconds(self) -> float:
        """How long others rendered the film, before this renderer went on with it."""
        return sum(session.seconds for session in self._sessions)

    def saved_film(self, *, held: bool = False) -> SavedFilm:
        """Return the film with all that it takes to go on with it; held: as it was when held."""
        raise NotImplementedError

    def restore(self, saved: SavedFilm) -> None:
        """Go on from a saved film. Raises SceneError."""
        raise NotImplementedError

    def denoised(self, method: str | None = None) -> Image:
        """The picture so far without most of its noise, as `image` returns it.

        method: oidn or statistical, by default what the renderer was made for, else oidn. Make the
        renderer with the option `denoise`: so the film has what the denoiser wants. See
        `clpt.DenoisedPicture`, also for what it raises.
        """
        return DenoisedPicture(self, method).image()

    def save_state(self, path: str | Path) -> None:
        """Write the film to a file, from which `load_state` goes on, in another process too.

        Raises SceneError for a file that cannot be written: the former one is then as it was.
        """
        saved = self.saved_film()
        try:
            film_file.write(path, saved)
        except OSError as error:
            raise SceneError(f"cannot be written: {error}", file=path) from error

    def load_state(self, path: str | Path) -> None:
        """Go on from a file of `save_state`, of any renderer: what the film held before is gone.

        All that follows is to the bit as if nothing had been interrupted, where the device is of
        the class that took the samples; `warnings` tells where it is not.

        Raises SceneError for a file that cannot be read, is damaged, or is of another scene, other
        settings or other kernels: it says what differs, and nothing has changed.
        """
        saved = film_file.read(path)
        try:
            self.restore(saved)
        except SceneError as error:
            raise SceneError(error.message, file=path) from None
