"""Folders that other users of the machine can write: what is read from them, and written there."""

from __future__ import annotations

import os
import stat
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from clpt.device import runtimes
from clpt.files import disk_cache, output_files

pytestmark = pytest.mark.skipif(os.name != "posix", reason="this system has no such owners")
OTHER = 65534


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder for caches, and one for temporary files beside it; drivers are told of no cache."""
    (tmp_path / "temporary").mkdir()
    (tmp_path / "home").mkdir()
    monkeypatch.setattr(disk_cache.tempfile, "tempdir", str(tmp_path / "temporary"))
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    for variable in ("XDG_CACHE_HOME", *runtimes.CACHES):
        monkeypatch.setenv(variable, "")
    cached = (disk_cache.private_folder, disk_cache.temporary_folder)
    for function in cached:
        function.cache_clear()
    yield tmp_path
    for function in cached:
        function.cache_clear()


def made(folder: Path, mode: int) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    folder.chmod(mode)
    return folder


UNSAFE = {  # folders (name, mode) on the way to the caches, of which others can write one
    "itself": [("x", 0o777)],
    "sticky itself": [("x", 0o1777)],
    "parent": [("a", 0o777), ("a/x", 0o700)],
    "parent of parent": [("a", 0o777), ("a/b", 0o755), ("a/b/x", 0o700)],
    "by a group": [("a", 0o757), ("a/x", 0o700)],
}


def where_caches_are() -> dict[str, Path]:
    """What a process tells its drivers, and clpt's own folder."""
    runtimes._make_caches_writable.__wrapped__()
    told = {name: os.environ.get(name) for name in ("XDG_CACHE_HOME", *runtimes.CACHES)}
    return {"clpt": disk_cache.folder(), **{k: Path(v) for k, v in told.items() if v}}


@pytest.mark.parametrize("which", UNSAFE)
def test_no_cache_lies_where_others_can_write(
    place: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, which: str
) -> None:
    """clpt's, PoCL's, PyOpenCL's and all that follow XDG_CACHE_HOME, as the environment is."""
    for name, mode in UNSAFE[which]:
        cache = made(place / name, mode)
    made(cache / "pocl" / "kcache", 0o777)  # as another user makes it first
    monkeypatch.setenv("XDG_CACHE_HOME", str(cache))
    found = where_caches_are()
    assert {"clpt", "XDG_CACHE_HOME", "POCL_CACHE_DIR"} <= found.keys()
    for folder in found.values():
        assert (
            folder.is_relative_to(place / "temporary")
            and output_files.ownership_fault(folder) is None
        )
    assert len(caplog.records) == 1 and str(cache) in caplog.text
    assert "can be written by others" in caplog.text


