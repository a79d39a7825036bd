"""No message ends the viewer, and none opens a file or tells of one."""

from __future__ import annotations

import contextlib
import ctypes
import dataclasses
import json
import os
import subprocess
import sys
import textwrap
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clpt import device
from clpt.errors import LONGEST, ClptError, KernelBuildError, MemoryBudgetError, SceneError
from clpt.scene import KINDS, cameras
from clpt.scene.params import params
from clpt.view import panels, saving
from clpt.view.messages import COMMANDS, CommandError, error_message, parse
from clpt.view.saving import Folder
from clpt.view.session import Session
from tests.view.test_commands import message
from tests.view.test_page import of_all_kinds
from tests.view.test_session import Audience, ask, small

SECRET = "hunter2-is-the-passw0rd"
SUFFIXES = (
    ".txt", ".dat", ".zmx", ".yml", ".csv", ".spd", ".bfc", ".npy", ".npz", ".vdb", ".nvdb", ".vol",
    ".png", ".exr", ".hdr", ".bsdf", ".binary", ".ply", ".json",
)  # fmt: skip


@pytest.fixture(scope="module")
def on() -> device.Device:
    return device.choose()


@pytest.fixture
def audience() -> Audience:
    return Audience()


@pytest.fixture
def session(on: device.Device, audience: Audience) -> Iterator[Session]:
    made = Session(small(), on, audience)
    made.watched(1)
    made.start()
    yield made
    made.close()
    assert made.error is None


# files

opened: list[str] = []  # by anything in this process, as Python tells it
_hears = False


def _hear(event: str, arguments: tuple[Any, ...]) -> None:
    if _hears and event == "open":
        opened.append(str(arguments[0]))


sys.addaudithook(_hear)  # for ever: there is no way to take it back


@contextlib.contextmanager
def nothing_opens(paths: list[Path]) -> Iterator[None]:
    """Assert that none of these files is opened, by Python or by a library."""
    global _hears
    opened.clear()
    watch = _Inotify(paths) if sys.platform == "linux" else None
    _hears = True
    try:
        yield
    finally:
        _hears = False
    names = {path.name for path in paths}
    assert not [one for one in opened if os.path.basename(one) in names]
    assert watch is None or watch.events() == b""


class _Inotify:
    """What the kernel tells of files that are opened or read."""

    IN_ACCESS, IN_OPEN = 1, 32

    def __init__(self, paths: list[Path]):
        libc = ctypes.CDLL(None, use_errno=True)
        self.handle = libc.inotify_init1(os.O_NONBLOCK)
        assert self.handle >= 0
        for path in paths:
            kinds = self.IN_ACCESS | self.IN_OPEN
            assert libc.inotify_add_watch(self.handle, os.fsencode(path), kinds) >= 0

    def events(self) -> bytes:
        """Return what was told, and listen no more."""
        try:
            return os.read(self.handle, 65536)
        except BlockingIOError:
            return b""
        finally:
            os.close(self.handle)


def secrets(folder: Path) -> list[Path]:
    """Make files that hold a secret, with all suffixes that clpt reads."""
    paths = [folder / f"secret{suffix}" for suffix in SUFFIXES]
    for path in paths:
        path.write_text(f"{SECRET}\n400 0.5\n{SECRET}\n")
    return paths


def namings(path: str) -> list[Any]:
    """Ways in which scene files name a file."""
    named: list[Any] = [path, [path], [path] * 3, [path] * 6, {"curves": [{"file": path}] * 3}]
    named += [
        {key: path}
        for key in ("file", "image", "lens", "type", "name", "volume", "filename", "points")
    ]
    named += [
        {"type": "bitmap", "image": path}, {"type": "tabulated", "file": path},
        {"type": "illuminant", "name": path}, {"values": path}, {"file": path, "matrix": None},
        {"type": "fluorophore", "absorption": {"file": path}, "emission": 1.0},
        {"surfaces": [{"semi_diameter": 1.0, "glass": {"file": path}}]},
        [{"time": 0, "transform": {"file": path}}], {"type": "merl", "merl": path},
    ]  # fmt: skip
    return named


