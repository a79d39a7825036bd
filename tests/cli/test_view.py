"""`clpt view`: one line with the address, and how it ends."""

from __future__ import annotations

import re
import signal
import socket
import subprocess
import sys
import urllib.request
from functools import partial
from pathlib import Path

import pytest

from clpt.__main__ import run
from clpt.view.access import is_loopback

CORNELL = str(Path(__file__).resolve().parents[2] / "scenes" / "cornell_box")


def test_it_prints_one_line_and_ends_by_ctrl_c(tmp_path):
    options = ["--no-browser", "--size", "16x12", "--mode", "rgb", "--quiet", "-o", str(tmp_path)]
    command = [sys.executable, "-m", "clpt", "view", CORNELL, *options]
    heeds = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)  # a background job ignores it
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, preexec_fn=heeds) as process:
        assert process.stdout is not None
        line = process.stdout.readline()
        assert re.fullmatch(r"http://127\.0\.0\.1:\d+/[\w-]{22}/\?token=[\w-]{43}\n", line)
        with urllib.request.urlopen(line.strip()) as answer:
            assert b"<!doctype html>" in answer.read()
        process.send_signal(signal.SIGINT)
        try:
            assert process.wait(60) == 130
        finally:
            process.kill()
        assert process.stdout.read() == ""


def test_bad_input_is_one_line(capsys, tmp_path):
    assert run(["view", str(tmp_path / "nothing.json"), "--no-browser"]) == 2
    assert "there is no such file" in capsys.readouterr().err
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        assert run(["view", CORNELL, "--no-browser", "--port", port]) == 2
    told = capsys.readouterr()
    assert f"cannot listen at 127.0.0.1:{port}" in told.err and told.out == ""


@pytest.mark.parametrize(
    ("host", "alone"),
    [("127.0.0.1", True), ("localhost", True), ("::1", True), ("0.0.0.0", False), ("", False),
     ("192.168.1.2", False), ("example.org", False)],
)  # fmt: skip
def test_which_hosts_are_this_machine_alone(host, alone):
    assert is_loopback(host) is alone
