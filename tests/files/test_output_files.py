"""Files are replaced whole: an error, a full disk or a killed process leaves the old one."""

from __future__ import annotations

import ast
import contextlib
import errno
import json
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType
from typing import Any

import pytest

from clpt.errors import SceneError
from clpt.files import output_files
from tests.writers import WRITERS

ROOT = Path(__file__).resolve().parents[2]
posix = pytest.mark.skipif(os.name != "posix", reason="signals and limits of POSIX")
OLD = b"yesterday's"
EACH = pytest.mark.parametrize("kind", WRITERS)

# In a process of its own: every kind of file, while something is wrong.
CHILD = """
import json, os, signal, sys
from pathlib import Path
from clpt.files import output_files
from clpt.errors import SceneError
from tests.files.test_output_files import OLD, outcome
from tests.writers import WRITERS, frames
root, event = Path(sys.argv[1]), sys.argv[2]
if event == "full":  # a small disk, on which the ballast leaves some pages
    os.system(f"mount -t tmpfs -o size=1m clpt-test {root}") and sys.exit("no mount")
for kind in WRITERS:
    folder = root / kind.replace(" ", "_")
    folder.mkdir(exist_ok=True)
    (folder / WRITERS[kind][0]).write_bytes(OLD)
told = {}
frames()
if event == "user":  # to whom nothing belongs
    for kind in WRITERS:
        outcome(root / "warm", kind)  # what it imports
    os.setgid(65534)
    os.setuid(65534)
for kind in WRITERS:
    folder = root / kind.replace(" ", "_")
    if event == "kill":
        child = os.fork()
        if child == 0:
            output_files.os.fsync = lambda handle: os.kill(os.getpid(), signal.SIGKILL)
            outcome(folder, kind)
            os._exit(0)
        assert os.waitpid(child, 0)[1] == signal.SIGKILL, kind
        told[kind] = [sum(one.name.startswith(output_files.PARTIAL) for one in folder.iterdir())]
        told[kind] += [(folder / WRITERS[kind][0]).read_bytes() == OLD, outcome(folder, kind)]
    elif event == "user":
        told[kind] = outcome(folder, kind)
    else:
        new = outcome(folder, kind) and (folder / WRITERS[kind][0]).read_bytes()
        for pages in (0, 1, 2, 3, 4, 6, 8, 12, 16):
            (folder / WRITERS[kind][0]).write_bytes(OLD)
            free = os.statvfs(root).f_bavail
            with open(root / "ballast", "wb") as ballast:
                ballast.write(bytes(4096 * (free - pages)))
            try:
                done = outcome(folder, kind)
            finally:
                os.unlink(root / "ballast")
            assert (folder / WRITERS[kind][0]).read_bytes() == (new if done == "new" else OLD), kind
            told.setdefault(kind, []).append(done)
    assert not list(folder.glob(".clpt-partial*")), kind
print(json.dumps(told))
"""


def outcome(folder: Path, kind: str) -> str:
    """Write a kind of file into a folder: "new", or what the error says."""
    folder.mkdir(exist_ok=True)
    name, write = WRITERS[kind]
    try:
        write(folder / name)
    except (SceneError, OSError) as error:
        return f"{type(error).__name__}: {error}"
    return "new"


def in_a_child(folder: Path, event: str, *before: str) -> dict[str, Any]:
    command = [*before, sys.executable, "-c", CHILD, str(folder), event]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300)
    if "no mount" in done.stderr or "unshare" in done.stderr:
        pytest.skip("no file system can be mounted here")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