def refusal(ask: Callable[[], Any]) -> str | None:
    """What is told of an error, None if there is none; never anything but a plain one."""
    try:
        ask()
    except ClptError as error:
        return error_message(error)["text"]
    return None


def test_hear_and_inotify_notice(tmp_path: Path) -> None:
    """The instruments of this module tell of a file that is opened."""
    (path, *_) = secrets(tmp_path)
    for read in (path.read_text, lambda: os.close(os.open(path, os.O_RDONLY))):
        with pytest.raises(AssertionError), nothing_opens([path]):
            read()  # type: ignore[operator]


@pytest.mark.parametrize(
    ("relative", "deeper"), [(True, 0), (False, 0), *((False, length) for length in (7, 65, 123))]
)
def test_no_parameter_of_a_scene_names_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, relative: bool, deeper: int
) -> None:
    """Every parameter of every kind that a page may edit, and those that it may not.

    What is told is the same where there is such a file and where there is none. Messages are cut,
    so the folders have names of several lengths.
    """
    tmp_path = tmp_path / ("d" * deeper)
    tmp_path.mkdir(exist_ok=True)
    (tmp_path / "present").mkdir()
    (tmp_path / "missing").mkdir()
    paths = secrets(tmp_path / "present")
    scene = of_all_kinds()
    scene = dataclasses.replace(
        scene, shapes=[*scene.shapes, *small().shapes], camera=cameras.ThinLens()
    )
    places = [
        (target, index, key)
        for target, things in panels._targets(scene).items()
        for index, (thing, _) in enumerate(things)
        for key in params(type(thing))
    ]
    assert len(places) > 250

    def told(folder: str) -> list[str | None]:
        monkeypatch.chdir(tmp_path / folder)
        found = []
        for number, (target, index, key) in enumerate(places):
            name = paths[number % len(paths)].name
            path = name if relative else str(tmp_path / folder / name)
            for value in namings(path):
                edit = (target, index, key, value)
                found.append(refusal(lambda edit=edit: panels.edited(scene, *edit)))  # type: ignore[misc]
        return found

    with nothing_opens(paths):
        present = told("present")
    assert present == told("missing")
    named = [place for place in zip(present, range(len(present)), strict=True) if place[0] is None]
    assert not named  # nothing that holds a path is a value
    assert not any(SECRET in text or str(tmp_path) in text for text in present if text)


def test_no_view_names_a_file(tmp_path: Path) -> None:
    """Every parameter of every camera, and keys that no camera has."""
    paths = secrets(tmp_path)
    told = []
    with nothing_opens(paths):
        for cls in KINDS["camera"]:
            for key in (*params(cls), "file", "type"):
                for path in paths:
                    for value in namings(str(path)):
                        camera = {"type": cls.kind, key: value}
                        told.append(refusal(lambda camera=camera: saving.camera_of(camera)))  # type: ignore[misc]
    assert len(told) > 5000 and None not in told
    assert not any(SECRET in text or str(tmp_path) in text for text in told if text)


def test_no_command_names_a_file(session: Session, audience: Audience, tmp_path: Path) -> None:
    """Every parameter of every command, as a page sends it; and all that is answered."""
    paths = secrets(tmp_path)
    audience.rest()
    posted = 0
    with nothing_opens(paths):
        for number, (name, command) in enumerate(COMMANDS.items()):
            for key in command.parameters:
                for value in namings(str(paths[number % len(paths)])):
                    try:
                        request = parse(message(name, **{key: value}))
                    except CommandError as error:
                        audience.message(error_message(error))
                        continue
                    session.post(request, audience.message)
                    posted += 1
        for value in namings(str(paths[0])):
            for kind in ("lens", "perspective"):
                camera = {"type": kind, "lens": value, "medium": value}
                ask(session, audience, "open_view", camera=camera, exposure=0.0, tone="none")
            ask(session, audience, "edit", target="film", index=0, key="sensor", value=value)
        ask(session, audience, "statistics")
        audience.answer("statistics")
    assert posted > 10
    said = json.dumps([audience.messages, session.state(), [one for one, _ in audience.frames]])
    assert SECRET not in said and str(tmp_path) not in said


