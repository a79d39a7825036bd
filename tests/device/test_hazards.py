"""What bad devices do, played: each ends in the picture, or in one line that says what to do."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pyopencl as cl
import pytest

import clpt
from clpt import device
from clpt.bench import figures
from clpt.device import building, compilers, native_programs, program
from clpt.render.wavefront import bounce_loop
from clpt.render.wavefront.bounce_loop import LEAST_ITEMS
from clpt.scene import Film, Scene, cameras, integrators, lights, materials, shapes
from clpt.transforms import look_at
from tests.device.bad_device import (
    CODE,
    BadDevice,
    Launch,
    driver_error,
    no_images,
    refuse_standard,
)
from tests.test_other_compilers import of_every_material, texts_of

MIB = 1 << 20
LOST = CODE.DEVICE_NOT_AVAILABLE


@pytest.fixture(scope="module")
def scene() -> Scene:
    """Two kinds of materials, so that paths are queued."""
    return Scene(
        camera=cameras.Perspective(fov=40.0, to_world=look_at((0, 0, 4), (0, 0, 0), (0, 1, 0))),
        film=Film(width=256, height=128, mode="rgb"),
        integrator=integrators.Path(max_depth=3),
        shapes=[
            shapes.Sphere(material=materials.Diffuse()),
            shapes.Sphere(center=(0.5, 0, 1), radius=0.3, material=materials.Conductor()),
        ],
        lights=[lights.Constant(radiance=1.0)],
    )


@pytest.fixture(scope="module")
def picture(scene: Scene) -> np.ndarray:
    """What a good device renders."""
    return rendered(scene, BadDevice())


def rendered(scene: Scene, bad: BadDevice, samples: int = 1, **options: Any) -> np.ndarray:
    with clpt.Renderer(scene, bad.open(), **options) as renderer:
        renderer.run(samples)
        return renderer.image()


def refusing(limit: int, code: int) -> Callable[[int], None]:
    """Refuses buffers above a size."""

    def check(size: int) -> None:
        if size > limit:
            raise driver_error(code)

    return check


def groups_of(most: int) -> Callable[[Launch], None]:
    def check(launch: Launch) -> None:
        if launch.group > most:
            raise driver_error(CODE.INVALID_WORK_GROUP_SIZE)

    return check


def local_memory_of(most: int) -> Callable[[Launch], None]:
    def check(launch: Launch) -> None:
        if launch.local_memory > most:
            raise driver_error(CODE.OUT_OF_RESOURCES)

    return check


def refused_at(number: int, code: int) -> Callable[[Launch], None]:
    """The driver refuses a launch."""

    def check(launch: Launch) -> None:
        if launch.number == number:
            raise driver_error(code)

    return check


def killed_at(number: int, code: int) -> Callable[[Launch], int | None]:
    """A launch fails while it runs."""
    return lambda launch: code if launch.number == number else None


def watchdog(items: int) -> Callable[[Launch], int | None]:
    """Launches of more work-items take longer than a display's driver waits."""
    return lambda launch: CODE.OUT_OF_RESOURCES if launch.items > items else None


SMALL = {"global_mem": 64 * MIB, "max_alloc": 16 * MIB}


@dataclass(frozen=True)
class Hazard:
    """A bad device. says: what the error tells, as a pattern; "": the picture is made all the same.

    error: the class of it; options: of the renderer.
    """

    make: Callable[[], BadDevice]
    says: str = ""
    error: type[clpt.ClptError] = clpt.DeviceError
    options: tuple[tuple[str, Any], ...] = ()


