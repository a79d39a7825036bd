"""How much memory is free, in a container too."""

from __future__ import annotations

import pytest

from clpt.files import budget

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
    assert budget.free_memory(tmp_path) == 100 + 2**20
    (tmp_path / limit).write_text("max\n")
    assert budget.free_memory(tmp_path) == budget.free_memory(tmp_path / "none")


@pytest.mark.parametrize("held_by", ["", "job", "job/step"])
@pytest.mark.parametrize(
    ("rows", "tree", "limit", "usage", "inactive"),
    [
        ("0::/job/step/task", "", "memory.max", "memory.current", "inactive_file"),
        ("12:pids:/\n3:memory:/job/step/task\n0::/", "memory", "memory.limit_in_bytes",
         "memory.usage_in_bytes", "total_inactive_file"),
        ("3:cpu,memory:/job/step/task", "cpu,memory", "memory.limit_in_bytes",
         "memory.usage_in_bytes", "total_inactive_file"),
    ],
)  # fmt: skip
def test_limits_of_all_groups_that_hold_the_process_count(
    tmp_path, held_by, rows, tree, limit, usage, inactive
):
    """As of a job of Slurm, or a unit of systemd, without a namespace of its own."""
    (tmp_path / "own").write_text(rows + "\n")
    group = tmp_path / "groups" / tree / held_by
    group.mkdir(parents=True)
    for name, content in ((limit, GIB), (usage, GIB - 500), ("memory.stat", f"{inactive} 100")):
        (group / name).write_text(f"{content}\n")
    assert budget.free_memory(tmp_path / "groups", tmp_path / "own") == 600
