"""Launches that are run again: margins, stages that a bad compiler made wrong, programs of them."""

from __future__ import annotations

import dataclasses
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clpt import bench as benchmark
from clpt import device
from clpt.bench import agreement, launches
from clpt.bench.launches import EXACT, FREE, Flight, Launch
from clpt.device import native_programs
from clpt.errors import SceneError, UnknownKindError
from clpt.records import PATH
from clpt.render.wavefront.path_buffers import SORTING
from clpt.render.wavefront.strategy import Tuning
from clpt.scene import Scene

COUNT = 1024
STAGE = "shadow"


@pytest.fixture(scope="module")
def on() -> device.Device:
    return device.choose()


@pytest.fixture(scope="module")
def scene() -> Scene:
    return benchmark.opened("cornell", "rgb")


@pytest.fixture(scope="module")
def flight(on: device.Device, scene: Scene) -> Flight:
    """Paths in flight, of the programs that other tests of the benchmark have built."""
    found = Flight(on, scene, COUNT)
    for _ in range(agreement.WARM):
        found.bounce()
    return found


@pytest.fixture(scope="module")
def noted(flight: Flight) -> dict[str, Launch]:
    return {one.stage: one for one in launches.launches(flight)}


def words(*values: float) -> np.ndarray:
    return np.array(values, np.float32).view(np.uint32)


def test_margins() -> None:
    """Floats, NaN, whole numbers around 0, and words that are not compared."""
    found = np.concatenate([words(1.0, 1.0, np.nan, np.inf), np.array([0, 5, 9], np.uint32)])
    expected = np.concatenate(
        [words(1.01, 1.2, np.nan, 1.0), np.array([2**32 - 2, 9, 1], np.uint32)]
    )
    margins = np.array([0.1, 0.1, 0.1, 0.1, EXACT - 2, EXACT - 2, FREE], np.float32)
    off = launches.is_off(found, expected, margins)
    assert off.tolist() == [False, True, False, True, False, True, False]


def test_a_launch_run_again_writes_the_same(
    on: device.Device, flight: Flight, noted: dict[str, Launch]
) -> None:
    assert list(noted) == ["generate", "intersect", "shade_diffuse", STAGE]
    for launch in noted.values():
        comparison = launch.compare(launch.again(on), flight)
        assert comparison.share == 0.0 and comparison.changed > COUNT / 4, launch.stage


def test_words_that_are_off_are_counted_and_named(flight: Flight, noted: dict[str, Launch]) -> None:
    launch = noted["shade_diffuse"]
    found = {name: launch.after[name].copy() for name in launch.margins}
    rows = launches.rows_of(flight, PATH, found["path_words"])
    first = next(member.word for member in PATH.members if member.name == "beta")
    rows[:, first] = (rows[:, first].view(np.float32) * np.float32(1.1)).view(np.uint32)
    comparison = launch.compare(found, flight)
    assert comparison.wrong and comparison.problem.endswith("% of what it writes is wrong (beta)")


@pytest.fixture
def bad_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    """A compiler whose optimiser lets no light through."""
    build = native_programs.build

    def wrong(context: Any, on: Any, code: Any, options: Sequence[str] = ()) -> Any:
        if isinstance(code, str) and launches.PLAIN[0] not in options:
            code = code.replace("(shadow_most(passes) > 0.0f)", "(shadow_most(passes) > 2.0f)")
        return build(context, on, code, options)

    monkeypatch.setattr(native_programs, "build", wrong)


def test_a_bad_compiler_is_found(scene: Scene, bad_compiler: None) -> None:
    """By what the same text does without its optimiser; its context has no right programs."""
    info = device.choose().info
    fresh = device.Device.open(info)
    witness = agreement.Witness(fresh, launches.PLAIN, "another")
    (one,) = agreement.checked(fresh, scene, witness, (STAGE,))
    assert one.wrong and list(one.members) == ["radiance"]


