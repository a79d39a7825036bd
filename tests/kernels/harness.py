"""Small programs around single kernel functions, so that tests can call them on arrays."""

from __future__ import annotations

from functools import cache

import numpy as np

from clpt import device, testing
from clpt.scene.materials import LEAVES, Material
from clpt.testing import probe
from clpt.testing.probe import COMPONENTS, CONTRACTED, NOTHING, contracts, root_text

MODES = tuple(COMPONENTS)


@cache
def opened() -> device.Device:
    """The device that the kernel tests run on."""
    return device.choose()


def quick_mode(cls: type[Material]) -> int:
    """The mode, of MODES, that quick tests of a kind share, so that they compile one program.

    Spectral where wavelengths part; by turns elsewhere.
    """
    parts = cls.chromatic or cls.disperses or cls.fluoresces or cls.needs_wavelengths
    return 1 if parts else LEAVES.index(cls) % 2


def other_mode(cls: type[Material]) -> int:
    """The mode, of MODES, that few quick tests of a kind compile."""
    return 1 - quick_mode(cls)


class Probe(testing.Probe):
    """The functions of one material kind in one mode, as functions of arrays, on that device."""

    def __init__(self, cls: type[Material], mode: str, lanes: int = 16):
        super().__init__(cls, mode, lanes, opened())


def run(
    text: str,
    lanes: int,
    given: np.ndarray,
    rows: int,
    table: np.ndarray = NOTHING,
    options: tuple[str, ...] = (),
) -> np.ndarray:
    """Run the kernel `probe` of a text on that device, see clpt.testing.probe."""
    return probe.run(opened(), {"probe.cl": text}, lanes, given, rows, table, options)


def assert_lanes_agree(found: np.ndarray, expected: np.ndarray) -> None:
    """Numbers of two widths are equal to the bit, or nearly where the compiler contracts."""
    near = CONTRACTED if contracts(opened()) else {"rtol": 0.0, "atol": 0.0}
    np.testing.assert_allclose(found, expected, **near)


def map_text(body: str, arguments: int, results: int, mode: str = "rgb", files=()) -> str:
    """A kernel `probe` that computes r[0..results) from x[0..arguments), all `real`."""
    reads = "".join(f"    x[{i}] = block_load(in + {i} * n + at);\n" for i in range(arguments))
    writes = "".join(f"    block_store(out + {i} * n + at, r[{i}]);\n" for i in range(results))
    return (
        root_text(mode, tuple(files))
        + "kernel void probe(global const float *in, global float *out, uint n)\n{\n"
        + f"    uint at = get_global_id(0) * LANES;\n    real x[{arguments}], r[{results}];\n"
        + f"{reads}    {body}\n{writes}}}\n"
    )
