"""What the compilers of GPUs that are not here make of programs: it may only get better."""

from __future__ import annotations

import functools
import struct

import pytest

from bench import machine
from bench.gpu_compilers import programs, results, vendors
from bench.gpu_compilers.results import Row

FIRST = {vendor.devices[0]: vendor for vendor in vendors.VENDORS}
ROWS = [row for row in results.read(results.STAGES) if row["device"] in FIRST]

SASS = """
        /*0040*/                   LDG.E R3, [R2.64+0x4] ;
        /*0050*/              @!P0 FFMA R0, R1, R2, R3 ;
        /*0060*/                   MUFU.RCP R4, R5 ;
        /*0070*/               @P1 BRA `(.L_x_1) ;
        /*0080*/                   STG.E [R2.64], R3 ;
"""
GEN = """
L0:
(W)     mov (8|M0)               r127.0<1>:ud  0x0:ud
        mad (8|M0)               r127.2<1>:f   r127.2<0;0>:f    r127.0<0;0>:f    r9.0<0;0>:f
(f0.0)  math.inv (8|M0)          r1.0<1>:f     r2.0<1;1,0>:f
(W&f1.0) send.dc0 (8|M0)         r1       r127    null    0x0  0x0
"""
AMD = """
	global_load_b32 v1, v[2:3], off
	v_fma_f32 v0, v1, v2, v3
	v_rcp_f32_e32 v0, v1
	v_mov_b32_e32 v0, v1
	s_add_u32 s0, s1, s2
"""
TOKENS = """Unidentified PatchToken:
	4 Token 38
	4 Size 28
	Hex 80 6 0 0 f8 0 0 0 8 0 0 0 40 2 0 0 1 0 0 0
"""


@pytest.mark.parametrize(
    ("pattern", "text", "kinds", "expected"),
    [
        (vendors.SASS_NAME, SASS, vendors.SASS, (2, 1, 1)),
        (vendors.AMD_NAME, AMD, vendors.AMD, (1, 1, 1)),
        (vendors.GEN_NAME, GEN, vendors.GEN, (1, 1, 1)),
    ],
)
def test_instructions_are_counted_by_kind(pattern, text, kinds, expected) -> None:
    """Memory, arithmetic, special functions; moves and branches are none of these."""
    assert vendors.counted(pattern.findall(text), kinds) == expected


def test_patch_tokens() -> None:
    assert vendors.words(TOKENS, 38) == [[0x680, 0xF8, 8, 576, 1]]
    assert vendors.words(TOKENS, 23) == []


def test_the_size_of_code() -> None:
    names = b"\0.text.shade\0.data\0.strings\0"
    heads = [(0, 0), (1, 96), (13, 40), (19, len(names))]
    table = b"".join(
        struct.pack("<IIQQQQ", name, 1, 0, 0, 64 if i == 3 else 0, size).ljust(64, b"\0")
        for i, (name, size) in enumerate(heads)
    )
    elf = bytearray(64) + names
    struct.pack_into("<Q", elf, 0x28, len(elf))
    struct.pack_into("<HHH", elf, 0x3A, 64, len(heads), 3)
    assert vendors.size_of(bytes(elf) + table) == 96


def row(device: str, stage: str, **more: object) -> Row:
    figures = dict.fromkeys(vendors.Figures.__dataclass_fields__, 0)
    return {"device": device, "stage": stage, "scene": "box", "mode": "rgb", **figures, **more}


def test_stages_have_the_worst_of_their_programs() -> None:
    rows = [
        row("sm_89", "shade_diffuse", registers=60, occupancy=32, stack=8, seconds=1.0),
        row("sm_89", "shade_diffuse", registers=90, occupancy=20, scene="pool"),
        {"device": "sm_89", "stage": "shade_diffuse", "error": "no"},
        {"device": "sm_89", "stage": "append", "error": "no"},
    ]
    append, diffuse = results.of_stages(rows)
    assert append == {"device": "sm_89", "stage": "append", "programs": 1, "failed": 1}
    assert diffuse["registers"] == 90 and diffuse["least"] == 60 and diffuse["scene"] == "pool"
    assert diffuse["occupancy"] == 20 and diffuse["stack"] == 8 and diffuse["failed"] == 1
    page = results.page([append, diffuse])
    assert "| shade_diffuse | 3 | 60 to 90 | 20 | 8 |" in page and "4 programs, 2 refused" in page


def test_the_longest_texts_of_each_stage() -> None:
    given = [
        programs.Program("a" * n, stage, "box", mode)
        for n, stage, mode in [
            (3, "x", "rgb"),
            (5, "x", "rgb"),
            (1, "x", "spectral"),
            (2, "y", "rgb"),
        ]
    ]
    assert {len(p.text) for p in programs.longest(given, 1)} == {5, 1, 2}


def test_what_is_kept_spills_nothing() -> None:
    """Stack is for traversal alone; trees of wide8, which spill on AMD's, are for NVIDIA's.

    Shadow rays and joins through mixtures within mixtures also have the scene there, for a
    function. Some of Intel's spill still, and `emit` of a sky on AMD's: see docs/gpus.md. They may
    not get worse, as below.
    """
    assert ROWS
    for kept in ROWS:
        assert "failed" not in kept, kept
        if FIRST[kept["device"]].name == "Intel":
            continue
        most = {"intersect": 256, "shadow": 576, "splat": 576}
        most |= {"emit": 16, "shade_rough_plastic": 256}  # on gfx1100
        if "wide8" not in kept["stage"] or FIRST[kept["device"]].name == "NVIDIA":
            assert kept["stack"] <= most.get(kept["stage"].split()[0], 0), kept
        others = "wide8" in kept["stage"] and FIRST[kept["device"]].name != "NVIDIA"
        assert kept["spilled"] <= (3 if kept["stage"] == "emit" else 0) or others, kept


@functools.lru_cache(maxsize=2)
def of_scene(name: str) -> list[programs.Program]:
    return programs.of_scenes([machine.ROOT / "scenes" / name])


@pytest.mark.slow
@pytest.mark.parametrize("kept", ROWS, ids=lambda kept: f"{kept['device']} {kept['stage']}")
def test_registers_only_fall(kept: Row) -> None:
    """Of each stage the program that has most of them; `bench.gpu_compilers` looks at all."""
    vendor = FIRST[kept["device"]]
    if vendor.missing:
        pytest.skip(f"{', '.join(vendor.missing)} not found")
    own = [
        program
        for program in of_scene(kept["scene"])
        if (program.stage, program.mode) == (kept["stage"], kept["mode"])
    ]
    assert own, "the scene has no such program any more: measure again"
    for program in own:
        figures = vendor.figures(program.text, kept["device"], program.registers)
        for name in ("registers", "stack", "spilled"):
            assert getattr(figures, name) <= kept[name], (name, figures)
