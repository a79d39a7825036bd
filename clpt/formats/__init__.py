"""Scene files: `load` reads a Scene from a file of any format, `save` writes it as scene.json."""

from __future__ import annotations

import difflib
import gc
import importlib
import itertools
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

from clpt.choices import Missing
from clpt.errors import LONGEST_WARNING, SceneError, nearest, one_line
from clpt.files import budget as budgets
from clpt.files.budget import Budget
from clpt.formats import own_scenes

if TYPE_CHECKING:  # a name of a file is looked up without the kinds of scenes
    from clpt.formats.reading import Progress
    from clpt.scene import Scene
    from clpt.scene.materials import Material

FORMATS = {  # what reads files of a suffix: a module, imported on use, or a part of framing.py
    ".json": "native",
    ".xml": "mitsuba",
    ".pbrt": "pbrt",
    ".pbrt.gz": "pbrt",
    ".glb": "gltf",
    ".gltf": "gltf",
    ".mtlx": "materialx",
    ".usd": "usd",
    ".usda": "usd",
    ".usdc": "usd",
    ".usdz": "usd",
    ".obj": "mesh",
    ".ply": "mesh",
    ".stl": "mesh",
    ".off": "mesh",
    ".vdb": "density",
    ".nvdb": "density",
    ".vol": "density",
}
WITH_VARIABLES = ("mitsuba", "gltf", "usd")

# The scene of a folder: the first of these, else the scene with the folder's name, else the only.
IN_FOLDERS = ("scene.json", "scene.xml", "scene.pbrt", "scene-v4.pbrt")
SCENES = tuple(suffix for suffix, kind in FORMATS.items() if kind in (*WITH_VARIABLES, "pbrt"))
MOST_COMPARED, CLOSE = 4096, 0.7  # names of a folder; least similarity of a suggested name
MOST_NAMED = 8  # scenes of a folder that a message names
# Arguments of `load` that are no variables.
ARGUMENTS = ("kinds", "progress", "missing_textures", "strict", "budget")

__all__ = ["FORMATS", "load", "load_dict", "locate", "save"]


def load(
    path: str | Path,
    /,
    *,
    kinds: Iterable[type[Material]] = (),
    progress: Progress | None = None,
    missing_textures: Missing = "error",
    strict: bool = False,
    budget: Budget | None = None,
    **variables: Any,
) -> Scene:
    """Read a scene, a bare mesh or a bare density; a folder means the scene in it (see IN_FOLDERS).

    `path` is that of the file. A scene.json may name `kinds`, materials that are not clpt's own.
    `variables` set the `$names` of Mitsuba's XML; docs/gltf.md and docs/usd.md have theirs; of all
    three `camera` is a camera's number or name. `progress` is called with the share that is read,
    from 0 to 1, and a text, for files of many shapes. `missing_textures`: "grey" replaces missing
    images, and unknown materials of Mitsuba and PBRT, by grey; it leaves out unknown shapes and
    lights. Each has a warning. `strict`: the first warning is an error. `budget`: memory and time
    that the load may take; a file that asks for more is refused. Raises SceneError with the file
    and, where it is known, the line.
    """
    path = locate(path)
    try:
        with budgets.opened(budget) as account, _uncollected():
            scene = _load(path, kinds, progress, missing_textures, variables)
        scene.account = account
        scene.warnings[:] = [one_line(text, LONGEST_WARNING) for text in scene.warnings]
        if strict and scene.warnings:
            others = len(scene.warnings) - 1
            more = f"; warnings after it: {others}" if others else ""
            raise SceneError(f"strict: {scene.warnings[0]}{more}", file=path)
        return scene
    except RecursionError:
        raise SceneError("what it holds is nested too deeply", file=path) from None
    except MemoryError:
        raise SceneError("reading it takes more memory than there is", file=path) from None


@contextmanager
def _uncollected() -> Iterator[None]:
    """Keep Python from looking for circles of dead objects: a load makes many, and none dies."""
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