WRITES = {
    "write_text", "write_bytes", "savefig", "save", "savez", "savez_compressed", "savetxt",
    "tofile", "touch", "copy", "copy2", "copyfile", "copyfileobj", "imwrite", "mkstemp",
}  # fmt: skip
MODULES = {"np", "shutil", "os", "tempfile"}  # whose functions of these names write
ELSEWHERE = {
    ("bench/apart.py", "fdopen"),  # to a pipe
    ("cli/files/targets.py", "copyfileobj"),  # to the standard output
    ("cluster/bundle.py", "copyfile"),  # into a folder of its own, in the place of a link
    ("cluster/processes.py", "mkstemp"),  # which nobody else may read, not even in part
    ("cluster/processes.py", "open"),
    ("device/compiler_process.py", "fdopen"),  # to a pipe
    ("files/disk_cache.py", "open"),  # of locks, which are empty
    ("formats/usd/document.py", "write_bytes"),  # into a folder of its own
    ("images/exr_files.py", "write"),  # of films, in their `replacing`
    ("render/materials/rough_coat_table.py", "savez_compressed"),  # its table, made by maintainers
    ("view/saving.py", "write_bytes"),  # of new files, in their `replacing`
    ("view/saving.py", "write_text"),
}
OF_NUMPY = {"save", "savez", "savez_compressed", "savetxt", "copy", "copy2"}


def writing_calls(tree: ast.AST) -> Iterator[tuple[str, int]]:
    """The names and lines of calls that write a file outside of `with ... replacing(...)`."""
    inside = {
        id(call)
        for block in ast.walk(tree)
        if isinstance(block, ast.With)
        and any("replacing(" in ast.unparse(item.context_expr) for item in block.items)
        for call in ast.walk(block)
    }
    buffers = {
        ast.unparse(step.targets[0])
        for step in ast.walk(tree)
        if isinstance(step, ast.Assign) and "BytesIO(" in ast.unparse(step.value)
    }
    for call in ast.walk(tree):
        if not isinstance(call, ast.Call) or id(call) in inside:
            continue
        given = [*call.args, *(word.value for word in call.keywords)]
        name = call.func.attr if isinstance(call.func, ast.Attribute) else ast.unparse(call.func)
        owner = ast.unparse(call.func.value) if isinstance(call.func, ast.Attribute) else ""
        if given and (ast.unparse(given[0]) in buffers or "os.devnull" in ast.unparse(given[0])):
            continue
        modes = [one.value for one in given if isinstance(one, ast.Constant)]
        writing = any(re.fullmatch(r"[rbt]*[wax+][bt+]*", str(mode)) for mode in modes)
        opens = name in ("open", "fdopen") and writing
        flagged = name == "open" and re.search("O_(WRONLY|RDWR|CREAT)", ast.unparse(call))
        exr = name == "write" and owner.startswith("OpenEXR.")
        named = name in WRITES and (name not in OF_NUMPY or owner in MODULES)
        if (opens or flagged or exr or named) and owner != "output_files":
            yield name, call.lineno


def test_nobody_writes_in_another_way() -> None:
    found = set()
    for path in (ROOT / "clpt").rglob("*.py"):
        if path.name == "output_files.py" or path.name.startswith("make_"):
            continue
        place = path.relative_to(ROOT / "clpt").as_posix()
        for name, line in writing_calls(ast.parse(path.read_text("utf-8"))):
            found.add((place, name))
            assert (place, name) in ELSEWHERE, f"{place}:{line}: {name}"
    assert found == ELSEWHERE


@pytest.fixture(scope="module")
def wholes(tmp_path_factory) -> dict[str, bytes]:
    """What each kind of file holds when nothing is wrong."""
    root, made = tmp_path_factory.mktemp("wholes"), {}
    for kind, (name, _) in WRITERS.items():
        assert outcome(root / kind, kind) == "new"
        made[kind] = (root / kind / name).read_bytes()
        assert len(list((root / kind).iterdir())) == 1
    return made


