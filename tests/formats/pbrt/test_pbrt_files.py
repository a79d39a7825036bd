"""Words and directives of PBRT files: what they mean, and that broken ones say where."""

from __future__ import annotations

import gzip
import time

import pytest

import clpt
from clpt import transforms
from clpt.errors import SceneError
from clpt.formats import load
from clpt.formats.pbrt import reader
from clpt.formats.pbrt.params import Lexer

QUAD = '"point3 P" [0 0 0 1 0 0 1 1 0 0 1 0] "integer indices" [0 1 2 0 2 3]'


@pytest.fixture
def write(tmp_path):
    def of(text, name="scene.pbrt"):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return of


@pytest.fixture
def read(write):
    return lambda text: reader.read(write("WorldBegin\n" + text))


def values(write, text):
    (found,) = Lexer(write(text)).parameters("test")
    return found


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('"float a" 1.5', [1.5]),
        ('"float a" [ 1 -2e3\n+.5 ]', [1, -2000, 0.5]),
        ('"integer a" [1 # one ]\n 2]', [1, 2]),
        ('"point3 a" []', []),
        ('"string a" ["one two" "]"]', ["one two", "]"]),
        ('"bool a" [true false]', [True, False]),
        ('"string a" # a comment\n "x#y"', ["x#y"]),
    ],
)
def test_values(write, text, expected):
    assert list(values(write, text).values) == expected


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('"float a" [1 2', "ends where ']' should follow"),
        ('"float a" [1 two]', "2: expected a number, found 'two'"),
        ('"float a" [1 "two"]', "number, found"),
        ('"float a" [[1]]', "brackets"),
        ('"float a', "does not end on its line"),
        ('"float" 1', "not a type and a name"),
        ('"flaot a" 1', "did you mean 'float'"),
        ('"color a" [1 1 1]', "version 3"),
        ('"float a"', "ends where"),
    ],
)
def test_broken_values_say_where(write, text, message):
    with pytest.raises(SceneError, match=message) as caught:
        values(write, "\n" + text)
    assert "scene.pbrt:2:" in str(caught.value)


def test_numbers_are_read_at_once(write):
    """A million numbers in a second; a number at a time would take several."""
    text = '"float a" [' + "0.123456 " * 1_000_000 + "]"
    path = write(text)
    start = time.process_time()
    (found,) = Lexer(path).parameters("test")
    assert len(found.values) == 1_000_000
    assert time.process_time() - start < 2.0


def test_transforms_come_one_after_the_other(read):
    found = read(
        f'Translate 1 2 3\nRotate 90 0 0 1\nScale 2 3 4\nShape "trianglemesh" {QUAD}\n'
        f"AttributeBegin\nIdentity\nConcatTransform [1 0 0 0 0 1 0 0 0 0 1 0 5 6 7 1]\n"
        f'Shape "trianglemesh" {QUAD}\nAttributeEnd\nShape "trianglemesh" {QUAD}'
    )
    first, second, third = (shape.state.ctm for shape in found.shapes)
    whole = (
        transforms.translate([1, 2, 3])
        @ transforms.rotate([0, 0, 1], 90)
        @ transforms.scale([2, 3, 4])
    )
    assert first == pytest.approx(whole)
    assert second == pytest.approx(transforms.translate([5, 6, 7]))
    assert (third == first).all()


def test_coordinate_systems(write):
    text = (
        'Scale -1 1 1\nLookAt 1 2 3 4 5 6 0 1 0\nCamera "perspective"\nWorldBegin\n'
        f'Translate 1 0 0\nCoordinateSystem "here"\nCoordSysTransform "camera"\n'
        f'Shape "trianglemesh" {QUAD}\nCoordSysTransform "here"\nShape "trianglemesh" {QUAD}\n'
    )
    camera, here = (shape.state.ctm for shape in reader.read(write(text)).shapes)
    placed = transforms.look_at([1, 2, 3], [4, 5, 6], [0, 1, 0]) @ transforms.scale([-1, 1, 1])
    assert camera == pytest.approx(placed)
    assert here == pytest.approx(transforms.translate([1, 0, 0]))