def test_no_answer_tells_of_a_folder(on: device.Device, audience: Audience, tmp_path: Path) -> None:
    """Of the folder for what is saved, of the scene's file, and of those that errors name."""
    folder = tmp_path / "where it lies"
    folder.mkdir()

    def write_exr(path: Path, *_: Any) -> None:
        raise PermissionError(13, "Permission denied", str(path))

    session = Session(small(), on, audience, folder=Folder(folder, "a", write_exr))
    session.watched(1)
    session.start()
    try:
        audience.rest()
        assert str(tmp_path) not in json.dumps(session.state())
        ask(session, audience, "save", what="exr")
        assert audience.answer("error")["text"] == "Permission denied"
        assert list(folder.iterdir()) == []
        folder.rmdir()
        for what in ("png", "scene", "view", "exr"):
            ask(session, audience, "save", what=what)
            assert audience.answer("error")["text"] == "No such file or directory"
    finally:
        session.close()


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (SceneError("is odd", file="/home/me/a b/s.json", line=3, where="shapes[0]"),
         "s.json: line 3: shapes[0]: is odd"),
        (SceneError("there is no file '/home/my own/wood.png'"), "there is no file 'wood.png'"),
        (ClptError("cannot read /var/lib/x.csv, C:\\Users\\me\\y.csv"), "cannot read x.csv, y.csv"),
        (SceneError(f"{'x' * 300} '/home/me/{'y' * 180}/z.png'"),
         f"{'x' * 195} ... {'x' * 92} 'z.png'"),
        (ClptError(f"no '/home/{'y' * 90} ... {'y' * 90}/z.png'"), "no 'z.png'"),
        (ClptError("12 rays/s at 3 W/m^2"), "12 rays/s at 3 W/m^2"),
        (OSError(28, "No space left on device", "/home/me/x"), "No space left on device"),
        (KernelBuildError("path", "/a/b.cl", 3, "error: x", "/home/me/.cache/x"),
         "the kernel program 'path' did not build"),
        (MemoryError(), "there is not enough memory"),
        (MemoryBudgetError("it", 2**30, 2**20, "less"),
         "it needs 1024 MiB, the device has 1 MiB: less"),
        (KeyError("/etc/passwd"), "a fault of clpt (KeyError)"),
        (RecursionError(), "a fault of clpt (RecursionError)"),
        (CommandError("a\nb\x1b[2J\u202ec"), "a b [2J c"),
    ],
)  # fmt: skip
def test_errors_are_a_line_without_folders(error: Exception, told: str) -> None:
    assert error_message(error) == {"type": "error", "text": told}
    long = error_message(ClptError("x\n" * 10_000))["text"]
    assert len(long) <= LONGEST and "\n" not in long


# faults

FAULTS = [
    AttributeError("x"), RuntimeError("two\nlines"), MemoryError(), RecursionError(),
    ValueError("x" * 100_000), OSError(5, "Input/output error", "/home/me/x"), AssertionError(),
    KeyError("k"), StopIteration(), np.linalg.LinAlgError("singular"), CommandError("no"),
]  # fmt: skip


def test_a_medium_of_a_view_ends_nothing(session: Session, audience: Audience) -> None:
    camera = session.scene.camera
    for value in ("x", {"type": "homogeneous"}, None, 3, []):
        given = {"type": "perspective", "medium": value}
        ask(session, audience, "open_view", camera=given, exposure=0, tone="none")
        assert audience.answer("error")["text"].endswith("has no 'medium'")
    audience.rest()
    assert session.scene.camera is camera


