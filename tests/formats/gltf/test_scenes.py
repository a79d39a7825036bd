"""Geometry, placement, animation, cameras and lights of small documents."""

from __future__ import annotations

import io
import math

import numpy as np
import pytest
from PIL import Image

from clpt import spectra, transforms
from clpt.errors import SceneError
from clpt.scene import cameras, lights

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)


def corners(shape):
    """Triangles' corners in the world, (m, 3, 3)."""
    return transforms.transform_points(shape.to_world, shape.vertices)[shape.faces]


@pytest.mark.parametrize(
    ("mode", "order", "expected"),
    [
        (4, [0, 1, 2, 0, 2, 3, 1], [[0, 1, 2], [0, 2, 3]]),
        (5, [0, 1, 3, 2], [[0, 1, 3], [1, 2, 3]]),
        (6, [0, 1, 2, 3], [[0, 1, 2], [0, 2, 3]]),
    ],
)
def test_modes(read, build, mode, order, expected):
    made = build()
    indices = made.accessor(order, "u1")
    shape = read(made.mesh(SQUARE, indices=indices, mode=mode)).shapes[0]
    turned = [np.roll(tri, -int(np.argmin(tri))).tolist() for tri in shape.faces]
    assert turned == expected
    assert shape.normals is None


def test_points_and_lines_are_left_out(read, build):
    made = read(build().mesh(mode=0))
    assert made.warnings[0].startswith("meshes[0].primitives[0]: points left out")
    assert "holds no triangles" in made.warnings


def test_stored_forms(read, build):
    """Interleaved, sparse, normalised and unsigned values."""
    made = build()
    rows = np.zeros(3, [("p", "<f4", 3), ("n", "i1", 4), ("t", "<u2", 2)])
    rows["p"] = [[0, 0, 0], [2, 0, 0], [0, 2, 0]]
    rows["n"] = [[0, 0, 127, 0]] * 3
    rows["t"] = [[0, 0], [65535, 0], [0, 65535]]
    view = made.view(rows.tobytes(), byteStride=rows.itemsize)
    common = {"bufferView": view, "count": 3}
    at = made.view(np.array([2], "<u2").tobytes())
    new = made.view(np.array([[0, 3, 0]], "<f4").tobytes())
    sparse = {
        "count": 1,
        "indices": {"bufferView": at, "componentType": 5123},
        "values": {"bufferView": new},
    }
    made.json["accessors"] = [
        {**common, "componentType": 5126, "type": "VEC3", "sparse": sparse},
        {**common, "componentType": 5120, "type": "VEC3", "byteOffset": 12, "normalized": True},
        {**common, "componentType": 5123, "type": "VEC2", "byteOffset": 16, "normalized": True},
    ]
    attributes = {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}
    made.json["meshes"] = [{"primitives": [{"attributes": attributes}]}]
    shape = read(made).shapes[0]
    assert shape.vertices.tolist() == [[0, 0, 0], [2, 0, 0], [0, 3, 0]]
    assert np.allclose(shape.normals, [[0, 0, 1]] * 3)
    assert shape.uvs.tolist() == [[0, 1], [1, 1], [0, 0]]  # v is counted from below


def test_nodes_are_placed_and_share_arrays(read, build):
    turn = [0, 0, math.sin(math.pi / 4), math.cos(math.pi / 4)]
    matrix = np.array(transforms.translate([0, 0, 5])).T.reshape(-1).tolist()
    made = build(
        nodes=[
            {"children": [1, 2], "translation": [1, 2, 3]},
            {"mesh": 0, "rotation": turn, "scale": [2, 2, 2]},
            {"mesh": 0, "matrix": matrix},
        ]
    )
    first, second, *_ = read(made.mesh()).shapes
    assert first.vertices is second.vertices and first.material is second.material
    assert np.allclose(corners(first)[0], [[1, 2, 3], [1, 4, 3], [-1, 2, 3]])
    assert np.allclose(corners(second)[0], [[1, 2, 8], [2, 2, 8], [1, 3, 8]])


