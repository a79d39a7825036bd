"""How much memory is free, in a container too."""

from __future__ import annotations

import pytest

from clpt import host_memory

GIB = 2**30


@pytest.mark.parametrize(
    ("limit", "usage", "inactive"),
    [
        ("memory.max", "memory.current", "inactive_file"),
        ("memory/memory.limit_in_bytes", "memory/memory.usage_in_bytes", "total_inactive_file"),
    ],
)
def test_pages_of_files_do_not_count_as_used(tmp_path, monkeypatch, limit, usage, inactive):
    """The kernel gives them up when a process asks for memory."""
    (tmp_path / limit).parent.mkdir(exist_ok=True)
    (tmp_path / limit).write_text(f"{GIB}\n")
    (tmp_path / usage).write_text(f"{GIB - 100}\n")
    stat = (tmp_path / usage).with_name("memory.stat")
    stat.write_text(f"anon 5\n{inactive} {2**20}\nactive_file 7\n")
    assert host_memory.available(tmp_path) == 100 + 2**20
    (tmp_path / limit).write_text("max\n")
    assert host_memory.available(tmp_path) == host_memory.available(tmp_path / "none")
