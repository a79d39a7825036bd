"""What a load takes: one budget, and files that would take more end in one line, and soon."""

from __future__ import annotations

import sys

import pytest
from click.testing import CliRunner

import clpt
from clpt.cli import cli
from clpt.errors import LONGEST, SceneError
from clpt.files import budget
from tests.formats import bombs

LONG = (  # to make, or to end
    "xml_serialized", "xml_same_mesh", "npz_zeros", "ply_gzip", "nvdb_packed", "pbrt_gzip",
    "pbrt_gzip_that_lies", "pbrt_numbers",
)  # fmt: skip


def check(names, folder, seconds: int = bombs.SECONDS) -> None:
    files = []
    for name in names:
        (folder / name).mkdir()
        files.append(bombs.BOMBS[name](folder / name))
    for name, made in zip(names, bombs.read_within(files, seconds=seconds), strict=True):
        assert made["kind"] in ("SceneError", "UnknownKindError"), (name, made)
        assert len(made["message"]) <= LONGEST and made["message"].isprintable(), (name, made)
        assert str(folder / name) in made["message"], (name, made)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="limits of Linux's processes")
def test_bombs_end_in_one_line(tmp_path):
    """Within a gibibyte and ten seconds of the processor, which the process has and no more."""
    check([name for name in bombs.BOMBS if name not in LONG], tmp_path)


@pytest.mark.slow
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="limits of Linux's processes")
def test_bombs_that_take_long(tmp_path):
    """Within a gibibyte and thirty seconds: numbers of text fill the memory in about ten."""
    check(LONG, tmp_path, seconds=30)


def test_a_budget_is_of_a_whole_load(tmp_path):
    """Each of its files is small enough; together they are not."""
    points = "".join(f"v {i} {i % 7} 0\n" for i in range(4000))
    mesh = points + "".join(f"f {i} {i + 1} {i + 2}\n" for i in range(1, 3998))
    shapes = []
    for i in range(4):
        (tmp_path / f"{i}.obj").write_text(mesh)
        shapes.append(f'<shape type="obj"><string name="filename" value="{i}.obj"/></shape>')
    path = tmp_path / "a.xml"
    path.write_text(f'<scene version="3.0.0">{"".join(shapes)}</scene>')
    clpt.load(path, budget=clpt.Budget(memory=3 << 20))
    with pytest.raises(SceneError, match=r"\d\.obj: .* the limit is 1\.0 MiB"):
        clpt.load(path, budget=clpt.Budget(memory=1_000_000))


def test_a_load_ends_after_its_seconds(tmp_path):
    path = tmp_path / "a.xml"
    path.write_text('<scene version="3.0.0">' + '<shape type="sphere"/>' * 100 + "</scene>")
    with pytest.raises(SceneError, match="takes more than 1e-09 s: if you trust the file, raise"):
        clpt.load(path, budget=clpt.Budget(seconds=1e-9))


def test_what_a_file_holds_itself_is_no_matter(tmp_path):
    """More parts than any load may have, each written out."""
    path = tmp_path / "a.xml"
    count = budget.PARTS + 1000
    path.write_text(
        '<scene version="3.0.0">' + "<default name='a' value='b'/>" * count + "</scene>"
    )
    assert not clpt.load(path).shapes


@pytest.mark.parametrize("name", ["memory", "seconds", "parts"])
def test_a_budget_of_nothing_is_refused(name):
    with pytest.raises(SceneError, match=f"a budget's {name} must be above 0, not 0"):
        clpt.Budget(**{name: 0})


def test_errors_are_short_lines():
    text = "a\nb\x00" + "c" * 3_000_000
    error = SceneError(text, file="/" + "d" * 5000, where="e" * 5000, line=7)
    assert len(str(error)) <= LONGEST and str(error).isprintable()
    assert ":7: " in str(error) and ": a b ccc" in str(error)


def test_the_command_line_raises_what_a_load_may_take(tmp_path):
    path = tmp_path / "a.xml"
    path.write_text('<scene version="3.0.0"><shape type="sphere"/></scene>')
    told = CliRunner().invoke(cli, ["info", str(path), "--load-parts", "1"])
    assert isinstance(told.exception, SceneError) or told.exit_code == 2
    assert "raise --load-parts or clpt.Budget(parts=...)" in str(told.exception) + told.output
    assert CliRunner().invoke(cli, ["info", str(path)]).exit_code == 0
