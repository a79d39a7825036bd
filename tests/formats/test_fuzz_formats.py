"""Damaged files of each format end in a result, or an error of one short line.

`python -m tests.formats.fuzz_campaign` reads many more, in processes with limits.
"""

from __future__ import annotations

import pytest

from tests.formats import fuzz_campaign, fuzz_formats

FEW, MORE = 100, 1000


def check(name, folder, numbers) -> None:
    found = {number: fuzz_campaign.outcome(name, number, folder) for number in numbers}
    assert not {n: one for n, one in found.items() if one not in ("read", "refused")}
    assert "refused" in found.values() or name == "mtl"  # else nothing was damaged


@pytest.mark.parametrize("name", fuzz_formats.FORMATS)
def test_whole_files_are_read(tmp_path, name):
    form = fuzz_formats.FORMATS[name]
    for content in fuzz_formats.seeds(name):
        path = tmp_path / f"a{form.suffix}"
        path.write_bytes(content)
        form.read(path)


@pytest.mark.parametrize("name", fuzz_formats.FORMATS)
def test_damaged_files(tmp_path, name):
    check(name, tmp_path, range(FEW))


@pytest.mark.slow
@pytest.mark.parametrize("name", fuzz_formats.FORMATS)
def test_many_damaged_files(tmp_path, name):
    check(name, tmp_path, range(FEW, FEW + MORE))