def test_scenes_are_chosen(read, build):
    made = build(
        nodes=[{"mesh": 0}, {"mesh": 0, "translation": [0, 0, 7]}],
        scenes=[{"nodes": [0]}, {"nodes": [1], "name": "other"}],
        scene=1,
    ).mesh()
    assert corners(read(made).shapes[0])[0, 0, 2] == 7
    assert corners(read(made, scene="0").shapes[0])[0, 0, 2] == 0
    with pytest.raises(SceneError, match="no scene 'x'; it has: 0, other"):
        read(made, scene="x")
    with pytest.raises(SceneError, match="no variable 'spp'; known: animation, camera"):
        read(made, spp="4")


def test_flat_and_vanishing_nodes(read, build):
    made = build(nodes=[{"mesh": 0, "scale": [1, 1, 0]}, {"mesh": 0, "scale": [0, 0, 0]}])
    made.json["scenes"] = [{"nodes": [0, 1]}]
    scene = read(made.mesh())
    assert np.allclose(corners(scene.shapes[0])[0, :, 2], 0.0)
    assert any("nodes[1]: not shown" in note for note in scene.warnings)


def test_instances(read, build):
    made = build()
    at = made.accessor([[0, 0, 0], [5, 0, 0]])
    sizes = made.accessor([[1, 1, 1], [2, 1, 1]])
    attributes = {"TRANSLATION": at, "SCALE": sizes}
    instancing = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    made.json["nodes"] = [{"mesh": 0, "translation": [0, 1, 0], "extensions": instancing}]
    low, high = bounds(read(made.mesh()))
    assert np.allclose(low, [0, 1, 0]) and np.allclose(high, [7, 2, 0])


def bounds(scene):
    """Least and largest corner of what the file itself holds."""
    from clpt.scene import studio

    return studio.world_bounds(scene.shapes[: -scene.extra["studio"]["shapes"]])


def animated(build, path, times, values, **sampler):
    """A document whose node 0 is moved by one channel."""
    made = build()
    samplers = [{"input": made.accessor(times), "output": made.accessor(values), **sampler}]
    channels = [{"sampler": 0, "target": {"node": 0, "path": path}}]
    made.json["animations"] = [{"name": "walk", "channels": channels, "samplers": samplers}]
    return made.mesh()


@pytest.mark.parametrize(
    ("how", "values", "at", "expected"),
    [
        ("LINEAR", [[0, 0, 0], [4, 0, 0]], 1.5, 1.0),
        ("LINEAR", [[0, 0, 0], [4, 0, 0]], 9.0, 4.0),
        ("LINEAR", [[1, 0, 0], [4, 0, 0]], 0.0, 1.0),
        ("STEP", [[0, 0, 0], [4, 0, 0]], 2.9, 0.0),
        # p = 0, 4 with tangents 1 and -1 [1/s], a quarter of 2 s on its way.
        (
            "CUBICSPLINE",
            [[9, 0, 0], [0, 0, 0], [1, 0, 0], [-1, 0, 0], [4, 0, 0], [9, 0, 0]],
            1.5,
            2 * 0.140625 * 1 + 0.15625 * 4 - 2 * 0.046875 * -1,
        ),
    ],
)
def test_interpolations(read, build, how, values, at, expected):
    made = animated(build, "translation", [1.0, 3.0], values, interpolation=how)
    assert np.isclose(corners(read(made, time=at).shapes[0])[0, 0, 0], expected, atol=1e-6)


