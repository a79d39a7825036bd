"""Datasets of pictures with ground truth: a function makes each scene, a folder keeps what is done.

A picture is finished once its record `records/000123.json` is written, the last of its files. A run
that is killed goes on where it stopped; `failures/000123.txt` holds the error of a picture whose
function failed, which the next run tries again.
"""

from __future__ import annotations

import json
import logging
import time
import traceback
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast

import numpy as np

from clpt import device as dev
from clpt.arrays import Floats32
from clpt.dataset.picture import Picture
from clpt.dataset.truth import Truth, ground_truth, truth_scene
from clpt.dataset.writers import WRITERS, Writer
from clpt.errors import ClptError, SceneError, UnknownKindError
from clpt.files import output_files
from clpt.render.flow.scene_to_tables import lower
from clpt.render.options import RenderOptions
from clpt.render.records import Features
from clpt.render.renderer import Renderer
from clpt.render.wavefront.strategy import UNTUNED, Strategy, choose
from clpt.scene import Scene
from clpt.scene.fingerprint import fingerprint

if TYPE_CHECKING:
    from typing_extensions import Unpack

log = logging.getLogger(__name__)

MakeScene = Callable[[int, np.random.Generator], Scene]
TRUTHS = ("none", "visible", "silhouettes")
DEFAULTS = {"spp": 16, "seed": 0, "truth": "visible"}  # what pictures of a folder have in common


@dataclass(frozen=True)
class Report:
    """A run of `generate`: numbers of pictures that it wrote and that were there, and errors.

    failures: the error's line by the number of the picture.
    """

    written: int
    present: int
    failures: dict[int, str]


class PictureOptions(RenderOptions, total=False):
    """Options of pictures.

    spp: samples of a pixel, 16. seed: of the random numbers, 0. truth: "none", "visible", or
    "silhouettes", with each object alone too; "visible" by default. device: see `clpt.Renderer`.
    """

    spp: int
    seed: int
    truth: Literal["none", "visible", "silhouettes"]
    device: dev.Device | str | int | None


def pictures(
    make_scene: MakeScene,
    indices: Iterable[int],
    *,
    on_failure: Callable[[int, Exception], None] | None = None,
    **options: Unpack[PictureOptions],
) -> Iterator[Picture]:
    """Yield pictures of random scenes, such as for a DataLoader.

    make_scene: called with the picture's number and a generator of random numbers, which depends on
    `seed` and this number alone; returns the scene. indices: numbers. on_failure: called with the
    number and the error of a picture that fails, then the others follow; None: it is raised.
    options: see `PictureOptions` and `clpt.Renderer`.
    """
    with Renderers(options) as renderers:
        for index in indices:
            try:
                picture = renderers.picture(make_scene, index)
            except Exception as error:
                if on_failure is None:
                    raise
                on_failure(index, error)
            else:
                yield picture


def warm(make_scene: MakeScene, indices: Iterable[int], **options: Unpack[PictureOptions]) -> int:
    """Compile what pictures need into the caches, and render nothing.

    So no later picture waits for a compiler that needs what one of these needs. Pictures whose
    function fails are passed over. Arguments: as of `pictures`. Returns the number of programs that
    were compiled; the others were in the caches.
    """
    with Renderers(options) as renderers:
        for index in indices:
            try:
                renderers.prepare(_scene(make_scene, renderers.seed, index))
            except Exception as error:
                log.warning("picture %d would fail: %s", index, error)
        return renderers.compiled


def _scene(make_scene: MakeScene, seed: int, index: int) -> Scene:
    """Return the scene of a picture. Raises SceneError for anything else."""
    scene: object = make_scene(index, np.random.default_rng([seed, index]))
    if not isinstance(scene, Scene):
        message = f"returned {type(scene).__name__} for picture {index}, not a Scene"
        raise SceneError(message, where="make_scene")
    return scene


class Renderers:
    """Two renderers that get scene after scene: of the light, and of the truth."""

    def __init__(self, options: PictureOptions):
        own: dict[str, Any] = {**DEFAULTS, "device": None, **options}
        self.spp, self.seed, self.truth = own.pop("spp"), own.pop("seed"), own.pop("truth")
        self.device, self.options = own.pop("device"), cast(RenderOptions, own)
        if self.truth not in TRUTHS:
            raise UnknownKindError("truth", self.truth, TRUTHS)
        self.open: list[Renderer] = []
        self.needs: set[tuple[tuple[Features, Strategy], ...]] = set()  # of scenes that came

    def __enter__(self) -> Renderers:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        for renderer in self.open:
            renderer.close()

    def picture(self, make_scene: MakeScene, index: int) -> Picture:
        """Render a picture. Raises what make_scene raises, and as `clpt.Renderer` does."""
        begin = time.perf_counter()
        scene = _scene(make_scene, self.seed, index)
        image, truth = self._render(scene)
        return Picture(index, image, scene, truth, time.perf_counter() - begin)

    def _render(self, scene: Scene) -> tuple[Floats32, Truth | None]:
        """Return a scene's picture (h, w, 3), and its ground truth."""
        self._bring(scene)
        self.open[0].run(self.spp)
        image = np.array(self.open[0].image()[..., :3])
        if self.truth == "none":
            return image, None
        alone = self.truth == "silhouettes"
        return image, ground_truth(scene, self._for_truth(scene), silhouettes=alone)

    def prepare(self, scene: Scene) -> None:
        """Compile what `render` needs, where no scene before needed the same."""
        parts = [scene] if self.truth == "none" else [scene, truth_scene(scene)]
        if self.open and not self._is_new(parts):
            return
        self._bring(scene)
        self.open[0].prepare()
        if self.truth != "none":
            renderer = self._for_truth(scene)
            renderer.update(scene=parts[1])
            renderer.prepare()

    def _is_new(self, parts: list[Scene]) -> bool:
        """Return whether scenes may need other programs than those before."""
        device = self.open[0].device
        tables = [lower(scene) for scene in parts]
        if any(lowered.candidates for lowered in tables):  # a trial render decides
            return True
        needs = tuple((each.features, choose(device, each, UNTUNED)) for each in tables)
        before = len(self.needs)
        self.needs.add(needs)
        return len(self.needs) > before

    @property
    def compiled(self) -> int:
        """The number of programs that were in no cache."""
        devices = {id(on): on for renderer in self.open for on in renderer.devices}
        return sum(on.builds.programs - on.builds.cached for on in devices.values())

    def _bring(self, scene: Scene) -> None:
        if self.open:
            self.open[0].update(scene=scene)
        else:
            self.open.append(Renderer(scene, self.device, in_turn=True, **self.options))

    def _for_truth(self, scene: Scene) -> Renderer:
        if len(self.open) == 1:
            light = self.open[0]
            bare = truth_scene(scene)
            self.open.append(Renderer(bare, light.device, beside=light, in_turn=True))
        return self.open[1]


