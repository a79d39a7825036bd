"""Mattes: the coverage of names is counted, whoever adds it and however a render is split, and a
reader that knows only the specification finds it in the file."""

from __future__ import annotations

import json
import struct

import numpy as np
import OpenEXR
import pytest

import clpt
from clpt import transforms as tf
from clpt.render.film.layers import murmur3_32, name_bits
from clpt.render.film.state import add_mattes
from clpt.scene import Film, Scene
from clpt.scene.cameras import Orthographic
from clpt.scene.integrators import Path
from clpt.scene.layers import MATTE_SLOTS
from clpt.scene.lights import Constant
from clpt.scene.materials import Diffuse
from clpt.scene.shapes import Group, Instance, Rectangle

MATTES = ("crypto_object", "crypto_material")


def strips(count: int, layers=MATTES, size: int = 4) -> Scene:
    """Upright strips of equal width side by side before the sky, which is a half of the film."""
    red, blue = Diffuse(reflectance=(0.7, 0.1, 0.1), name="red"), Diffuse(name="blå")
    width = 2.0 / count
    shapes = [
        Rectangle(
            to_world=tf.translate([-1.0 + (i + 0.5) * width, 0.5, 0.0])
            @ tf.scale([width / 2, 0.5, 1.0]),
            material=red if i % 2 else blue,
            name=f"strip {i}",
        )
        for i in range(count)
    ]
    return Scene(
        camera=Orthographic(to_world=tf.look_at([0, 0, 4], [0, 0, 0], [0, 1, 0])),
        shapes=shapes,
        lights=[Constant(radiance=1.0)],
        film=Film(width=size, height=size, mode="rgb", layers=layers),
        integrator=Path(light_paths=0, max_depth=2),
    )


def rendered(scene: Scene, samples: int, **options):
    with clpt.Renderer(scene, **options) as renderer:
        renderer.run(samples)
        return renderer.layers(), renderer.film_state()


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("", 0),
        ("hello", 0x248BFA47),
        ("hello, world", 0x149BBB7F),
        ("The quick brown fox jumps over the lazy dog", 0x2E4FF723),
    ],
)
def test_names_are_hashed_as_everywhere(text, wanted):
    """Published values of MurmurHash3_x86_32."""
    assert murmur3_32(text) == wanted


def test_names_become_ordinary_floats():
    """Of ten thousand names some have exponents that are left out."""
    bits = np.array([name_bits(f"name {i}") for i in range(10_000)], np.uint32)
    plain = np.array([murmur3_32(f"name {i}") for i in range(10_000)], np.uint32)
    exponent = bits >> 23 & 255
    assert exponent.min() >= 1 and exponent.max() <= 254
    assert 0 < (bits != plain).sum() < 200 and np.isfinite(bits.view(np.float32)).all()


def test_lists_of_names_add_in_any_order():
    """Against dictionaries: the first names are kept, with all their counts."""
    rng = np.random.default_rng(4)
    films = []
    for _ in range(3):
        words = np.zeros((2, MATTE_SLOTS, 3, 5), np.uint32)
        for at in np.ndindex(2, 3, 5):
            names = np.sort(rng.choice(40, rng.integers(0, MATTE_SLOTS + 1), replace=False)) + 1
            words[at[0], : len(names), at[1], at[2]] = names << 7 | rng.integers(1, 20, len(names))
        films.append(words)
    a, b, c = films
    total = add_mattes(add_mattes(a, b), c)
    np.testing.assert_array_equal(total, add_mattes(a, add_mattes(c, b)))
    for at in np.ndindex(2, 3, 5):
        counts: dict[int, int] = {}
        for film in films:
            for word in film[at[0], :, at[1], at[2]]:
                if word:
                    counts[int(word >> 7)] = counts.get(int(word >> 7), 0) + int(word & 127)
        wanted = [name << 7 | counts[name] for name in sorted(counts)[:MATTE_SLOTS]]
        found = total[at[0], :, at[1], at[2]]
        np.testing.assert_array_equal(found[found > 0], wanted)


