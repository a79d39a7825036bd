"""Text files in every encoding, and the readers of all formats beside each other."""

from __future__ import annotations

import pytest

from clpt import text
from clpt.errors import SceneError

WORD = "größe 1\n"


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1"])
def test_encodings(tmp_path, encoding):
    data = WORD.encode(encoding)
    assert text.decode(data) == WORD
    assert text.plain(data).endswith(b"e 1\n")
    assert text.decode(text.plain(data)) == WORD
    (tmp_path / "a").write_bytes(WORD.replace("\n", "\r\n").encode(encoding))
    assert text.read(tmp_path / "a") == WORD


def test_utf_16_of_the_other_order():
    data = "\ufeff".encode("utf-16-be") + WORD.encode("utf-16-be")
    assert text.decode(data) == WORD
    assert text.decode(data[:-1])  # cut within a letter: the rest is there
    assert text.plain(b"") == b"" and text.decode(b"") == ""


def test_no_such_file(tmp_path):
    for path in (tmp_path / "no", tmp_path, "a\0b"):
        with pytest.raises(SceneError, match="cannot be read"):
            text.read(path)


def test_decimal_commas():
    assert text.comma_message("1,5 2 3") == (
        "write numbers with a decimal point, not a comma: '1,5 2 3'"
    )
    assert text.comma_message("1, 5") is None
