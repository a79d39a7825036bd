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
from clpt.cli.view import page, view
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


@pytest.mark.parametrize(
    ("options", "said"),
    [([], "opens in your browser; Ctrl-C ends it\n"),
     (["--no-browser"], "open this address in a browser; Ctrl-C ends it\n"), (["--quiet"], "")],
)  # fmt: skip
def test_it_says_how_it_ends(options, said, capsys, monkeypatch):
    class Ended(Exception):
        """Stands for all that follows the address."""

    def fail(*others):
        raise Ended

    monkeypatch.setattr(page, "open_scene", fail)
    monkeypatch.setattr(page.webbrowser, "open", lambda address: True)
    with pytest.raises(Ended):
        view.main([CORNELL, *options], standalone_mode=False)
    told = capsys.readouterr()
    assert told.out.startswith("http://127.0.0.1:") and told.err == said


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