def test_the_state_ends_with_its_scope(read):
    found = read(
        'AttributeBegin\nMaterial "dielectric"\nReverseOrientation\nColorSpace "rec2020"\n'
        'Attribute "shape" "float radius" 2\nAreaLightSource "diffuse"\nShape "sphere"\n'
        'AttributeEnd\nShape "sphere"'
    )
    inside, outside = (shape.state for shape in found.shapes)
    assert inside.material.kind == "dielectric" and outside.material is None
    assert (inside.reverse, outside.reverse) == (True, False)
    assert (inside.colour_space, outside.colour_space) == ("rec2020", "srgb")
    assert inside.area_light is not None and outside.area_light is None
    assert found.shapes[0].params.one("radius", "float", 1.0) == 2.0
    assert found.shapes[1].params.one("radius", "float", 1.0) == 1.0


@pytest.mark.parametrize("which", ["StartTime", "EndTime"])
def test_each_time_has_its_transform(read, which):
    directives = f'ActiveTransform {which}\nTranslate 1 0 0\nActiveTransform All\nShape "sphere"'
    state = read(directives).shapes[0].state
    assert (state.ctm[0, 3], state.end[0, 3]) == ((1, 0) if which == "StartTime" else (0, 1))
    assert state.motion().times == (0.0, 1.0)


def test_files_in_files(write):
    write(f'Translate 1 0 0\nShape "trianglemesh" {QUAD}', "parts/moved one.pbrt")
    packed = gzip.compress(b'Include "moved one.pbrt"\n')
    write(packed, "parts/packed.pbrt.gz")
    text = (
        'WorldBegin\nImport "parts/moved one.pbrt"\nShape "sphere"\n'
        'Include "parts/packed.pbrt.gz"\nShape "sphere"'
    )
    found = reader.read(write(text))
    moved = [shape.state.ctm[0, 3] for shape in found.shapes]
    assert moved == [1.0, 0.0, 1.0, 1.0]  # an Import keeps its changes to itself


def test_parameters_go_on_behind_an_include(write):
    """pbrt reads words from a stack of files, so an Include ends where its words do."""
    write('MakeNamedMedium "smoke" "string type" "homogeneous"\n', "inner.pbrt")
    write('Shape "sphere"\nInclude "inner.pbrt" "rgb sigma_a" [1 2 3]\n# the end', "outer.pbrt")
    text = 'WorldBegin\nInclude "outer.pbrt" "rgb sigma_s" [4 5 6]\nShape "sphere" "float radius" 2'
    contents = reader.read(write(text))
    medium = contents.shared.media["smoke"].params
    assert [parameter.name for parameter in medium.given] == ["type", "sigma_a", "sigma_s"]
    assert [parameter.file.name for parameter in medium.given][1:] == ["outer.pbrt", "scene.pbrt"]
    assert [len(shape.params.given) for shape in contents.shapes] == [0, 1]
    with pytest.raises(SceneError, match=r"scene\.pbrt:2: expected a directive"):  # of an Import
        reader.read(write('WorldBegin\nImport "inner.pbrt" "rgb sigma_a" [1 2 3]'))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("AttributeBegin", "AttributeBegin at scene.pbrt:2 has no end"),
        ("AttributeEnd", "2: AttributeEnd: no AttributeBegin"),
        ("ObjectBegin \"a\"\nAttributeEnd", "3: .*must end first"),
        ("ObjectInstance \"a\"\nShpae \"sphere\"", "3: unknown directive 'Shpae'.*'Shape'"),
        ("Include \"scene.pbrt\"", "includes itself"),
        ("Include \"none.pbrt\"", "no file 'none.pbrt'"),
        (f"Include \"{'x' * 300}\"", "(?i)file name too long"),
        ("Camera \"perspective\"", "before WorldBegin"),
        ("Rotate 1 0 0 0", "Rotate: rotate: the axis has no length"),
        ("Scale 1 1", "ends where a number"),
        ("Transform [1 2 3]", "needs 16 numbers, not 3"),
        ("Translate nan 0 0", "finite"),
        ("CoordSysTransform \"nowhere\"", "no coordinate system"),
        ("MakeNamedMaterial \"a\"", "needs the parameter 'string type'"),
        ("42", "expected a directive"),
        ("\"float", "does not end"),
    ],
)  # fmt: skip
def test_broken_files_say_where(read, text, message):
    with pytest.raises(SceneError, match=message) as caught:
        read(text)
    assert "scene.pbrt" in str(caught.value)