HAZARDS = {
    "a quarter of memory is the largest buffer": Hazard(
        lambda: BadDevice(SMALL, buffer=refusing(16 * MIB, CODE.INVALID_BUFFER_SIZE))
    ),
    "hardly any memory": Hazard(
        lambda: BadDevice({"global_mem": MIB, "max_alloc": 1 << 14}),
        "the least number of paths needs .* KiB, the device has .* KiB: close other",
        clpt.MemoryBudgetError,
    ),
    "memory that fails late": Hazard(
        lambda: BadDevice(launch=refused_at(3, CODE.MEM_OBJECT_ALLOCATION_FAILURE)),
        "lower the size of the image", clpt.MemoryBudgetError,
    ),
    "less memory than was told": Hazard(
        lambda: BadDevice(buffer=refusing(MIB, CODE.MEM_OBJECT_ALLOCATION_FAILURE)),
        "lower the number of slots|lower the size", clpt.MemoryBudgetError,
    ),
    "groups of 256": Hazard(lambda: BadDevice(launch=groups_of(256))),
    "16 KiB of local memory": Hazard(lambda: BadDevice(launch=local_memory_of(16 << 10))),
    "a watchdog": Hazard(
        lambda: BadDevice(launch=watchdog(LEAST_ITEMS - 1), dead=CODE.OUT_OF_RESOURCES),
        "stopped a kernel that took too long: take a smaller picture or fewer slots",
    ),
    "a watchdog, and fewer slots": Hazard(
        lambda: BadDevice(launch=watchdog(1 << 15)), options=(("slots", 1 << 13),)
    ),
    "a device that is lost": Hazard(
        lambda: BadDevice(launch=killed_at(4, LOST), dead=LOST),
        "was reset or removed: open it again in a new process",
    ),
    "a context that is lost": Hazard(
        lambda: BadDevice(launch=refused_at(2, CODE.INVALID_CONTEXT)),
        "open it again in a new process",
    ),
    "a kernel that leaves its buffers": Hazard(
        lambda: BadDevice(launch=refused_at(2, -9999)), "beyond its buffers"
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", HAZARDS)
def test_hazards(
    name: str, scene: Scene, picture: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    hazard = HAZARDS[name]
    bad = hazard.make()
    bad.play(monkeypatch)
    if not hazard.says:
        found = rendered(scene, bad, **dict(hazard.options))
        assert np.array_equal(found, picture)
        assert bad.launches
        return
    with pytest.raises(hazard.error) as raised:
        rendered(scene, bad, **dict(hazard.options))
    assert re.search(hazard.says, str(raised.value)), str(raised.value)
    assert "\n" not in str(raised.value)
    assert isinstance(raised.value.__cause__, cl.Error) or hazard.error is clpt.MemoryBudgetError


@dataclass
class SlowDevice:
    """A device that takes some time [s] for a work-item; its driver ends kernels after .1 s.

    now: its clock [s]. A pixel of the picture is no path, and takes next to nothing.
    """

    speed: float
    now: float = 0.0

    def __call__(self, launch: Launch) -> int | None:
        took = self.speed * launch.items * (launch.name != "accumulate")
        self.now += took
        return CODE.OUT_OF_RESOURCES if took > 0.1 else None


@pytest.mark.parametrize(("speed", "most"), [(1e-5, LEAST_ITEMS), (1e-9, 1 << 15)])
def test_launches_are_shorter_than_a_watchdog_waits(
    speed: float, most: int, scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A third of a second for all slots, or less than a thousandth: then they are one launch."""
    samples = 8
    expected = rendered(scene, BadDevice(), samples)
    slow = SlowDevice(speed)
    bad = BadDevice(launch=slow, dead=CODE.OUT_OF_RESOURCES)
    bad.play(monkeypatch)
    clock = SimpleNamespace(perf_counter=lambda: slow.now)
    monkeypatch.setattr(bounce_loop, "time", clock)
    assert np.array_equal(rendered(scene, bad, samples), expected)
    assert max(one.items for one in bad.launches if one.name != "accumulate") == most
    monkeypatch.setattr(bounce_loop, "FIRST_PARTS", 1)
    if speed > 1e-6:
        with pytest.raises(clpt.DeviceError, match="stopped a kernel that took too long"):
            rendered(scene, bad, samples)


@pytest.mark.parametrize("most", [64, 32, 16, 8, 1])
def test_groups_that_the_device_cannot_run_are_smaller(
    most: int, scene: Scene, picture: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Which a driver tells of each kernel: clpt asks for up to 256."""
    bad = BadDevice(launch=groups_of(most))
    bad.play(monkeypatch)
    monkeypatch.setattr(program, "most_items", lambda *_: most)
    assert np.array_equal(rendered(scene, bad), picture)


def test_nothing_needs_images_or_finish(
    scene: Scene, picture: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    no_images(monkeypatch)
    monkeypatch.setattr(cl.CommandQueue, "finish", lambda _: 1 / 0)
    assert np.array_equal(rendered(scene, BadDevice()), picture)
    copying = figures.Copying(device.choose(profiling=True))
    _, complaint = copying.rounds(1 << 12, 1)
    assert complaint == ""


def test_a_compiler_that_takes_minutes_is_named(
    scene: Scene, picture: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It goes on here; the command line ends."""
    said: list[str] = []
    build = native_programs.build

    def slow(context: Any, on: Any, code: Any, options: Any = ()) -> Any:
        while not said:
            pass
        return build(context, on, code, options)

    monkeypatch.setenv(compilers.VARIABLE, "0.05")
    monkeypatch.setattr(compilers, "at_limit", said.append)
    monkeypatch.setattr(native_programs, "build", slow)
    monkeypatch.setattr(building, "_known", lambda *_: None)
    assert np.array_equal(rendered(scene, BadDevice()), picture)
    assert re.match("the driver's compiler has been at the program '.*' for 0 s", said[0])


def test_a_compiler_that_refuses_is_one_line(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the text was kept is told."""
    BadDevice().open()  # its trial builds

    def refuse(context: Any, on: Any, code: Any, options: Any = ()) -> Any:
        raise driver_error(CODE.BUILD_PROGRAM_FAILURE)

    monkeypatch.setattr(native_programs, "build", refuse)
    monkeypatch.setattr(building, "_known", lambda *_: None)
    with pytest.raises(clpt.KernelBuildError, match=r"did not build: .*\.cl") as raised:
        rendered(scene, BadDevice())
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("code", "log"),
    [
        (CODE.INVALID_BUILD_OPTIONS, ""),
        (CODE.INVALID_COMPILER_OPTIONS, ""),
        (CODE.BUILD_PROGRAM_FAILURE, "error: invalid value 'CL1.2' in '-cl-std=CL1.2'"),
    ],
)
@pytest.mark.parametrize("linked", [False, True])
def test_a_compiler_that_refuses_the_version_of_the_language(
    code: int, log: str, linked: bool, scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every program is built without the option then, alone or as a part of a linked one."""
    on = BadDevice().open()
    attempts = refuse_standard(monkeypatch, code, log)
    text = "kernel void fill(global float *out) { out[0] = 7; }"
    options = (*building.OPTIONS, "-DMORE=1")
    build = native_programs.compile_part if linked else native_programs.build
    made = build(on.context, on.info.cl_device, text, options)
    if linked:
        made = cl.link_program(on.context, [made], [], [on.info.cl_device])
    assert attempts == [b" ".join(map(str.encode, options)), b"-cl-kernel-arg-info -w -DMORE=1"]
    out, found = cl.Buffer(on.context, cl.mem_flags.READ_WRITE, 4), np.empty(1, np.float32)
    cl.Kernel(made, "fill")(on.queue, (1,), None, out)
    cl.enqueue_copy(on.queue, found, out)
    assert found[0] == 7


def test_a_picture_where_the_version_of_the_language_is_refused(
    scene: Scene, picture: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    attempts = refuse_standard(monkeypatch, CODE.INVALID_BUILD_OPTIONS, "")
    monkeypatch.setattr(building, "_known", lambda *_: None)
    assert np.array_equal(rendered(scene, BadDevice()), picture)
    refused = [b"-cl-std" in options for options in attempts]
    assert any(refused) and refused.count(True) == refused.count(False)


def test_a_text_with_an_error_is_built_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the driver does not speak of the option."""
    on = BadDevice().open()
    attempts = refuse_standard(monkeypatch, CODE.BUILD_PROGRAM_FAILURE, "error: no such name")
    with pytest.raises(cl.Error, match="no such name"):
        native_programs.build(on.context, on.info.cl_device, "no", building.OPTIONS)
    assert len(attempts) == 1


def test_no_kernel_asks_for_the_size_of_sub_groups() -> None:
    """Devices have them of 8, 16, 32 or 64 work-items; nothing hangs on that."""
    for path in device.kernels_folder().rglob("*.cl"):
        assert "sub_group" not in path.read_text(encoding="utf-8"), path


def constant_bytes(text: str) -> int:
    """Of tables whose entries have four bytes."""
    return 4 * sum(map(int, re.findall(r"(?m)^(?:static )?constant \w+ \w+\[(\d+)\] =", text)))


def test_a_device_with_little_constant_memory(
    scene: Scene, picture: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    """4 KiB are enough but for rough coats, whose tables have 38 KiB: OpenCL promises 64."""
    build = native_programs.build

    def refuse(context: Any, on: Any, code: Any, options: Any = ()) -> Any:
        if isinstance(code, str) and constant_bytes(code) > 4096:
            raise driver_error(CODE.BUILD_PROGRAM_FAILURE)
        return build(context, on, code, options)

    monkeypatch.setattr(native_programs, "build", refuse)
    monkeypatch.setattr(building, "_known", lambda *_: None)
    assert np.array_equal(rendered(scene, BadDevice()), picture)
    coat = materials.RoughPlastic(alpha=0.2)
    with pytest.raises(clpt.KernelBuildError, match=r"shade\.cl. did not build"):
        rendered(dataclasses.replace(scene, shapes=[shapes.Sphere(material=coat)]), BadDevice())


@pytest.mark.parametrize("mode", ["rgb", "spectral"])
def test_constants_fit_what_opencl_promises(mode: str) -> None:
    sizes = [constant_bytes(text) for text in texts_of(of_every_material(mode), (1,))]
    assert 4096 < max(sizes) <= 64 << 10
