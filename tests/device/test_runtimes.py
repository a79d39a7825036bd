"""Intel's CPU runtime from a wheel: found, listed beside the system's drivers, never forced."""

from __future__ import annotations

import os
import sys

import pytest

from clpt.device import runtimes


@pytest.fixture
def wheel(tmp_path, monkeypatch, cache_folder):
    """An environment with the wheel, and a system with one driver and one placeholder."""
    library = tmp_path / "lib" / "libintelocl.so"
    library.parent.mkdir()
    library.touch()
    system = tmp_path / "vendors"
    system.mkdir()
    (system / "pocl.icd").write_text("libpocl.so.2\n")
    (system / "placeholder.icd").write_text("/opt/placeholder/libintelocl.so")
    monkeypatch.setattr(runtimes, "_SYSTEM", system)
    monkeypatch.setattr(runtimes, "wheel_library", lambda: library)
    monkeypatch.setattr(runtimes.sys, "platform", "linux")
    monkeypatch.setattr(runtimes.sys, "prefix", str(tmp_path))
    monkeypatch.setenv(runtimes.VARIABLE, "")
    runtimes.vendors.cache_clear()
    yield library
    runtimes.vendors.cache_clear()


def announce() -> str | None:
    """The folder that the loader reads in this process, and in those that compile for it."""
    seen = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            runtimes.cl, "get_platforms", lambda: seen.append(os.environ["OCL_ICD_VENDORS"])
        )
        before = os.environ.get(runtimes.VARIABLE)
        runtimes.platforms()
        assert os.environ.get(runtimes.VARIABLE) == before, "the program's own variable is changed"
    assert runtimes.environment().get(runtimes.VARIABLE) == seen[0]
    return seen[0]


def test_both_are_listed(wheel):
    folder = announce()
    assert runtimes.icd_files([runtimes.Path(folder)]) == {
        "clpt-intel-cpu.icd": str(wheel),
        "pocl.icd": "libpocl.so.2",
    }


def test_what_the_user_set_stays(wheel, monkeypatch):
    monkeypatch.setenv(runtimes.VARIABLE, "/my/own")
    assert announce() == "/my/own"


def test_a_system_that_has_it_is_left_alone(wheel):
    (runtimes._SYSTEM / "intel.icd").write_text(str(wheel))
    assert not announce()


def test_the_variable_is_as_it_was_after_a_failure(wheel, monkeypatch):
    def fails():
        raise ZeroDivisionError

    monkeypatch.delenv(runtimes.VARIABLE)
    monkeypatch.setattr(runtimes.cl, "get_platforms", fails)
    with pytest.raises(ZeroDivisionError):
        runtimes.platforms()
    assert runtimes.VARIABLE not in os.environ


def test_nothing_without_the_wheel(wheel, monkeypatch):
    monkeypatch.setattr(runtimes, "wheel_library", lambda: None)
    assert not announce()


def test_an_unwritable_cache_is_a_warning(wheel, monkeypatch, tmp_path, caplog):
    (tmp_path / "file").touch()
    monkeypatch.setattr(runtimes.disk_cache, "folder", lambda: tmp_path / "file")
    assert not announce()
    assert "cannot be made known" in caplog.text


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such limit")
def test_a_limit_of_address_space_is_told(monkeypatch):
    """Drivers are not loaded below it, as if there were none."""
    import resource

    monkeypatch.setattr(resource, "getrlimit", lambda _: (400 << 20, resource.RLIM_INFINITY))
    assert "400 MiB of address space (ulimit -v)" in runtimes.advice()
    unlimited = (resource.RLIM_INFINITY, resource.RLIM_INFINITY)
    monkeypatch.setattr(resource, "getrlimit", lambda _: unlimited)
    assert runtimes.advice() == runtimes.ADVICE