@pytest.mark.parametrize("name", disk_cache._OF_OTHERS)
def test_a_folder_of_a_driver_that_others_can_write(
    place: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    cache = made(place / "x", 0o700)
    made(cache / name, 0o777)
    monkeypatch.setenv("XDG_CACHE_HOME", str(cache))
    assert not any(folder.is_relative_to(cache) for folder in where_caches_are().values())


@pytest.mark.parametrize("variable", runtimes.CACHES)
@pytest.mark.parametrize("which", [None, *UNSAFE])
def test_what_a_user_has_set_stays_if_it_is_safe(
    place: Path, monkeypatch: pytest.MonkeyPatch, variable: str, which: str | None
) -> None:
    for name, mode in [("x", 0o700)] if which is None else UNSAFE[which]:
        cache = made(place / name, mode)
    monkeypatch.setenv(variable, str(cache))
    found = where_caches_are()[variable]
    assert found == cache if which is None else found.is_relative_to(place / "temporary")


def test_safe_caches_stay_where_they_are(place: Path, caplog: pytest.LogCaptureFixture) -> None:
    """A sticky folder above, such as /tmp, does no harm; PoCL's cache is within clpt's."""
    found = where_caches_are()
    home = place / "home" / ".cache"
    assert found == {"clpt": home / "clpt", "POCL_CACHE_DIR": home / "clpt" / "pocl"}
    made(place / "sticky", 0o1777)
    assert output_files.ownership_fault(made(place / "sticky" / "x", 0o700)) is None
    assert not caplog.text


def test_nvidias_folder_follows_home(place: Path) -> None:
    made(place / "home" / ".nv", 0o777)
    assert where_caches_are()["CUDA_CACHE_PATH"] == disk_cache.folder() / "nvidia"


def test_temporary_folders_are_safe_too(place: Path) -> None:
    """Where others can take away what lies in TMPDIR, another folder holds caches."""
    made(place / "temporary", 0o777)
    found = disk_cache.temporary_folder()
    assert output_files.ownership_fault(found) is None and not found.is_relative_to(place)


def test_links_on_the_way_count(place: Path) -> None:
    """A link into a folder that others can write, by a link in another, and links in a circle."""
    made(place / "open", 0o777)
    made(place / "open" / "x", 0o700)
    (place / "link").symlink_to("open/x")
    (place / "again").symlink_to(place / "link")
    assert "others" in str(output_files.ownership_fault(place / "again"))
    (place / "round").symlink_to("round")
    with pytest.raises(OSError, match="symbolic links"):
        output_files.followed(place / "round" / "a")
    assert output_files.followed(place / "link" / ".." / "new") == place / "open" / "new"


def test_folders_of_others_are_unsafe(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = made(place / "x", 0o700)
    if os.getuid() == 0:
        os.chown(place / "x", OTHER, OTHER)
    else:
        monkeypatch.setattr(output_files.os, "getuid", lambda: os.geteuid() + 1)
    assert "another user" in str(output_files.ownership_fault(folder))


@pytest.fixture
def shared(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[Path, Path]]:
    """A sticky folder, and a link of another user in it, which leads to a file of this user."""
    precious = tmp_path / "precious.txt"
    precious.write_text("precious")
    if os.getuid() == 0:
        folder = made(tmp_path / "share", 0o1777)
        link = folder / "a.png"
        link.symlink_to(precious)
        os.lchown(link, OTHER, OTHER)
    else:  # this user's link in the system's own folder, as another user sees it
        folder = Path("/tmp")
        if not (folder.stat().st_mode & stat.S_ISVTX and folder.stat().st_uid == 0):
            pytest.skip("/tmp is not sticky here")
        link = Path(tempfile.mktemp(dir=folder, prefix="clpt-test-", suffix=".png"))
        link.symlink_to(precious)
        user = os.getuid()
        monkeypatch.setattr(output_files.os, "geteuid", lambda: user + 1)
    yield link, precious
    link.unlink(missing_ok=True)


WRITERS = {
    "write": lambda path: output_files.write(path, b"new"),
    "append_text": lambda path: output_files.append_text(path, "new"),
    "check_writable": output_files.check_writable,
}


@pytest.mark.parametrize("how", WRITERS)
def test_a_link_of_another_user_is_not_followed(shared: tuple[Path, Path], how: str) -> None:
    link, precious = shared
    with pytest.raises(PermissionError, match="a link of another user"):
        WRITERS[how](link)
    output_files.link(link, precious.with_name("second"))
    assert precious.read_text() == "precious" and not precious.with_name("second").exists()


def test_links_of_ones_own_are_followed(tmp_path: Path) -> None:
    """In any folder, a sticky one too."""
    target = tmp_path / "a.txt"
    target.touch()
    for mode in (0o1777, 0o777, 0o700):
        link = made(tmp_path / "share", mode) / "a"
        link.unlink(missing_ok=True)
        link.symlink_to(target)
        output_files.write(link, b"%o" % mode)
        assert target.read_bytes() == b"%o" % mode and link.is_symlink()


@pytest.mark.skipif(os.getuid() != 0 if hasattr(os, "getuid") else True, reason="needs root")
def test_a_pipe_of_another_user_is_not_written(tmp_path: Path) -> None:
    pipe = made(tmp_path / "share", 0o1777) / "a"
    os.mkfifo(pipe)
    os.chown(pipe, OTHER, OTHER)
    with pytest.raises(PermissionError, match="a pipe of another user"):
        output_files.write(pipe, b"x")