def test_the_wrong_stage_is_named(
    on: device.Device, scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A witness that finds something else in one stage alone."""
    again = Launch.again

    def other(launch: Launch, on: device.Device, options: Sequence[str] = ()) -> Any:
        found = again(launch, on)
        if launch.stage == STAGE:
            found["path_words"] = found["path_words"] ^ np.uint32(1 << 22)
        return found

    monkeypatch.setattr(Launch, "again", other)
    told = agreement.first_wrong(on, scene)
    assert told.startswith("first in shadow: ") and "% of what it writes is wrong (o, d" in told
    assert told.endswith("), beside the same text without the compiler's optimiser")
    figures = {one.name: one for one in agreement.measure(on, scene)}
    assert [name for name, one in figures.items() if one.refused] == [STAGE]
    assert figures["generate"].rounds == (100.0,) and figures["generate"].unit == "%"
    with pytest.raises(UnknownKindError, match="did you mean 'shadow'"):
        list(agreement.measure(on, scene, ("shadows",)))


@pytest.fixture
def folder(on: device.Device, noted: dict[str, Launch], tmp_path: Path) -> Path:
    """A launch as a program of its own."""
    launches.write_program(
        tmp_path / "fault", noted[STAGE], "cornell", on.info, "another device", "right"
    )
    return tmp_path / "fault"


def spoil(folder: Path) -> None:
    """Let another radiance be expected."""
    path = folder / "path_words.expected"
    content = np.fromfile(path, np.uint32)
    margins = np.fromfile(folder / "path_words.margins", np.float32)
    content[margins >= 0] ^= np.uint32(1 << 22)
    content.tofile(path)


def ended(command: list[str], folder: Path) -> tuple[int, str]:
    """The exit status and the last line of a command in a folder."""
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    return done.returncode, (done.stdout.strip() or done.stderr.strip()).splitlines()[-1]


def check_host(command: list[str], folder: Path) -> None:
    """Expect what a host says of a launch as it is, of a spoilt one, and of a text that is none."""
    status, last = ended(command, folder)
    assert status == 0 and last.startswith("right: 0 words are off, rounding allows "), last
    spoil(folder)
    status, last = ended(command, folder)
    assert status == 1 and last.startswith("WRONG: "), last
    (folder / "kernel.cl").write_text("this is no kernel", encoding="utf-8")
    assert ended(command, folder)[0] == 2


def numbers(on: device.Device) -> list[str]:
    """The numbers of a device's platform and of it there."""
    import pyopencl as cl

    for i, platform in enumerate(cl.get_platforms()):
        for j, one in enumerate(platform.get_devices()):
            if one == on.info.cl_device:
                return [str(i), str(j)]
    raise AssertionError(on)


def test_the_python_host_needs_no_clpt(on: device.Device, folder: Path) -> None:
    run = "import sys; sys.modules['clpt'] = None; import runpy; sys.argv = sys.argv[1:]; "
    run += "runpy.run_path('launch.py', run_name='__main__')"
    command = [sys.executable, "-I", "-c", run, "launch.py", *numbers(on)]
    check_host(command, folder)


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_the_c_host_compiles_and_runs(on: device.Device, folder: Path, compiler: str) -> None:
    """With the loader of the system, or else that of PyOpenCL's wheel."""
    if shutil.which(compiler) is None:
        pytest.skip(f"no {compiler}")
    probe = "#include <CL/cl.h>\nint main(void) { return clGetPlatformIDs(0, 0, 0) != 0; }\n"
    (folder / "probe.c").write_text(probe, encoding="utf-8")
    strict = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]
    loader = next((one for one in loaders() if not built(compiler, "probe", [], one, folder)), None)
    if loader is None:
        pytest.skip("no headers or no loader of OpenCL")
    assert built(compiler, "launch", strict, loader, folder) == ""
    command = [str(folder / "launch"), *numbers(on)]
    check_host(command, folder)


def loaders() -> list[list[str]]:
    """What may link a program with OpenCL."""
    import pyopencl as cl

    wheel = sorted(Path(cl.__file__).parents[1].glob("pyopencl*/**/libOpenCL*.so*"))
    return [["-lOpenCL"], *([str(one), f"-Wl,-rpath,{one.parent}"] for one in wheel)]


def built(compiler: str, name: str, flags: list[str], loader: list[str], folder: Path) -> str:
    """What a compiler says of a program's text, or "" if it was built."""
    command = [compiler, *flags, f"{name}.c", *loader, "-lm", "-o", name]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    return done.stderr or str(done.returncode) if done.returncode else ""


def test_where_it_cannot_be_written(
    on: device.Device, noted: dict[str, Launch], tmp_path: Path
) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(SceneError, match="cannot be written"):
        launches.write_program(
            tmp_path / "file", noted[STAGE], "cornell", on.info, "another", "right"
        )


def test_queues_of_a_gpu_are_launches(on: device.Device, scene: Scene) -> None:
    """The kernel of each launch is in its text: queues of one program serve several stages."""
    info = dataclasses.replace(on.info, kind="gpu", compute_units=1)
    tuning = Tuning(layout="compact", sorted_rays=True)
    queued = Flight(device.Device(on.context, on.queue, info), scene, COUNT, tuning=tuning)
    every = [*launches.launches(queued)]
    assert all(each.kernel in each.text.text for each in every)
    kernels = {each.stage for each in every}
    assert {"append_ended", "append", "append_shadows", *SORTING} <= kernels
