"""`clpt devices`: the table, JSON, and what it says when nothing fits."""

from __future__ import annotations

import json

from clpt import device
from clpt.__main__ import run


def test_table(capsys):
    assert run(["devices"]) == 0
    out = capsys.readouterr().out
    taken = out.splitlines()[-1]
    assert taken.startswith("Taken: [")
    for info in device.devices():
        assert info.name in out
    assert "works" in out


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
    assert device.devices()[0].name in captured.out
    assert captured.err.startswith("clpt: error: CLPT_DEVICE=no such device is not there; there is")


def test_no_device_at_all(capsys, monkeypatch):
    monkeypatch.setattr(device, "devices", lambda: ())
    assert run(["devices"]) == 2
    assert "pocl-opencl-icd" in capsys.readouterr().err