def interrupted(write: Callable[[], Any], line: int) -> int:
    """Write, with Ctrl-C before a line of clpt's, or of contexts of clpt; return how many lines."""
    passed, ours = 0, str(ROOT / "clpt")

    def trace(frame: FrameType, event: str, _: Any) -> Any:
        nonlocal passed
        of_context = frame.f_code.co_filename == contextlib.__file__
        caller = frame.f_back if of_context else frame
        if caller is None or not caller.f_code.co_filename.startswith(ours):
            return None
        if event == "line":
            passed += 1
            if passed == line:
                signal.raise_signal(signal.SIGINT)
        return trace

    before = sys.gettrace()
    heeded = signal.signal(signal.SIGINT, signal.default_int_handler)
    sys.settrace(trace)
    try:
        with contextlib.suppress(KeyboardInterrupt):
            write()
    finally:
        sys.settrace(before)
        signal.signal(signal.SIGINT, heeded)
    return passed


@EACH
def test_ctrl_c_at_every_line(tmp_path: Path, kind: str, wholes: dict[str, bytes]) -> None:
    """The old file is there, or the new one, and nothing beside it."""
    name, write = WRITERS[kind]
    path = tmp_path / name
    output_files._looked_at.add(tmp_path)
    lines = interrupted(lambda: write(path), 0)
    assert lines > 10
    seen = set()
    all_over, at_the_end = range(1, lines + 1, max(1, lines // 8)), range(lines - 26, lines + 1)
    for line in sorted({*all_over, *at_the_end}):
        path.write_bytes(OLD)
        interrupted(lambda: write(path), line)
        seen.add(path.read_bytes())
        assert [one.name for one in tmp_path.iterdir() if one.name != name + ".1"] == [name], line
    assert seen == {OLD, wholes[kind]}


@posix
@EACH
def test_a_file_that_may_not_grow(tmp_path: Path, kind: str, wholes: dict[str, bytes]) -> None:
    """It stands for a disk that is full, at sizes up to the whole."""
    name, _ = WRITERS[kind]
    path, size = tmp_path / name, len(wholes[kind])
    path.write_bytes(OLD)
    action = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    try:
        for most in (0, 1, size // 4, size // 2, size - 4097, size - 100, size - 1):
            if most >= 0:
                resource.setrlimit(resource.RLIMIT_FSIZE, (most, limits[1]))
                told = outcome(tmp_path, kind)
                resource.setrlimit(resource.RLIMIT_FSIZE, limits)
                assert told != "new" and path.read_bytes() == OLD, most
                assert {one.name for one in tmp_path.iterdir()} <= {name, name + ".1"}, most
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, action)
    assert outcome(tmp_path, kind) == "new" and path.read_bytes() == wholes[kind]


@posix
@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EIO, errno.EDQUOT, errno.EROFS])
@pytest.mark.parametrize("call", ["open", "fsync", "replace"])
def test_every_call_that_fails(tmp_path: Path, monkeypatch, call: str, number: int) -> None:
    failing, most = getattr(os, call), [0]

    def fails(*given: Any, **named: Any) -> Any:
        most[0] -= 1
        if most[0] < 0:
            raise OSError(number, os.strerror(number), *given[:1])
        return failing(*given, **named)

    for kind in WRITERS:
        path = tmp_path / WRITERS[kind][0]
        for before in range(2 if call == "open" else 1):
            path.write_bytes(OLD)
            most[0] = before
            monkeypatch.setattr(output_files.os, call, fails)
            told = outcome(tmp_path, kind)
            monkeypatch.undo()
            assert path.read_bytes() != OLD if told == "new" else path.read_bytes() == OLD
            assert told != "new" or before == 1  # the folder's names, which cannot be synced
            assert not list(tmp_path.glob(f"{output_files.PARTIAL}*")), told
            assert output_files.PARTIAL not in told, "the name says nothing to people"


@posix
@EACH
def test_a_folder_that_goes_away(tmp_path: Path, monkeypatch, kind: str) -> None:
    folder = tmp_path / "folder"
    sync = os.fsync

    def gone(handle: int) -> None:
        shutil.rmtree(folder)
        sync(handle)

    monkeypatch.setattr(output_files.os, "fsync", gone)
    told = outcome(folder, kind)
    assert "No such file" in told and output_files.PARTIAL not in told
    assert not folder.exists()