def generate(
    make_scene: MakeScene,
    count: int,
    folder: str | Path,
    *,
    form: str = "folders",
    part: tuple[int, int] = (0, 1),
    **options: Unpack[PictureOptions],
) -> Report:
    """Render pictures 0 to count - 1 of random scenes into a folder, with their ground truth.

    form: a name in `WRITERS`. part: (i, n), each process or machine takes every n-th picture, from
    i on; they may share the folder. Other arguments: see `pictures`. Finished pictures stay: a run
    that was killed goes on. An error of a picture stands in `failures`; the others go on. The
    summary of a form, such as annotations.json, is written when all pictures are there.

    Raises UnknownKindError for a form, SceneError where the folder holds another dataset or
    make_scene makes another first scene, OSError where files cannot be written: a full disk ends
    the run, and the same call goes on.
    """
    if form not in WRITERS:
        raise UnknownKindError("form of a dataset", form, WRITERS)
    first, step = part
    if not 0 <= first < step or count < 1:
        message = f"must be (i, n) with 0 <= i < n and count at least 1, not {part} of {count}"
        raise SceneError(message, where="part")
    folder = Path(folder)
    (folder / "records").mkdir(parents=True, exist_ok=True)
    output_files.check_folder(folder)
    settings = {name: options.get(name, default) for name, default in DEFAULTS.items()}
    _check_same(folder, {"form": form, **settings}, make_scene)
    present = _present(folder)
    missing = [index for index in range(first, count, step) if index not in present]
    writer = WRITERS[form](folder)
    failures = _add(folder, writer, make_scene, missing, options)
    if _present(folder) >= set(range(count)):  # others may have finished pictures meanwhile
        writer.finish(_records(folder, count))
    return Report(len(missing) - len(failures), len(present), failures)


def _add(
    folder: Path, writer: Writer, make_scene: MakeScene, indices: list[int], options: PictureOptions
) -> dict[int, str]:
    """Render and write pictures; return the errors by their numbers."""
    failures: dict[int, str] = {}

    def failed(index: int, error: Exception) -> None:
        failures[index] = _tell(folder, index, error)

    for picture in pictures(make_scene, indices, on_failure=failed, **options):
        try:
            _write(folder, writer, picture)
        except ClptError as error:  # a picture that the form cannot hold
            failed(picture.index, error)
    return failures


def _write(folder: Path, writer: Writer, picture: Picture) -> None:
    """Write a picture, and last its record."""
    record = writer.write(picture)
    record["seconds"] = round(picture.seconds, 4)
    text = json.dumps({"index": picture.index, **record})
    output_files.write_text(folder / "records" / f"{picture.index:06d}.json", text + "\n")
    (folder / "failures" / f"{picture.index:06d}.txt").unlink(missing_ok=True)


def _tell(folder: Path, index: int, error: Exception) -> str:
    """Keep a picture's error in a file, and log its line."""
    line = f"{type(error).__name__}: {error}" if not isinstance(error, ClptError) else str(error)
    log.warning("picture %d failed: %s", index, line)
    (folder / "failures").mkdir(exist_ok=True)
    text = "".join(traceback.format_exception(error))
    output_files.write_text(folder / "failures" / f"{index:06d}.txt", text)
    return line


def _present(folder: Path) -> set[int]:
    """Return the numbers of the pictures that are finished."""
    return {int(path.stem) for path in (folder / "records").glob("*.json")}


def _records(folder: Path, count: int) -> Iterator[dict[str, Any]]:
    for index in range(count):
        yield json.loads((folder / "records" / f"{index:06d}.json").read_text("utf-8"))


def _check_same(folder: Path, settings: dict[str, Any], make_scene: MakeScene) -> None:
    """Write the settings of a dataset, or raise SceneError where others were written."""
    path = folder / "dataset.json"
    try:
        scene = make_scene(0, np.random.default_rng([settings["seed"], 0]))
        settings = {**settings, "first_scene": str(fingerprint(scene))}
    except Exception:  # picture 0 fails: its error is told with it
        settings = {**settings, "first_scene": None}
    if not path.exists():
        output_files.write_text(path, json.dumps(settings, indent=1) + "\n")
        return
    former = json.loads(path.read_text("utf-8"))
    for name, value in settings.items():
        if former.get(name) != value:
            was = f"{former.get(name)!r}, not {value!r}"
            if name == "first_scene":
                was = "of another make_scene: its first scene differs"
            raise SceneError(f"holds a dataset of {name} {was}; take another folder", file=folder)
