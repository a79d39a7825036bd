"""Every cache with every fault: what comes out of it is right, or is made again."""

from __future__ import annotations

import dataclasses
import errno
import hashlib
import multiprocessing
import os
import random
import warnings
from collections.abc import Callable
from pathlib import Path

import pytest

import clpt
from clpt import device
from clpt.cluster.bundle import Store
from clpt.device import runtimes
from clpt.device.building import has_own_cache
from clpt.errors import ClusterError, SceneError
from clpt.files import disk_cache, output_files

pytestmark = pytest.mark.skipif(os.name != "posix", reason="of users, links and pipes")

CONTENT = b"what the cache is asked for" * 100
SCENE = b'{"camera": {"type": "perspective"}, "shapes": []}'
DIGEST = hashlib.sha256(SCENE).hexdigest()


def program(folder: Path) -> Path:
    """Ask for a program, which is built where it is not kept."""
    stored = disk_cache.load("entry")
    if stored is None:
        disk_cache.store("entry", "{}", CONTENT)
    assert stored in (None, ("{}", CONTENT))
    return folder / "programs" / "entry"


def failed(folder: Path) -> Path:
    """Keep the text of a program that did not build."""
    path = disk_cache.keep_failed("a.cl", CONTENT.decode())
    assert path is None or Path(path).read_bytes() == CONTENT
    return Path(path) if path else folder / "failed" / "a.cl"


def vendors(folder: Path) -> Path:
    """Make the folder that the loader reads."""
    try:
        made = runtimes.write_vendors({"a.icd": "/a/driver.so"})
    except OSError:  # `runtimes.vendors` warns
        return folder / "vendors"
    assert [path.name for path in made.glob("*.icd")] == ["a.icd"]  # as the loader does
    assert (made / "a.icd").read_text() == "/a/driver.so"
    return made / "a.icd"


def bundle(folder: Path) -> Path:
    """Open a scene that a client has sent."""
    store, asked = Store(), {"scene.json": DIGEST}
    for digest in store.lacks(asked):
        try:
            store.add(digest, SCENE)
        except OSError:  # a worker says so
            return folder / "bundles" / DIGEST
    try:
        with store.opened(asked) as scene:
            assert not scene.shapes
    except OSError:
        pass
    return folder / "bundles" / DIGEST


CACHES = {one.__name__: one for one in (program, failed, vendors, bundle)}
each_cache = pytest.mark.parametrize("use", CACHES.values(), ids=CACHES)


def other_content(path: Path) -> None:
    path.write_bytes(b"planted")