def test_a_shutter_makes_keys(read, build):
    made = animated(build, "translation", [1.0, 3.0], [[0, 0, 0], [4, 0, 0]])
    scene = read(made, time=1.5, shutter="0.5")
    keys = scene.shapes[0].motion
    assert (scene.camera.shutter.open, scene.camera.shutter.close) == (1.5, 2.0)
    assert scene.camera.motion is None and scene.shapes[-1].motion is None
    assert np.allclose(keys.at(1.75)[:3, 3], [1.5, 0, 0]) and keys.times[-1] == 2.0
    assert read(made, time=1.5, shutter=0).shapes[0].motion is None
    with pytest.raises(SceneError, match="shutter -1 s must be from zero"):
        read(made, shutter=-1)
    with pytest.raises(SceneError, match="the shutter 'x' is no number"):
        read(made, shutter="x")


def test_rotations_take_the_shorter_way(read, build):
    turn = [0, 0, -math.sin(math.pi / 4), -math.cos(math.pi / 4)]  # 90 degrees, w below 0
    made = animated(build, "rotation", [0.0, 1.0], [[0, 0, 0, 1], turn])
    along = corners(read(made, time="0.5", animation="walk").shapes[0])[0, 1]
    assert np.allclose(along, [math.sqrt(0.5), math.sqrt(0.5), 0.0], atol=1e-6)
    assert np.allclose(corners(read(made).shapes[0])[0, 1], [1, 0, 0])  # the default pose
    with pytest.raises(SceneError, match="no animation 'run'; it has: walk"):
        read(made, animation="run")
    with pytest.raises(SceneError, match="'soon' is no number"):
        read(made, time="soon")


def pointed(build, *targets, **top):
    """A document whose numbers at JSON pointers go through values from 0 to 1 s."""
    made = build(extensionsUsed=["KHR_animation_pointer", "KHR_lights_punctual"], **top)
    times, channels, samplers = made.accessor([0.0, 1.0]), [], []
    for pointer, values in targets:
        extension = {"KHR_animation_pointer": {"pointer": pointer}}
        channels.append({
            "sampler": len(samplers), "target": {"path": "pointer", "extensions": extension}
        })  # fmt: skip
        samplers.append({"input": times, "output": made.accessor(values)})
    made.json["animations"] = [{"channels": channels, "samplers": samplers}]
    return made.mesh(material=0)


def test_pointers_animate_materials_lights_and_nodes(read, build):
    made = pointed(
        build,
        ("/materials/0/pbrMetallicRoughness/roughnessFactor", [0.0, 1.0]),
        ("/materials/0/emissiveFactor", [[0.0, 0.0, 0.0], [1.0, 0.5, 0.0]]),
        ("/extensions/KHR_lights_punctual/lights/0/intensity", [2.0, 6.0]),
        ("/nodes/0/translation", [[0, 0, 0], [4, 0, 0]]),
        materials=[{"pbrMetallicRoughness": {}}],
        extensions={"KHR_lights_punctual": {"lights": [{"type": "point"}]}},
        nodes=[{"mesh": 0}, {"extensions": {"KHR_lights_punctual": {"light": 0}}}],
        scenes=[{"nodes": [0, 1]}],
    )
    scene = read(made, time=0.25)
    assert not scene.warnings
    assert np.isclose(scene.shapes[0].material.front.roughness, 0.25)
    assert np.allclose(corners(scene.shapes[0])[0, 0], [1, 0, 0])
    brighter = read(made, time=1.0)
    then, now = (one.lights[0].intensity.sample(np.array([550.0])) for one in (scene, brighter))
    assert np.allclose(now, 2.0 * then)
    assert np.allclose(corners(read(made).shapes[0])[0, 0], 0.0)


TEXTURES = (  # that a material does not have
    "normalTexture", "occlusionTexture", "emissiveTexture/extensions/KHR_texture_transform",
    "pbrMetallicRoughness/baseColorTexture", "extensions/KHR_materials_sheen/sheenColorTexture",
    "extensions/KHR_materials_clearcoat/clearcoatNormalTexture",
)  # fmt: skip


