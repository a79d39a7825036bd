"""`clpt devices`: the table, JSON, and what it says when nothing fits."""

from __future__ import annotations

import dataclasses
import io
import json

from rich.console import Console

from clpt import device
from clpt.__main__ import run
from clpt.cli.devices import table
from clpt.cli.display import device_name


def test_table(capsys):
    assert run(["devices"]) == 0
    out = capsys.readouterr().out
    taken = out.splitlines()[-1]
    assert taken.startswith("Taken: [")
    for info in device.devices():
        assert device_name(info) in out
    assert "works" in out
    assert run(["devices", "-v"]) == 0
    out = capsys.readouterr().out
    for info in device.devices():
        assert info.name in out and info.driver in out


def test_it_fits_a_terminal():
    """Of 80 columns, with devices of long names."""
    infos = [
        dataclasses.replace(device.devices()[0], index=index, platform=platform, name=name)
        for index, (platform, name) in enumerate(
            [
                (
                    "Portable Computing Language",
                    "cpu-znver3-AMD EPYC 7B13 64-Core Processor",
                ),
                ("Intel(R) OpenCL", "Intel(R) Xeon(R) Platinum 8481C CPU @ 2.70GHz"),
                ("NVIDIA CUDA", "NVIDIA GeForce RTX 4090 Laptop GPU"),
            ]
        )
    ]
    console = Console(file=io.StringIO(), width=80)
    console.print(table(tuple(infos), dict.fromkeys(range(3)), 0))
    assert console.file.getvalue().count("\n") == 1 + len(infos)


def test_json(capsys):
    assert run(["devices", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    there = device.devices()
    assert [row["name"] for row in told["devices"]] == [info.name for info in there]
    assert told["taken"] in range(len(there))
    assert told["devices"][told["taken"]]["failure"] is None


def test_a_name_that_is_not_there(capsys, monkeypatch):
    monkeypatch.setenv("CLPT_DEVICE", "no such device")
    assert run(["devices"]) == 2
    captured = capsys.readouterr()
    assert device_name(device.devices()[0]) in captured.out
    assert captured.err.startswith("clpt: error: CLPT_DEVICE=no such device is not there; there is")


def test_no_device_at_all(capsys, monkeypatch):
    monkeypatch.setattr(device, "devices", lambda: ())
    assert run(["devices"]) == 2
    assert "pocl-opencl-icd" in capsys.readouterr().err