@posix
def test_killed_processes_leave_the_old_file_and_the_next_one_cleans_up(tmp_path: Path) -> None:
    told = in_a_child(tmp_path, "kill")
    assert told == {kind: [1, True, "new"] for kind in WRITERS}


@posix
@pytest.mark.skipif(not hasattr(os, "getuid") or os.getuid() != 0, reason="another user's folder")
def test_a_folder_of_another_user() -> None:
    with tempfile.TemporaryDirectory() as folder:  # pytest's own are for one user
        os.chmod(folder, 0o755)
        told = in_a_child(Path(folder), "user")
    assert told.keys() == WRITERS.keys()
    assert all("Permission denied" in text for text in told.values()), told


@pytest.mark.skipif(not shutil.which("unshare"), reason="no mounts of one's own")
def test_a_disk_that_is_full(tmp_path: Path) -> None:
    """On a small file system, with so many pages of it free."""
    told = in_a_child(tmp_path, "full", "unshare", "-m")
    for kind, results in told.items():
        first = results.index("new")
        assert first > 0 and set(results[first:]) == {"new"}, kind


LEFT = [
    # who holds its lock, its age [s], whose machine, whether it goes
    (False, 0, True, True),
    (True, 0, True, False),
    (True, 1e6, True, False),
    (False, 0, False, False),
    (False, 1e6, False, True),
]


@posix
@pytest.mark.parametrize(("held", "age", "here", "goes"), LEFT)
def test_what_was_left_behind(tmp_path, monkeypatch, held, age, here, goes):
    import fcntl

    path = tmp_path / "a.exr"
    left = output_files._new_name(path)
    if not here:
        left = left.with_name(left.name.replace(output_files._HERE, output_files.PARTIAL + "0-"))
    with left.open("wb") as file:
        os.utime(left, (time.time() - age,) * 2)
        if held:
            fcntl.flock(file, fcntl.LOCK_EX)
        output_files.write(path, b"new")
    assert left.exists() is not goes and path.read_bytes() == b"new"
    assert len(list(tmp_path.iterdir())) == 2 - goes


@posix
@pytest.mark.parametrize("number", [errno.ENOLCK, errno.EOPNOTSUPP])
def test_a_file_system_without_locks(tmp_path, monkeypatch, number):
    def refused(*_):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr("fcntl.flock", refused)
    path = tmp_path / "a.exr"
    old, new = output_files._new_name(path), output_files._new_name(path)
    for left in (old, new):
        left.touch()
    os.utime(old, (1e9, 1e9))
    output_files.write(path, b"new")
    assert new.exists() and not old.exists() and path.read_bytes() == b"new"


@posix
def test_only_files_of_this_user_are_removed(tmp_path, monkeypatch):
    path, outside = tmp_path / "a.exr", tmp_path / "outside"
    outside.touch()
    names = [output_files._new_name(path) for _ in range(4)]
    names[0].symlink_to(outside)
    names[1].mkdir()
    os.mkfifo(names[2])
    names[3].touch()
    monkeypatch.setattr(output_files.os, "getuid", lambda: 12345)
    output_files.write(path, b"new")
    assert all(os.path.lexists(name) for name in names) and outside.exists()


@posix
def test_a_file_that_another_process_removes_at_once_is_made_again(tmp_path, monkeypatch):
    lock, taken = output_files._lock, []

    def late(handle):
        if not taken:
            taken.extend(tmp_path.glob(f"{output_files.PARTIAL}*"))
            taken[0].unlink()
        return lock(handle)

    monkeypatch.setattr(output_files, "_lock", late)
    output_files.write(tmp_path / "a", b"new")
    assert taken and [one.name for one in tmp_path.iterdir()] == ["a"]


def test_lines_are_added_whole(tmp_path):
    path = tmp_path / "a.jsonl"
    for text in ("one\n", "two\n"):
        output_files.append_text(path, text)
    assert path.read_text() == "one\ntwo\n"