def prepare(path: str | Path, /) -> None:
    """Import the library that reads a file's format, before other threads use native code.

    OpenUSD takes Python's lock while the linker loads it. A thread that holds that lock, and asks
    the linker for a symbol as OpenCL's drivers do, would wait for ever. A library that is missing
    is an error of `load`.
    """
    if FORMATS.get(Path(path).suffix.lower()) == "usd":
        with suppress(ImportError):
            importlib.import_module("clpt.formats.usd.scenes")


def _load(
    path: Path,
    kinds: Iterable[type[Material]],
    progress: Progress | None,
    missing_textures: Missing,
    variables: dict[str, Any],
) -> Scene:
    name = path.name.lower()
    kind = next((kind for suffix, kind in FORMATS.items() if name.endswith(suffix)), None)
    if kind is None:
        known = " ".join(FORMATS)
        raise SceneError(f"unknown format {path.suffix!r}; known: {known}", file=path)
    if "camera" in variables and kind not in WITH_VARIABLES:
        message = "only .xml, glTF and USD have cameras to choose from, no "
        message += f"{variables['camera']!r}; "
        message += "--camera AZIMUTH,ELEVATION such as 45,20 looks at all of a scene"
        raise SceneError(message, file=path)
    if variables and kind not in WITH_VARIABLES:
        name = min(variables)
        message = f"only .xml, glTF and USD have variables, so {name!r} means nothing"
        near = difflib.get_close_matches(name, ARGUMENTS)
        raise SceneError(message + (nearest(name, ARGUMENTS) if near else ""), file=path)
    if kinds and kind != "native":
        raise SceneError("only a scene.json can have kinds that are not clpt's own", file=path)
    if missing_textures not in get_args(Missing):
        raise SceneError(f"missing_textures is 'error' or 'grey', not {missing_textures!r}")
    if kind in ("mesh", "density"):
        from clpt.formats import framing

        if kind == "mesh":
            return framing.load_mesh(path, missing_textures)
        return framing.load_density(path)
    loader = importlib.import_module(f"clpt.formats.{kind}").load
    if kind == "native":
        return loader(path, kinds, missing_textures)
    if kind == "pbrt":
        return loader(path, progress, missing_textures)
    return loader(path, missing_textures, **variables)


def errors_of(path: str | Path, /, **variables: Any) -> list[SceneError]:
    """Return the distinct errors of a file, in the order of reading.

    path: a scene of any format; of Mitsuba's and PBRT's, each material, texture, shape, light and
    parameter can add an error. variables: see `load`.
    """
    from clpt.formats.reading import collecting  # which imports numpy

    with collecting() as errors:
        try:
            load(path, **variables)
        except SceneError as error:
            errors.append(error)
    return list({str(error): error for error in errors}.values())


def load_dict(
    scene: Mapping[str, Any],
    /,
    *,
    folder: str | Path = "",
    missing_textures: Missing = "error",
    budget: Budget | None = None,
) -> Scene:
    """Make a scene of a dictionary as Mitsuba 3's `load_dict` takes it.

    Its values are numbers, texts, sequences of three numbers, transforms (any object with a
    `matrix` (4, 4), such as clpt.ScalarTransform4f), arrays of images (h, w) or (h, w, c) and of
    volumes (z, y, x) or (z, y, x, c), and dictionaries with a `type`. Relative file names are in
    `folder`, by default the current folder. `missing_textures` and `budget` are those of `load`.
    Raises SceneError with the name of the entry.
    """
    loader = importlib.import_module("clpt.formats.mitsuba").load_dict
    with budgets.opened(budget):
        built: Scene = loader(scene, Path(folder), missing_textures)
    built.warnings[:] = [one_line(text, LONGEST_WARNING) for text in built.warnings]
    return built


