"""The cache folder: its limit, what dead processes leave, and folders that others can write."""

from __future__ import annotations

import multiprocessing
import os
import shutil
import sys

import pytest

from clpt import device
from clpt.device import runtimes
from clpt.errors import DeviceError
from clpt.files import disk_cache
from clpt.files.output_files import PARTIAL

posix = pytest.mark.skipif(os.name != "posix", reason="of users and permissions")


def test_what_was_used_last_stays(cache_folder):
    for number in range(4):
        disk_cache.store(f"entry{number}", "{}", bytes(1000))
        path = cache_folder / "programs" / f"entry{number}"
        os.utime(path, (1e9 + number, 1e9 + number))
    size = path.stat().st_size
    assert disk_cache.load("entry0") == ("{}", bytes(1000))  # now it was used last
    disk_cache.prune(cache_folder, 2 * size)
    assert {p.name for p in path.parent.iterdir()} == {"entry0", "entry3"}
    assert disk_cache.load("entry1") is None


def test_a_process_keeps_the_limit_while_it_writes(cache_folder, monkeypatch):
    monkeypatch.setattr(disk_cache, "_STEP", 3000)
    monkeypatch.setattr(disk_cache.prune, "__defaults__", (8000,))
    for number in range(40):
        disk_cache.store(f"entry{number}", "{}", bytes(1000))
    sizes = [path.stat().st_size for path in (cache_folder / "programs").iterdir()]
    assert sum(sizes) <= 8000 + 3000


def _churn(folder, seed):
    """Store, load and prune in the same folder as others; the exit status tells of an error."""
    disk_cache.folder = lambda: folder
    for number in range(40):
        name = f"entry{(7 * number + seed) % 9}"
        disk_cache.store(name, "{}", name.encode() * 500)
        found = disk_cache.load(name)
        if found not in (None, ("{}", name.encode() * 500)):
            sys.exit(3)
        disk_cache.prune(folder, 20_000)


def test_several_processes(cache_folder):
    spawn = multiprocessing.get_context("fork" if os.name == "posix" else "spawn")
    workers = [spawn.Process(target=_churn, args=(cache_folder, seed)) for seed in range(10)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join(60)
    assert [worker.exitcode for worker in workers] == [0] * 10
    assert not list(cache_folder.rglob(f"{PARTIAL}*"))


def test_the_users_folder_is_used_and_private(user, caplog):
    assert disk_cache.folder() == user and not caplog.text
    if os.name == "posix":
        assert user.stat().st_mode & 0o777 == 0o700


@pytest.mark.parametrize("inside", ["trial", "file"])
def test_folders_in_it_do_not_matter(user, caplog, inside):
    (user / inside).mkdir(parents=True)
    assert disk_cache.folder() == user and not caplog.text


@posix
@pytest.mark.parametrize("part", ["", "programs"])
def test_a_folder_that_others_can_write_is_not_used(user, caplog, part):
    (user / part).mkdir(parents=True)
    (user / part).chmod(0o777)
    for _ in range(3):
        chosen = disk_cache.folder()
    assert chosen.parent.parent == user.parent.parent / "temporary"
    assert len(caplog.records) == 1 and f"chmod go-w {user / part}" in caplog.text
    disk_cache.store("entry", "{}", b"binary")
    assert disk_cache.load("entry") and not list(user.rglob("entry"))


@posix
def test_a_folder_of_another_user_is_not_used(user, caplog, monkeypatch):
    user.mkdir(parents=True)
    monkeypatch.setattr(disk_cache.os, "getuid", lambda: 12345)
    assert user not in (disk_cache.folder(), *disk_cache.folder().parents)
    assert "belongs to another user" in caplog.text


def test_a_cache_that_cannot_be_written_is_one_warning(user, monkeypatch, caplog):
    """PoCL finds no device then, PyOpenCL runs no kernel: both get another folder too."""
    user.parent.write_text("in the way")
    runtimes._make_caches_writable.__wrapped__()
    chosen = disk_cache.folder()
    assert chosen.is_relative_to(user.parent.parent / "temporary")
    disk_cache.store("entry", "{}", b"binary")
    assert disk_cache.load("entry")
    assert len(caplog.records) == 1
    assert f"the cache folder {user.parent} cannot be written" in caplog.text


@pytest.fixture
def homeless(user, monkeypatch):
    """A user without an entry in passwd, and without HOME, as in some containers."""
    pwd = pytest.importorskip("pwd")

    def no_entry(uid):
        raise KeyError(uid)

    monkeypatch.setattr(pwd, "getpwuid", no_entry)
    for variable in ("HOME", "XDG_CACHE_HOME", "XDG_STATE_HOME"):
        monkeypatch.delenv(variable, raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", "")  # so that it is set as it was afterwards
    disk_cache._without_home.cache_clear()
    yield user.parent.parent / "temporary"
    disk_cache._without_home.cache_clear()


@posix
def test_a_user_without_a_home_has_temporary_caches_and_one_warning(homeless, caplog):
    runtimes._make_caches_writable.__wrapped__()
    assert os.environ["XDG_CACHE_HOME"].startswith(str(homeless))
    disk_cache.store("entry", "{}", b"binary")
    assert disk_cache.load("entry")
    assert disk_cache.folder().is_relative_to(homeless)
    assert len(caplog.records) == 1 and "set HOME" in caplog.text


@posix
def test_a_fault_of_a_user_without_a_home_is_told(homeless):
    from clpt.cli.process import ending

    try:
        raise ValueError("a fault")
    except ValueError as error:
        message, _ = ending.message_of(error)
    assert "ValueError: a fault" in message and "traceback.txt" in message


@posix
def test_a_queue_of_a_user_without_a_home_is_refused(request):
    queue = device.choose().queue
    request.getfixturevalue("homeless")
    with pytest.raises(DeviceError, match="set HOME"):
        device.Device.adopt(queue)


@posix
def test_a_cache_that_goes_away_is_made_again(user):
    disk_cache.store("entry", "{}", b"binary")
    shutil.rmtree(user.parent)
    assert disk_cache.load("entry") is None
    disk_cache.store("entry", "{}", b"binary")
    assert disk_cache.load("entry")


def test_pocls_own_folder(user, monkeypatch, caplog):
    user.parent.write_text("in the way")
    monkeypatch.setenv("XDG_CACHE_HOME", str(user.parent.parent))
    monkeypatch.setenv("POCL_CACHE_DIR", str(user.parent / "pocl"))
    runtimes._make_caches_writable.__wrapped__()
    assert os.environ["POCL_CACHE_DIR"].startswith(str(user.parent.parent / "temporary"))
    assert len(caplog.records) == 1