def test_a_new_file_has_usual_permissions_and_a_link_stays(tmp_path: Path) -> None:
    path, link = tmp_path / "a.txt", tmp_path / "link.txt"
    output_files.write_text(path, "one")
    (tmp_path / "usual").touch()
    assert path.stat().st_mode == (tmp_path / "usual").stat().st_mode
    path.chmod(0o640)
    link.symlink_to(path)
    output_files.write_text(link, "two")
    assert link.is_symlink() and path.read_text() == "two"
    assert path.stat().st_mode & 0o777 == 0o640


@posix
def test_what_is_no_file_is_written_itself() -> None:
    output_files.write(Path(os.devnull), b"nothing")
    assert not Path(os.devnull).is_file()


def test_targets_are_tried(tmp_path: Path, monkeypatch) -> None:
    output_files.check_writable(tmp_path / "a.png")
    assert not list(tmp_path.iterdir()), "nothing is left"
    for target, told in (
        (tmp_path, "it is a folder"),
        (tmp_path / "no" / "a.png", "its folder does not exist"),
        (Path("/proc/a.png"), "no file can be made there"),
    ):
        if target.parts[1] != "proc" or sys.platform == "linux":
            with pytest.raises(OSError, match=told):
                output_files.check_writable(target)
    path = tmp_path / "a.png"
    path.touch(0o444)
    monkeypatch.setattr(output_files.os, "access", lambda *_: False)  # root may write everything
    with pytest.raises(OSError, match="read-only"):
        output_files.check_writable(path)


def test_a_second_name_stays_when_the_file_is_replaced(tmp_path, monkeypatch):
    path, other = tmp_path / "a", tmp_path / "a.1"
    output_files.link(path, other)
    assert not list(tmp_path.iterdir())  # there is nothing to keep
    for content in (b"1", b"2", b"3"):
        output_files.link(path, other)
        output_files.link(path, other)  # as after a failure
        output_files.write(path, content)
    assert (path.read_bytes(), other.read_bytes()) == (b"3", b"2")

    def refused(*names):
        raise OSError(1, "not permitted")

    monkeypatch.setattr(os, "link", refused)
    output_files.link(path, other)
    assert (path.read_bytes(), other.read_bytes()) == (b"3", b"2")
    assert len(list(tmp_path.iterdir())) == 2


@posix
def test_a_current_folder_that_is_gone(tmp_path):
    """clpt is imported and writes elsewhere; a picture for that folder is refused."""
    gone = tmp_path / "gone"
    gone.mkdir()
    code = f"""
import os; os.chdir({str(gone)!r}); os.rmdir({str(gone)!r})
import clpt
clpt.write_image({str(tmp_path / "a.png")!r}, [[[0.5, 0.5, 0.5]]])
try: clpt.write_image("b.png", [[[0.5, 0.5, 0.5]]])
except clpt.SceneError as error: print(error)
"""
    own = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", code], env=own, capture_output=True, text=True)
    assert done.stdout.strip() == "b.png: its folder does not exist", done.stderr
    assert (tmp_path / "a.png").exists()


@pytest.mark.parametrize("letter", ["x", "\u00e9", "\U0001f600"])
def test_names_beside_long_ones_are_cut_and_stay_apart(tmp_path: Path, letter):
    """Those of up to 255 bytes are as they were; of longer ones no two are the same."""
    size = len(letter.encode())
    short = tmp_path / (letter * (240 // size) + ".png")
    assert output_files.beside(short, ".a.exr").name == short.stem + ".a.exr"
    names = set()
    for count in range(244 // size, 251 // size + 1):
        made = output_files.beside(tmp_path / (letter * count + ".png"), ".resume.exr", 253)
        made.touch()
        assert made.name.endswith(".resume.exr") and len(made.name.encode()) <= 253
        names.add(made.name)
    assert len(names) == 251 // size - 244 // size + 1