def save(scene: Scene, path: str | Path, /) -> list[str]:
    """Write a scene; return what the format cannot say, a sentence each.

    path: of a new .json, such that `load` gives the same content back, or of a folder that gets a
    scene.json; or of a .usda, .usdc, .usd or .usdz, with materials as OpenPBR and colors in place
    of spectra (docs/usd.md); or of a .glb or .gltf (docs/gltf.md). An existing file is replaced.

    The arrays of shapes and images lie in files beside a .json, which begin with its name: meshes
    as .ply, curves as .txt, spheres as .npz, images as .npy, .png or .exr, transforms of many
    instances as .npy. An image that the scene has by its path is named, not copied. Colours of
    meshes keep their float32. `warnings` and `extra` are not written.

    Raises TypeError for anything but a scene; SceneError for another suffix, for a buffer on a
    device, and where a file cannot be written.
    """
    from clpt.scene import Scene

    path = Path(path)
    if not isinstance(scene, Scene):
        raise TypeError(f"clpt.save writes a clpt.Scene, not {type(scene).__name__}")
    if path.is_dir():
        path = path / IN_FOLDERS[0]
    kind = FORMATS.get(path.suffix.lower())
    if kind == "native":
        importlib.import_module("clpt.formats.native").save(scene, path)
        return []
    if kind in ("usd", "gltf"):
        lost: list[str] = importlib.import_module(f"clpt.formats.{kind}").save(scene, path)
        return lost
    message = f"a scene is saved as .json, .glb, .gltf, .usda, .usdc or .usdz, not {path.suffix!r}"
    raise SceneError(message, file=path)


def locate(path: str | Path, /) -> Path:
    """Return the file that `load` reads: of a folder the scene in it. Raises SceneError.

    A missing relative path that begins with `scenes` names a scene that comes with clpt.
    """
    path = Path(path)
    try:
        if path.is_dir():
            return _inside(path)
        if path.is_file():
            return path
        bundled = brought(path)
        if bundled != path:
            return locate(bundled)
    except SceneError:
        raise
    except (OSError, ValueError) as error:
        raise SceneError(f"cannot be read: {error}", file=path) from None
    raise SceneError(f"there is no such file{_nearest_file(path)}", file=path)


def brought(path: str | os.PathLike[str], /) -> Path:
    """Return the path; if it is missing and begins with `scenes`, the path of clpt's own scene."""
    path = Path(path)
    bundled = own_scenes.scenes_folder().parent / path
    is_bundled = (
        path.parts[:1] == ("scenes",) and ".." not in path.parts and os.path.exists(bundled)
    )
    return bundled if is_bundled and not os.path.exists(path) else path


def _nearest_file(path: Path) -> str:
    """Return the end of a message: scenes and folders of nearly the same name, if there are any.

    If a folder of the path is missing, the names are those near the first missing folder.
    """
    whole = path
    while not path.parent.is_dir() and path.parent != path:
        path = path.parent
    try:
        names = [
            entry.name
            for entry in itertools.islice(path.parent.iterdir(), MOST_COMPARED)
            if entry.is_dir() or entry.name.lower().endswith(tuple(FORMATS))
        ]
    except OSError:
        names = []
    return _meant([str(path.parent / name) for name in _near(path.name, names)], whole)


def _near(name: str, names: list[str]) -> list[str]:
    return difflib.get_close_matches(name, names, n=2, cutoff=CLOSE)


def _meant(here: list[str], path: Path) -> str:
    """Return the end of a message: paths that are `here`, else those of clpt's own scenes."""
    meant = here or own_scenes.nearest_paths(path)
    if meant:
        return f"; did you mean {' or '.join(meant)}?"
    of_own = path.parts[:1] == (own_scenes.SCENES,)
    return "; clpt scenes lists those that come with clpt" if of_own else ""


def _inside(folder: Path) -> Path:
    """Return the scene of a folder, see IN_FOLDERS."""
    scenes = sorted(file for file in folder.iterdir() if file.name.lower().endswith(SCENES))
    same_name = [file for file in scenes if file.name.split(".")[0] == folder.resolve().name]
    named = [folder / name for name in IN_FOLDERS if (folder / name).is_file()]
    for files in (named[:1], same_name, scenes):
        if len(files) == 1:
            return files[0]
    if not scenes:
        message = f"this folder holds no scene.json and no {' '.join(SCENES)}"
        if folder.resolve() == own_scenes.scenes_folder().resolve():
            message = "name one of the scenes in this folder, which clpt scenes lists"
        raise SceneError(message, file=folder)
    names = ", ".join(file.name for file in scenes[:MOST_NAMED])
    more = f" and {len(scenes) - MOST_NAMED} more" if len(scenes) > MOST_NAMED else ""
    raise SceneError(f"this folder holds several scenes, name one: {names}{more}", file=folder)
