"""clpt's kernels in a program of an application's own."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyopencl as cl
import pytest

import clpt
from clpt import bvh, device
from clpt.render.flow.programs import BSDF, PARTS
from clpt.scene.materials import LEAVES, Material

KERNELS = """
kernel void trace(BVH_ARGS, global const float4 *rays, global float *t, global int *met)
{
    uint i = get_global_id(0);
    float3 o = rays[2 * i].xyz, d = rays[2 * i + 1].xyz;
    TriHit hit = bvh_closest(BVH, o, d, 0.0f, INFINITY);
    t[i] = hit.prim == BVH_MISS ? -1.0f : hit.t + (float)hit.prim;
    met[i] = bvh_occluded(BVH, o, d, 0.0f, INFINITY);
}
kernel void numbers(global float2 *out)
{
    uint i = get_global_id(0);
    vec2 u = sampler_pair(sampler_start(7u, i, 3u), 5u);
    out[i] = (float2)(u.x, u.y);
}
kernel void metal(global float4 *out)
{
    uint i = get_global_id(0);
    vec2 u = sampler_pair(sampler_start(7u, i, 0u), 0u);
    RoughConductor m;
    m.eta = spectrum_of(0.2f);
    m.k = spectrum_of(3.0f);
    m.specular_reflectance = spectrum_of(1.0f);
    m.alpha_u = m.alpha_v = 0.3f;
    m.distribution = 0;
    m.layers = layers_none();
    vec3 wo = normalize3(v3(0.3f, 0.1f, 0.8f));
    BsdfSample s = rough_conductor_sample(m, wo, v3(u.x, u.y, 0.0f));
    Spectrum f = rough_conductor_eval(m, wo, s.wi);
    out[i] = (float4)(s.weight.y * s.pdf, f.y, s.pdf, rough_conductor_pdf(m, wo, s.wi));
}
"""


@pytest.fixture(scope="module")
def theirs() -> cl.CommandQueue:
    found = device.choose()
    return cl.CommandQueue(cl.Context([found.info.cl_device]))


@pytest.fixture(scope="module")
def program(theirs: cl.CommandQueue) -> cl.Program:
    text = clpt.kernel_source("bvh", "random", "bsdf/rough_conductor", lines=False)
    return cl.Program(theirs.context, text + KERNELS).build(["-cl-std=CL1.2"])


def made(queue: cl.CommandQueue, kernel: cl.Kernel, given: tuple, *results: np.ndarray) -> None:
    """Run a kernel and read what it wrote."""
    flags = cl.mem_flags
    outs = [cl.Buffer(queue.context, flags.WRITE_ONLY, one.nbytes) for one in results]
    kernel(queue, (len(results[0]),), None, *given, *outs)
    for out, one in zip(outs, results, strict=True):
        cl.enqueue_copy(queue, one, out)


def test_rays_go_through_a_tree(theirs: cl.CommandQueue, program: cl.Program) -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    vertices = np.concatenate([corners + np.float32([0, 0, z]) for z in (5, 2)])
    faces = np.arange(6, dtype=np.uint32).reshape(2, 3)
    tree = bvh.build(device.Device.adopt(theirs), vertices, faces, layout="wide8")
    rays = np.zeros((3, 2, 4), np.float32)
    rays[:, 0, :2], rays[:, 1, 2] = [[0.2, 0.2], [0.9, 0.9], [0.1, 0.1]], [1, 1, -1]
    rays[2, 0, 2] = 4.0  # from between the two, down
    flags = cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR
    given = (*tree.buffers.values(), cl.Buffer(theirs.context, flags, hostbuf=rays))
    t, met = np.zeros(3, np.float32), np.zeros(3, np.int32)
    assert list(tree.buffers) == ["nodes", "leaves"]
    made(theirs, program.trace, given, t, met)
    np.testing.assert_allclose(t, [3.0, -1.0, 3.0])  # distance, and the number of the triangle
    assert met.tolist() == [1, 0, 1]


def test_random_numbers_are_those_of_a_counter(
    theirs: cl.CommandQueue, program: cl.Program
) -> None:
    def hashed(x: np.ndarray) -> np.ndarray:
        x = x * np.uint32(747796405) + np.uint32(2891336453)
        x = ((x >> ((x >> np.uint32(28)) + np.uint32(4))) ^ x) * np.uint32(277803737)
        return (x >> np.uint32(22)) ^ x

    found = np.zeros((1000, 2), np.float32)
    made(theirs, program.numbers, (), found)
    golden, i = np.uint32(0x9E3779B9), np.arange(1000, dtype=np.uint32)
    seven, sample = np.array([7], np.uint32), np.array([3 + 0x7F4A7C15], np.uint32)
    seed = hashed(i ^ (seven * golden))
    key = hashed(seed + hashed(hashed(sample) + np.array([5], np.uint32) * golden))
    for column, bits in enumerate((key, hashed(key ^ np.uint32(0x68BC21EB)))):
        expected = (bits >> np.uint32(9)) / np.float32(1 << 23)
        np.testing.assert_array_equal(found[:, column], expected.astype(np.float32))


def test_a_bsdf_is_sampled(theirs: cl.CommandQueue, program: cl.Program) -> None:
    out = np.zeros((1000, 4), np.float32)
    made(theirs, program.metal, (), out)
    out = out[out[:, 2] > 1e-3]
    assert len(out) > 900
    np.testing.assert_allclose(out[:, 0], out[:, 1], rtol=1e-3)
    np.testing.assert_allclose(out[:, 2], out[:, 3], rtol=1e-3)


def test_text_of_every_kind_together_says_all_it_needs() -> None:
    """Each file once, none of them of a scene; whether it compiles tests/kernels asks."""
    names = [f"bsdf/{cls.kind}" for cls in LEAVES]
    for mode, lanes in (("rgb", 1), ("spectral", 16)):
        text = clpt.kernel_source(*names, *PARTS, mode=mode, lanes=lanes)
        assert f"\n#define LANES {lanes}\n" in text
        assert text.count('#line 1 "kernels/core/lanes.cl"') == 1
        assert all(f"{cls.kind}_sample(" in text for cls in LEAVES)
        assert "Scene scene" not in text
    assert all((device.kernels_folder() / name).is_file() for name in BSDF if "gen" not in name)


@pytest.mark.parametrize("part", ["bvh", "random", "bsdf/diffuse"])
def test_the_applications_inline_stays_its_own(theirs: cl.CommandQueue, part: str) -> None:
    text = clpt.kernel_source(part)
    assert "#define inline" not in text
    own = "static inline float twice(float a) { return 2 * a; }\n"
    own += "kernel void k(global float *out) { out[0] = twice(1.0f); }"
    program = cl.Program(theirs.context, text + own).build(cache_dir=False)
    log = program.get_build_info(theirs.device, cl.program_build_info.LOG)
    assert not re.search(r"\binline\b", log)


def test_no_parts_are_an_error() -> None:
    with pytest.raises(clpt.SceneError, match="parts: name a part, such as 'lanes', 'math'"):
        clpt.kernel_source()


def test_faults_of_the_applications_are_its_own(theirs: cl.CommandQueue) -> None:
    text = clpt.kernel_source("math") + "\nkernel void f(global float *x) { x[0] = nonsense; }"
    with pytest.raises(cl.RuntimeError, match=r"program:2|<kernel>:\d+") as raised:
        cl.Program(theirs.context, text).build(["-cl-std=CL1.2"])
    if counted := re.search(r"<kernel>:(\d+)", str(raised.value)):  # NVIDIA's reads no `#line`
        assert "nonsense" in text.splitlines()[int(counted[1]) - 1]
    assert "#line" not in clpt.kernel_source("math", lines=False)


def test_a_kind_from_outside() -> None:
    @dataclass(frozen=True, kw_only=True, eq=False)
    class Chalk(Material):
        """Its text stands in a file."""

        source = Path("chalk.cl")

    with pytest.raises(clpt.SceneError, match=r"chalk\.cl"):
        clpt.kernel_source(Chalk)
    Chalk.source = "Spectrum chalk_albedo(Chalk m) {} // chalk_eval chalk_pdf chalk_sample"
    text = clpt.kernel_source(Chalk, lines=False)
    assert "} Chalk;\n" in text and text.endswith(f"\n{Chalk.source}\n")


@pytest.mark.parametrize("option", [{"mode": "xyz"}, {"lanes": 4}, {"layout": "brute"}])
def test_options_that_are_not_there(option: dict) -> None:
    with pytest.raises(clpt.SceneError, match=next(iter(option))):
        clpt.kernel_source("math", **option)
    with pytest.raises(clpt.UnknownKindError, match="did you mean 'bsdf/rough_conductor'"):
        clpt.kernel_source("bsdf/rough_conductr")