def test_what_must_be_in_the_world(write):
    with pytest.raises(SceneError, match="1: Shape: must come after WorldBegin"):
        reader.read(write('Shape "sphere"'))
    with pytest.raises(SceneError, match="has no WorldBegin"):
        reader.read(write("# nothing\n"))


def test_gzip_bombs_and_doubling_includes_end(write):
    bomb = write(gzip.compress(b" " * (2 << 20)), "bomb.pbrt.gz")
    with pytest.raises(SceneError, match="unpacking it would take"):
        clpt.load(bomb, budget=clpt.Budget(memory=1 << 20))
    for i in range(12):
        write(f'Include "{i + 1}.pbrt"\n' * 2, f"{i}.pbrt")
    write("", "12.pbrt")
    with pytest.raises(SceneError, match="more than 1000 parts, most of them repeated"):
        clpt.load(write('WorldBegin\nInclude "0.pbrt"'), budget=clpt.Budget(parts=1000))


def test_formats(write, tmp_path):
    text = f"Film \"rgb\" \"integer xresolution\" 7 \"integer yresolution\" 5\nWorldBegin\n" \
        f"Shape \"trianglemesh\" {QUAD}\n"  # fmt: skip
    write(text)
    assert load(tmp_path).film.width == 7
    assert load(write(gzip.compress(text.encode()), "other.pbrt.gz")).film.height == 5


def test_progress(write):
    told = []
    path = write("WorldBegin\n" + 'Shape "sphere"\n' * 4)
    load(path, progress=lambda fraction, what: told.append((fraction, what)))
    assert [fraction for fraction, _ in told] == [0.25, 0.5, 0.75, 1.0]
    assert told[1][1] == "2 of 4 shapes"


MISSING = {
    "a texture": 'Texture "t" "spectrum" "imagemap" "string filename" "t.png"\n'
    'Material "diffuse" "texture reflectance" "t"\nShape "sphere"',
    "a mesh": 'Shape "plymesh" "string filename" "m.ply"',
    "a sky": 'LightSource "infinite" "string filename" "sky.exr"',
    "a lamp": 'LightSource "goniometric" "string filename" "lamp.exr"',
}


@pytest.mark.parametrize("first", MISSING)
def test_all_missing_files_are_named(tmp_path, first):
    """At the place of one of them."""
    path = tmp_path / "scene.pbrt"
    path.write_text(f"WorldBegin\n{MISSING[first]}\n")
    with pytest.raises(SceneError, match=r"scene\.pbrt:2: .*there is no file '[a-z.]*'$"):
        load(path)
    path.write_text("WorldBegin\n" + "\n".join(MISSING.values()))
    with pytest.raises(SceneError, match=r"scene\.pbrt:\d: .*there is no file") as raised:
        load(path)
    for name in ("t.png", "m.ply", "sky.exr", "lamp.exr"):
        assert str(raised.value).count(f"'{name}'") == 1


def test_meshes_have_names(tmp_path):
    """The file and the line, for warnings of what is found when the scene is rendered."""
    path = tmp_path / "scene.pbrt"
    path.write_text(
        'WorldBegin\nShape "sphere"\nShape "trianglemesh" "point3 P" [0 0 0 1 0 0 0 1 0]'
    )
    assert [shape.name for shape in load(path).shapes] == ["scene.pbrt:2", "scene.pbrt:3"]
