"""Text files in every encoding, and the readers of all formats beside each other."""

from __future__ import annotations

import pytest

from clpt import spectra
from clpt.errors import SceneError
from clpt.files import input_files
from clpt.formats import load
from clpt.formats.ies import read as read_ies
from clpt.formats.meshes.spheres_curves import read_strands

WORD = "größe 1\n"


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1"])
def test_encodings(tmp_path, encoding):
    data = WORD.encode(encoding)
    assert input_files.decode(data) == WORD
    assert input_files.plain(data).endswith(b"e 1\n")
    assert input_files.decode(input_files.plain(data)) == WORD
    (tmp_path / "a").write_bytes(WORD.replace("\n", "\r\n").encode(encoding))
    assert input_files.read(tmp_path / "a") == WORD


def test_utf_16_of_the_other_order():
    data = "\ufeff".encode("utf-16-be") + WORD.encode("utf-16-be")
    assert input_files.decode(data) == WORD
    assert input_files.decode(data[:-1])  # cut within a letter: the rest is there
    assert input_files.plain(b"") == b"" and input_files.decode(b"") == ""


def test_no_such_file(tmp_path):
    for path in (tmp_path / "no", tmp_path, "a\0b"):
        with pytest.raises(SceneError, match=r"cannot be read|is a folder"):
            input_files.read(path)


def test_decimal_commas():
    assert input_files.comma_message("1,5 2 3") == (
        "write numbers with a decimal point, not a comma: '1,5 2 3'"
    )
    assert input_files.comma_message("1, 5") is None


PBRT = 'Camera "perspective" # größe\nWorldBegin\nShape "sphere" "float radius" 2\n'
IES = "IESNA:LM-63-1995\n[MANUFAC] größe\nTILT=NONE\n1 1000 1 2 1 1 2 0 0 0\n1 1 10\n0 90\n0\n5 5\n"
JSON = '{"camera": {"type": "perspective"}, "shapes": [{"type": "sphere", "name": "größe"}]}'
JSON = '{"camera": {"type": "perspective"}, "shapes": [{"type": "sphere", "name": "größe"}]}'
READERS = {
    "a.pbrt": (PBRT, lambda path: load(path).shapes[0].radius, 2),
    "a.json": (JSON, lambda path: load(path).shapes[0].name, "größe"),
    "a.spd": ("# größe\n400 1\n700 2\n", lambda path: spectra.read_table(path).values[1], 2),
    "a.ies": (IES, lambda path: read_ies(path).candela[0, 0], 5),
    "a.txt": ("0 0 0 1\n1 0 0 1\n", lambda path: read_strands(path)["points"][1, 0], 1),
}


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1"])
@pytest.mark.parametrize("name", READERS)
def test_readers(tmp_path, name, encoding):
    content, read, value = READERS[name]
    (tmp_path / name).write_bytes(content.encode(encoding))
    assert read(tmp_path / name) == value


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1"])
def test_xml_has_the_encoding_that_it_declares(tmp_path, encoding):
    declared = encoding.removesuffix("-sig")
    content = f'<?xml version="1.0" encoding="{declared}"?><scene version="3.0.0">'
    content += '<shape type="sphere" id="größe"/></scene>'
    (tmp_path / "a.xml").write_bytes(content.encode(encoding))
    assert load(tmp_path / "a.xml").shapes[0].name == "größe"


@pytest.mark.parametrize(
    ("name", "content", "line"),
    [
        ("a.pbrt", 'WorldBegin\nShape "sphere" "float radius" [ 1,5 ]\n', 2),
        ("a.txt", "0 0 0 1\n0 1,5 0 1\n", 2),
        ("a.spd", "400 1\n500 1,5\n", 2),
    ],
)
def test_readers_refuse_decimal_commas(tmp_path, name, content, line):
    (tmp_path / name).write_text(content)
    read = {"a.txt": read_strands, "a.spd": spectra.read_table}.get(name, load)
    with pytest.raises(
        SceneError, match="write numbers with a decimal point, not a comma"
    ) as caught:
        read(tmp_path / name)
    assert caught.value.line == line