@pytest.mark.parametrize(
    ("pointer", "message"),
    [
        ("/nodes/7/translation", "nothing is known to move"),
        ("/materials/9/emissiveFactor", "nothing is known to move"),
        ("/nodes/0/children", "nothing is known to move"),
        ("/accessors/0/count", "nothing is known to move"),
        ("/materials", "nothing is known to move"),
        ("/materials/0/name", "nothing is known to move"),
        *((f"/materials/0/{place}/scale", "nothing is known to move") for place in TEXTURES),
        ("materials/0/emissiveFactor", "is no JSON pointer"),
    ],
)
def test_pointers_to_nothing_are_told(read, build, pointer, message):
    made = pointed(build, (pointer, [[0, 0, 0], [1, 1, 1]]), materials=[{"name": "a"}])
    if pointer.startswith("/"):
        assert message in " ".join(read(made, time=0.5).warnings)
    else:
        with pytest.raises(SceneError, match=message):
            read(made, time=0.5)


def test_morph_targets(read, build):
    made = build()
    targets = [
        {"POSITION": made.accessor([[0, 0, 1]] * 3)},
        {"POSITION": made.accessor([[0, 0, 10]] * 3)},
    ]
    made.mesh(targets=targets)
    made.json["meshes"][0]["weights"] = [1.0, 0.5]
    assert np.allclose(read(made).shapes[0].vertices[:, 2], 6.0)
    made.json["nodes"][0]["weights"] = [0.0, 1.0]
    assert np.allclose(read(made).shapes[0].vertices[:, 2], 10.0)
    weights = made.accessor([0.0, 0.0, 1.0, 0.0])
    samplers = [{"input": made.accessor([0.0, 1.0]), "output": weights}]
    channels = [{"sampler": 0, "target": {"node": 0, "path": "weights"}}]
    made.json["animations"] = [{"channels": channels, "samplers": samplers}]
    assert np.allclose(read(made, time=0.5).shapes[0].vertices[:, 2], 0.5)


def test_skins(read, build):
    made = build(
        nodes=[
            {"mesh": 0, "skin": 0, "translation": [99, 0, 0]},  # which a skin does without
            {"children": [2]},
            {"translation": [0, 1, 0], "rotation": [0, 0, 1, 0]},
        ],
        scenes=[{"nodes": [0, 1]}],
    )
    inverse = np.stack([np.eye(4), transforms.translate([0, -1, 0])])
    matrices = made.accessor(inverse.transpose(0, 2, 1).reshape(2, 16))
    made.json["skins"] = [{"joints": [1, 2], "inverseBindMatrices": matrices}]
    attributes = {
        "JOINTS_0": made.accessor([[0, 0, 0, 0], [1, 0, 0, 0], [0, 1, 0, 0]], "u1"),
        "WEIGHTS_0": made.accessor([[1, 0, 0, 0], [1, 0, 0, 0], [1, 3, 0, 0]]),
        "NORMAL": made.accessor([[1, 0, 0]] * 3),
    }
    vertices = [[0, 0, 0], [1, 2, 0], [0, 2, 1]]
    shape = read(made.mesh(vertices, attributes=attributes)).shapes[0]
    # Joint 1 turns by 180 degrees about the z axis through (0, 1, 0).
    expected = [[0, 0, 0], [-1, 0, 0], [0, 0.25 * 2, 1]]
    assert np.allclose(corners(shape)[0], expected, atol=1e-6)
    assert np.allclose(shape.normals[:2], [[1, 0, 0], [-1, 0, 0]], atol=1e-6)


@pytest.mark.parametrize("sets", [1, 2])
def test_vertices_without_weights_follow_the_first_joint(read, build, sets):
    """They do not leap to the origin, whatever other joints their zero weights name."""
    made = build(nodes=[{"mesh": 0, "skin": 0}, {"translation": [5, 0, 0]}, {}])
    made.json["scenes"] = [{"nodes": [0, 1, 2]}]
    made.json["skins"] = [{"joints": [1, 2]}]
    attributes = {}
    for number in range(sets):
        attributes[f"JOINTS_{number}"] = made.accessor([[1, 1, 1, 1]] * 3, "u1")
        attributes[f"WEIGHTS_{number}"] = made.accessor([[0, 0, 0, 0], [0, 0, 0, 0], [1, 0, 0, 0]])
    scene = read(made.mesh([[1, 0, 0], [2, 0, 0], [3, 0, 1]], attributes=attributes))
    assert np.allclose(corners(scene.shapes[0])[0], [[6, 0, 0], [7, 0, 0], [3, 0, 1]], atol=1e-6)
    assert any("2 vertices have no weights" in warning for warning in scene.warnings)