def test_any_fault_is_an_answer(
    session: Session, audience: Audience, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever is raised while a command is done: one line, and the next command is done."""
    audience.rest()
    for fault in FAULTS:

        def broken(*_: Any, fault: Exception = fault, **__: Any) -> None:
            raise fault

        monkeypatch.setattr(session, "_do_restart", broken)
        ask(session, audience, "restart")
        text = audience.answer("error")["text"]
        assert len(text) <= LONGEST and len(text.splitlines()) == 1 and "/" not in text[:5]
        monkeypatch.undo()
    ask(session, audience, "orbit", dx=0.1, dy=0.0)
    audience.rest()


def test_a_command_that_fails_halfway_changes_nothing(
    session: Session, audience: Audience, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, before = audience.rest()
    ask(session, audience, "pick", x=16, y=12)  # no other pivot comes by itself
    audience.answer("pivot")
    ask(session, audience, "pause", paused=False)
    audience.answer("state")
    scene, look, pivot = session.scene, session.look, session._pivot.copy()

    def broken(*_: Any) -> None:
        raise RuntimeError

    for method, name, values in (
        (
            "_set_pivot",
            "open_view",
            {"camera": {"type": "spherical"}, "exposure": 3, "tone": "aces"},
        ),
        ("_set_pivot", "home", {}),
        ("_begin", "lamp", {"name": "A"}),
        ("_tell_state", "region", {"x": 1, "y": 1, "width": 3, "height": 3}),
    ):
        undoes = method == "_begin"
        failing = _once_broken(session._begin) if undoes else broken
        monkeypatch.setattr(session, method, failing)
        ask(session, audience, name, **values)
        audience.answer("error")
        monkeypatch.undo()
        assert (session.scene, session.look) == (scene, look)
        assert np.array_equal(session._pivot, pivot)
    assert session.state()["display"] == {"exposure": 0.0, "tone": "none"}
    ask(session, audience, "restart")
    assert np.array_equal(audience.rest()[1], before)


def _once_broken(works: Callable[..., None]) -> Callable[..., None]:
    calls = []

    def function(*arguments: Any) -> None:
        calls.append(arguments)
        if len(calls) == 1:
            raise RuntimeError
        works(*arguments)

    return function


def test_a_fault_while_it_renders_ends_nothing(
    session: Session, audience: Audience, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The last scene that could be rendered is shown; if that cannot either, the render rests."""
    _, before = audience.rest()
    works = session._loop.advance
    camera = session.scene.camera

    def broken() -> bool:
        if session.scene.camera is not camera:
            raise RuntimeError("the device does not like it")
        return works()

    monkeypatch.setattr(session._loop, "advance", broken)
    ask(session, audience, "orbit", dx=0.1, dy=0.0)
    assert "RuntimeError" in audience.answer("error")["text"]
    assert np.array_equal(audience.rest()[1], before) and session.scene.camera is camera

    def gone() -> bool:
        raise MemoryError

    monkeypatch.setattr(session._loop, "advance", gone)
    ask(session, audience, "orbit", dx=0.1, dy=0.0)
    audience.answer("error", text="there is not enough memory")
    audience.answer("error", text="there is not enough memory")
    audience.wait(lambda: session._rests)
    monkeypatch.undo()
    ask(session, audience, "restart")
    assert np.array_equal(audience.rest()[1], before)


def test_a_camera_cannot_leave_the_numbers(session: Session, audience: Audience) -> None:
    """It goes away by e^5 at each step; at last that is refused, and it comes back."""
    _, before = audience.rest()
    for _ in range(60):
        ask(session, audience, "dolly", by=-5.0)
        ask(session, audience, "fly", right=20.0, up=20.0, forward=-20.0)
    assert "too far away" in audience.answer("error")["text"]
    ask(session, audience, "home")
    audience.answer("state")
    ask(session, audience, "restart")
    assert np.array_equal(audience.rest()[1], before)


def test_a_view_keeps_what_it_does_not_hold(session: Session, audience: Audience) -> None:
    """A lens, a medium and a motion cannot be given by a page; they stay."""
    lens = cameras.Lens(lens="tessar" if "tessar" in _lenses() else _lenses()[0])
    written = panels.written(lens)
    assert "lens" not in written
    again = saving.camera_of(written, lens)
    assert isinstance(again, cameras.Lens) and again.lens == lens.lens
    assert saving.camera_of({"type": "spherical"}, lens).kind == "spherical"


def _lenses() -> tuple[str, ...]:
    from clpt import lenses

    return tuple(lenses.names())


# saving

SAVES = """
    import sys
    from pathlib import Path
    import numpy as np
    from clpt.scene import Scene
    from clpt.scene.cameras import Perspective
    from clpt.view.saving import Folder
    folder = Folder(Path(sys.argv[1]), "a", None)
    sys.stdin.readline()  # until the other one is ready too
    colour = int(sys.argv[2])
    for i in range(25):
        folder.save_png(np.full((32, 32, 3), 50 * colour + i, np.uint8))
        folder.save_view({"of": colour, "number": i})
        folder.save_scene(Scene(camera=Perspective(), name=f"{colour} {i}"))
"""


def test_two_viewers_in_one_folder_lose_nothing(tmp_path: Path) -> None:
    """Two processes save 25 times each, of each sort: 50 files, each whole and another one."""
    both = [
        subprocess.Popen(
            [sys.executable, "-c", textwrap.dedent(SAVES), str(tmp_path), str(colour)],
            stdin=subprocess.PIPE,
        )
        for colour in (1, 2)
    ]
    for process in both:
        assert process.stdin is not None
        process.stdin.write(b"\n")
        process.stdin.close()
    assert [process.wait(120) for process in both] == [0, 0]
    for names in ("a-*.png", "a-*.view.json", "a-*/scene.json"):
        files = list(tmp_path.glob(names))
        assert len(files) == 50 and len({path.read_bytes() for path in files}) == 50
    assert not list(tmp_path.glob(".clpt*"))


def folder_of(path: Path) -> Folder:
    def write_exr(path: Path, renderer: Any, seconds: float) -> None:
        path.write_bytes(b"exr")

    return Folder(path, "a", write_exr)


@pytest.mark.skipif(not hasattr(os, "O_NOFOLLOW"), reason="this system has no links")
def test_no_link_is_followed(tmp_path: Path) -> None:
    """One to nowhere, to a file, to a folder, and one that comes while the file is written."""
    inside, outside = tmp_path / "inside", tmp_path / "outside"
    inside.mkdir(), outside.mkdir()
    kept = outside / "kept"
    kept.write_text("mine")
    for number, target in enumerate((outside / "new", kept, outside), 1):
        for suffix in (".png", ".exr", ".view.json", ""):
            (inside / f"a-{number:03d}{suffix}").symlink_to(target)
    folder = folder_of(inside)
    pixels = np.zeros((2, 2, 3), np.uint8)
    assert folder.save_png(pixels).name == "a-004.png"
    assert folder.save_exr(None, 0.0).name == "a-004.exr"  # type: ignore[arg-type]
    assert folder.save_view({}).name == "a-004.view.json"
    assert folder.save_scene(small()).parent.name == "a-004"

    def swap(path: Path, renderer: Any, seconds: float) -> None:
        path.write_bytes(b"exr")
        (inside / "a-005.exr").unlink()
        (inside / "a-005.exr").symlink_to(kept)

    folder.write_exr = swap
    path = folder.save_exr(None, 0.0)  # type: ignore[arg-type]
    assert path.read_bytes() == b"exr" and not path.is_symlink()
    assert kept.read_text() == "mine" and sorted(outside.iterdir()) == [kept]


def test_what_cannot_be_written_leaves_nothing(tmp_path: Path) -> None:
    folder = folder_of(tmp_path)

    def full(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    folder.write_exr = full
    with pytest.raises(OSError, match="No space"):
        folder.save_exr(None, 0.0)  # type: ignore[arg-type]
    with pytest.raises(TypeError):
        folder.save_view({"x": object()})
    assert list(tmp_path.iterdir()) == []