def test_a_pixel_keeps_the_first_names_however_it_is_rendered():
    """80 strips before 16 pixels, 20 names each: several slots add to a pixel at once."""
    scene = strips(80)
    _, once = rendered(scene, 64)
    _, other = rendered(scene, 64, looped=False, slots=64)
    np.testing.assert_array_equal(other.mattes, once.mattes)
    parts = [
        rendered(scene, end - first, first_sample=first)[1] for first, end in ((0, 20), (20, 70))
    ]
    np.testing.assert_array_equal(parts[0].merged(parts[1]).mattes, once.mattes)
    names = (once.mattes[0] >> 7).astype(int) - 1
    for x in range(4):
        first = sorted(set(range(80)[20 * x : 20 * x + 20]))[:MATTE_SLOTS]
        np.testing.assert_array_equal(names[:, 0, x], first)
    counts = (once.mattes & 127).sum(axis=1)
    assert (counts[1, :2] == 64).all()  # materials: two names are all there are
    assert not counts[:, 2:].any()  # the sky


def read_by_the_specification(path) -> dict[str, dict[str, np.ndarray]]:
    """Mattes of all names (h, w) by layer, of any file, as the specification 1.2 says."""
    with OpenEXR.File(str(path), separate_channels=True) as file:
        header, channels = dict(file.header()), file.channels()
        pixels = {name: np.asarray(channel.pixels) for name, channel in channels.items()}
    found = {}
    for key in [k for k in header if k.startswith("cryptomatte/") and k.endswith("/name")]:
        code = key.split("/")[1]
        assert len(code) == 7 and int(code, 16) >= 0
        assert header[f"cryptomatte/{code}/hash"] == "MurmurHash3_32"
        assert header[f"cryptomatte/{code}/conversion"] == "uint32_to_float32"
        manifest = json.loads(header[f"cryptomatte/{code}/manifest"])
        prefix, mattes = header[key], {}
        for name, bits in manifest.items():
            wanted = struct.unpack(">f", bytes.fromhex(bits))[0]
            matte = np.zeros(next(iter(pixels.values())).shape)
            for level in range(3):
                for ids, covers in (("red", "green"), ("blue", "alpha")):
                    channel = pixels[f"{prefix}{level:02d}.{ids}"]
                    assert channel.dtype == np.float32
                    covered = pixels[f"{prefix}{level:02d}.{covers}"]
                    matte += np.where(channel == np.float32(wanted), covered, 0.0)
            mattes[name] = matte
        found[prefix] = mattes
    return found


@pytest.fixture(scope="module")
def few(tmp_path_factory):
    """Three strips, twice as instances of named and nameless copies, as a file."""
    scene = strips(3, size=6)
    group = Group((scene.shapes.pop(),), "the last")
    scene.shapes += [
        Instance(group=group),
        Instance(group=group, to_world=tf.translate([0, -1, 0]), name="below"),
    ]
    path = tmp_path_factory.mktemp("matte") / "few.exr"
    with clpt.Renderer(scene) as renderer:
        renderer.run(16)
        clpt.write_layers(path, renderer)
        return renderer.layers(), path


def test_another_reader_finds_the_mattes(few):
    layers, path = few
    found = read_by_the_specification(path)
    assert set(found) == {"CryptoObject", "CryptoMaterial"}
    objects, materials = found["CryptoObject"], found["CryptoMaterial"]
    assert set(objects) == {"strip 0", "strip 1", "the last", "below"}
    for i, name in enumerate(("strip 0", "strip 1", "the last")):
        wanted = np.zeros((6, 6))
        wanted[:3, 4 - 2 * i : 6 - 2 * i] = 1.0  # +x is to the left of a camera that looks along -z
        np.testing.assert_allclose(objects[name], wanted[:, ::-1], atol=1e-6)
    np.testing.assert_allclose(objects["below"][3:, 4:], 1.0)
    np.testing.assert_allclose(materials["blå"] + materials["red"], sum(objects.values()))
    np.testing.assert_allclose(materials["red"], objects["strip 1"])
    pairs = layers["crypto_object"].reshape(6, 6, 6, 2)
    assert (np.diff(pairs[..., 1], axis=2) <= 0).all()  # the largest first


def test_inspect_tells_of_mattes(few, capsys):
    from clpt.__main__ import run

    assert run(["inspect", str(few[1]), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["CryptoObject"] == "Cryptomatte, 4 names"
    assert not any(key.startswith("cryptomatte/") for key in told)