def test_cameras(read, build):
    perspective = {"yfov": 1.0, "aspectRatio": 0.5, "znear": 0.1}
    orthographic = {"xmag": 4, "ymag": 2, "znear": 0, "zfar": 10}
    made = build(
        cameras=[
            {"type": "perspective", "perspective": perspective},
            {"type": "orthographic", "orthographic": orthographic, "name": "above"},
        ],
        nodes=[
            {"mesh": 0},
            {"camera": 0, "translation": [0, 0, 3], "scale": [5, 5, 5]},
            {"camera": 1},
        ],
        scenes=[{"nodes": [0, 1, 2]}],
    ).mesh()
    scene = read(made)
    assert scene.camera.fov_axis == "y" and np.isclose(scene.camera.fov, math.degrees(1.0))
    assert np.allclose(scene.camera.to_world @ [0, 0, 1, 1], [0, 0, 2, 1])  # looks along -z
    assert np.allclose(scene.camera.to_world @ [1, 0, 0, 0], [-1, 0, 0, 0])
    assert scene.film.width * 2 == scene.film.height
    assert scene.extra["cameras"] == ["perspective", "orthographic above"]
    other = read(made, camera="above")
    assert isinstance(other.camera, cameras.Orthographic)
    assert np.allclose(np.abs(other.camera.to_world[0, 0]), 4.0)
    assert other.film.width == 2 * other.film.height
    with pytest.raises(SceneError, match="no camera '7'; it shows: 0, above"):
        read(made, camera="7")


def test_lights(read, build):
    spot = {"type": "spot", "intensity": 8, "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.5}}
    listed = [
        {"type": "directional", "color": [1, 0.5, 0], "intensity": 2},
        {"type": "point"},
        spot,
    ]
    use = [{"extensions": {"KHR_lights_punctual": {"light": i}}} for i in range(3)]
    use[0]["rotation"] = [0, math.sin(math.pi / 4), 0, math.cos(math.pi / 4)]  # -z to -x
    use[1]["translation"] = [1, 2, 3]
    made = build(
        nodes=[{"mesh": 0}, *use],
        scenes=[{"nodes": [0, 1, 2, 3]}],
        extensions={"KHR_lights_punctual": {"lights": listed}},
    )
    scene = read(made.mesh())
    directional, point, cone = scene.lights
    assert np.allclose(directional.direction, [-1, 0, 0])
    found = directional.irradiance
    lux = spectra.UNIT_LUMINANCE * np.array([found.r, found.g, found.b])
    assert np.allclose(lux, [2, 1, 0])
    assert 2.0**scene.film.display_exposure == pytest.approx(spectra.UNIT_LUMINANCE)
    assert isinstance(point, lights.Point) and np.allclose(point.position, [1, 2, 3])
    assert np.allclose(cone.to_world[:3, 2], [0, 0, -1])
    assert np.isclose(cone.cutoff, math.degrees(0.5)) and np.isclose(
        cone.beam_width, math.degrees(0.1)
    )


def png(pixels) -> bytes:
    made = io.BytesIO()
    Image.fromarray(np.asarray(pixels, np.uint8)).save(made, "png")
    return made.getvalue()


def textured(build, image: bytes, sampler=None, **info):
    """A square with a base colour texture."""
    made = build()
    view = made.view(image)
    made.json["images"] = [{"bufferView": view, "mimeType": "image/png"}]
    made.json["samplers"] = [sampler or {}]
    made.json["textures"] = [{"source": 0, "sampler": 0}]
    colour = {"baseColorTexture": {"index": 0, **info}}
    made.json["materials"] = [{"pbrMetallicRoughness": colour}]
    uvs = {
        "TEXCOORD_0": made.accessor([[0, 1], [1, 1], [1, 0], [0, 0]]),
        "TEXCOORD_1": made.accessor([[0, 0], [2, 2], [2, 0], [0, 2]]),
    }
    fan = made.accessor([0, 1, 2, 3], "u2")
    return made.mesh(SQUARE, attributes=uvs, indices=fan, mode=6, material=0)


def bitmaps(scene):
    """The bitmaps of the first shape's material, by what they are of."""
    from clpt.cli.files.scene_contents import _nested
    from clpt.scene.textures import Bitmap

    return [kind for kind in _nested([scene.shapes[0]]) if isinstance(kind, Bitmap)]


def test_textures(read, build):
    image = png([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [188, 188, 188]]])
    sampler = {"wrapS": 33648, "wrapT": 33071, "magFilter": 9728}
    bitmap = bitmaps(read(textured(build, image, sampler)))[0]
    assert bitmap.image.tolist()[1][1] == [188] * 3 and not bitmap.raw
    assert (bitmap.wrap, bitmap.wrap_v, bitmap.filter) == ("mirror", "clamp", "nearest")
    shape = read(textured(build, image)).shapes[0]
    assert np.allclose(shape.uvs, SQUARE[:, :2])  # upright
    other = read(textured(build, image, texCoord=1)).shapes[0]
    assert np.allclose(other.uvs, [[0, 1], [2, -1], [2, 1], [0, -1]])