def cut(path: Path) -> None:
    os.truncate(path, path.stat().st_size // 2)


def emptied(path: Path) -> None:
    os.truncate(path, 0)


def flipped(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 4
    path.write_bytes(content)


def swapped(path: Path) -> None:
    output_files.write(path, b"planted")


def gone(path: Path) -> None:
    path.unlink()


def linked(path: Path) -> None:
    """A link to a file with the right content, which whoever owns it may change later."""
    outside = path.parent.parent.parent / "outside"
    path.replace(outside)
    path.symlink_to(outside)


def dangling(path: Path) -> None:
    path.unlink()
    path.symlink_to("/nowhere/at/all")


def piped(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def of_another_user(path: Path) -> None:
    if os.getuid() != 0:
        pytest.skip("root alone can give files away")
    os.chown(path, 65534, 65534)


FAULTS = (
    other_content, cut, emptied, flipped, gone, linked, dangling, piped, of_another_user,
)  # fmt: skip


@each_cache
@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.__name__)
def test_a_file_that_is_not_what_was_kept(
    user: Path, use: Callable[[Path], Path], fault: Callable[[Path], None], caplog
) -> None:
    path = use(user)
    whole = path.read_bytes()
    fault(path)
    outside = list(user.parent.parent.glob("outside"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for _ in range(2):
            use(user)
    assert path.read_bytes() == whole and not path.is_symlink()
    assert path.lstat().st_uid == os.getuid()
    assert all(one.read_bytes() == whole for one in outside)
    told = use is program and fault is not gone  # a compilation, and a warning
    assert len(caplog.records) == told
    assert not list(user.rglob(f"{output_files.PARTIAL}*"))


@each_cache
@pytest.mark.parametrize(
    "number", [errno.ENOSPC, errno.EROFS, errno.EIO, errno.EDQUOT, errno.ENOLCK, errno.EOPNOTSUPP]
)
@pytest.mark.parametrize("call", ["open", "fsync", "replace", "flock"])
def test_a_disk_that_refuses(
    user: Path, use: Callable[[Path], Path], call: str, number: int, monkeypatch, caplog
) -> None:
    """Nothing is kept, and nothing fails but what has to be kept."""
    disk_cache.folder()
    disk_cache._warn.cache_clear()

    def refused(*_, **__):
        raise OSError(number, os.strerror(number))

    opened = os.open
    if call == "open":
        monkeypatch.setattr(
            output_files.os, "open", lambda path, flags, *mode: refused() if flags & os.O_CREAT
            else opened(path, flags, *mode),
        )  # fmt: skip
    elif call == "flock":
        monkeypatch.setattr("fcntl.flock", refused)
    else:
        monkeypatch.setattr(output_files.os, call, refused)
    use(user)
    monkeypatch.undo()
    kept = [path for path in user.rglob("*") if path.is_file()]
    assert bool(kept) is (call == "flock")
    assert len(caplog.records) == (use is program and call != "flock")


def _race(user: Path, seed: int) -> None:
    """Use every cache while others do, and while files are damaged and deleted."""
    rng = random.Random(seed)
    for _ in range(12):
        for use in (program, vendors, bundle):
            try:
                path = use(user)
                if use is not vendors:
                    rng.choice((gone, swapped, lambda path: None))(path)
            except (ClusterError, SceneError, FileNotFoundError):  # another's doing, in between
                continue


def test_ten_processes_and_damage(user: Path) -> None:
    """What comes out of a cache is right, or is missing."""
    disk_cache.folder()
    fork = multiprocessing.get_context("fork")
    workers = [fork.Process(target=_race, args=(user, seed)) for seed in range(10)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join(60)
    assert [worker.exitcode for worker in workers] == [0] * 10
    for use in CACHES.values():
        use(user)
    assert not list(user.rglob(f"{output_files.PARTIAL}*"))


def test_a_file_of_a_scene_that_is_swapped_is_missing(user: Path) -> None:
    """Between the check of its digest and its use."""
    store, asked = Store(), {"scene.json": DIGEST}
    path = bundle(user)
    linked(path)
    with pytest.raises(ClusterError, match="is missing"), store.opened(asked):
        pass


def test_a_render_with_damaged_programs(user: Path, caplog) -> None:
    """Whatever the driver's own cache holds, clpt's is only looked at where its files are whole."""
    info = device.choose().info
    if has_own_cache(info.cl_device) and not info.is_cpu:
        pytest.skip("the driver keeps all programs itself, and none is linked")
    scene = clpt.load(Path(__file__).resolve().parents[2] / "scenes" / "cornell_box")
    scene = dataclasses.replace(scene, film=dataclasses.replace(scene.film, width=8, height=8))
    made = []
    for _ in range(2):
        on = device.Device.open(info)  # its own context, without programs
        with device.Compilers(1) as on.compilers:
            made.append(clpt.render(scene, 1, device=on))
        kept = [path for path in (user / "programs").iterdir() if path.is_file()]
        assert kept
        for number, path in enumerate(kept):
            (cut, flipped, emptied, linked)[number % 4](path)
    assert (made[0] == made[1]).all()
    assert ["is damaged" in record.getMessage() for record in caplog.records] == [True]