def test_texture_transform(read, build):
    """A point of the image stays where the extension puts it, though v runs the other way."""
    image = png(np.zeros((2, 2, 3)))
    transform = {"offset": [0.3, 0.1], "rotation": math.pi / 2, "scale": [0.5, 2.0], "texCoord": 1}
    info = {"texCoord": 0, "extensions": {"KHR_texture_transform": transform}}
    scene = read(textured(build, image, **info))
    found = np.column_stack([scene.shapes[0].uvs, np.ones(4)]) @ bitmaps(scene)[0].to_uv.T
    given = np.array([[0, 0], [2, 2], [2, 0], [0, 2]])
    # (u, v) -> (v, -u): counter-clockwise where v points down.
    u, v = 2.0 * given[:, 1] + 0.3, -0.5 * given[:, 0] + 0.1
    assert np.allclose(found[:, 0], u) and np.allclose(found[:, 1], 1.0 - v)


def test_images_that_cannot_be(read, build):
    bomb = io.BytesIO()
    Image.new("1", (20_000, 20_000)).save(bomb, "png")
    for data, message in {
        bomb.getvalue(): r"images\[0\].*pixels",
        b"GIF89a" + bytes(30): r"images\[0\]: is no PNG, JPEG or WebP",
        png(np.zeros((64, 64, 3)))[:70]: r"images\[0\]: is a broken image",
    }.items():
        with pytest.raises(SceneError, match=message):
            read(textured(build, data))


def test_a_second_set_of_texture_coordinates(read, build):
    """Textures that look at two sets: the first is the mesh's uvs, the second its attributes."""
    made = textured(build, png(np.zeros((2, 2, 3))), texCoord=1)
    made.json["materials"][0]["emissiveTexture"] = {"index": 0}
    made.json["materials"][0]["emissiveFactor"] = [1, 1, 1]
    scene = read(made)
    shape = scene.shapes[0]
    assert np.allclose(shape.uvs, [[0, 1], [2, -1], [2, 1], [0, -1]])
    second = np.concatenate([shape.attributes["vertex_u1"], shape.attributes["vertex_v1"]], axis=1)
    assert np.allclose(second, SQUARE[:, :2])
    assert {bitmap.mapping for bitmap in bitmaps(scene)} == {"uv", "uv1"}
    assert not scene.warnings
