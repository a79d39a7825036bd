"""The entry point: one line and a status, whatever happens."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import click
import platformdirs
import pytest

from clpt import __main__ as entry
from clpt import cli
from clpt.errors import SceneError

INTERRUPTED = "clpt: error: interrupted\n"


def of(error: BaseException, cause: BaseException) -> BaseException:
    """The error, with its cause: an import in C that a signal ends is an ImportError."""
    error.__cause__ = cause
    return error


@pytest.fixture
def failing(monkeypatch):
    """Make the command `fail` of the command line raise something."""

    def install(error: BaseException) -> None:
        @click.command()
        def fail() -> None:
            raise error

        monkeypatch.setattr(cli._Commands, "get_command", lambda self, ctx, name: fail)

    return install


@pytest.mark.parametrize(
    ("error", "status", "line"),
    [
        (SceneError("no shape", file="a.xml", line=3), 2, "clpt: error: a.xml:3: no shape\n"),
        (SceneError("two\nlines"), 2, "clpt: error: two lines\n"),
        (click.UsageError("what?"), 2, "clpt: error: what?\n"),
        (KeyboardInterrupt(), 130, INTERRUPTED),
        (KeyboardInterrupt(signal.SIGTERM), 143, INTERRUPTED),
        (of(ImportError("initialization failed"), KeyboardInterrupt()), 130, INTERRUPTED),
        (of(SceneError("no"), of(OSError(), KeyboardInterrupt(signal.SIGTERM))), 143, INTERRUPTED),
    ],
)
def test_status_and_line(failing, capsys, error, status, line):
    failing(error)
    assert entry.run(["fail"]) == status
    assert capsys.readouterr().err.lstrip("\n") == line


def test_a_fault_of_our_own_keeps_its_traceback(failing, capsys, monkeypatch, tmp_path):
    monkeypatch.setattr(platformdirs, "user_log_dir", lambda *a, **k: str(tmp_path / "log"))
    failing(ZeroDivisionError("division by zero"))
    assert entry.run(["fail"]) == 1
    err = capsys.readouterr().err
    assert err.startswith("clpt: error: ZeroDivisionError: division by zero (a fault of clpt")
    assert err.count("\n") == 1
    assert "raise error" in (tmp_path / "log" / "traceback.txt").read_text()


def test_help_and_unknown_commands(capsys):
    assert entry.run([]) == 0
    assert "devices" in capsys.readouterr().out
    assert entry.run(["unknown"]) == 2
    told = capsys.readouterr().err
    assert told.startswith("clpt: error: there is no command 'unknown'; known: bench, cluster, ")
    assert told.count("\n") == 1
    assert entry.run(["devices", "--colour"]) == 2
    assert "--colour" in capsys.readouterr().err


IMPORTING = """
import signal, sys
import clpt_command
class Presses:
    def find_spec(self, name, path=None, target=None):
        if name == "clpt.cli.process":
            signal.raise_signal(signal.SIGINT)
sys.meta_path.insert(0, Presses())
signal.signal(signal.SIGINT, signal.default_int_handler)
sys.argv[1:] = ["devices"]
clpt_command.main()
"""


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_ctrl_c_while_everything_is_imported():
    root = Path(__file__).resolve().parents[1]
    command = [sys.executable, "-c", IMPORTING]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (-signal.SIGINT, "", "")


def test_the_list_of_commands_has_their_own_words():
    with click.Context(cli.cli) as context:
        for name, words in cli.COMMANDS.items():
            command = cli.cli.get_command(context, name)
            assert click.Command(name, help=words).get_short_help_str(300) == words
            assert command.get_short_help_str(300).rstrip(".") == words.rstrip("."), name


@pytest.mark.parametrize("option", ["--help", "--version"])
def test_what_needs_no_packages_imports_none(option):
    code = """
import sys
from clpt.__main__ import run
assert run(sys.argv[1:]) == 0
assert not {"numpy", "pyopencl", "OpenEXR", "rich"} & sys.modules.keys()
"""
    done = subprocess.run([sys.executable, "-c", code, option], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_help_of_a_render_opens_no_renderer():
    code = """
import sys
from clpt.__main__ import run
assert run(["render", "--help"]) == 0 and run(["render", "nothing.json"]) == 2
assert not {"clpt.render.renderer", "clpt.cluster", "rich"} & sys.modules.keys()
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_side_tools_do_not_weigh_on_a_render(tmp_path):
    """Mie's series, tev, plots, the page and the cluster load when they are asked."""
    code = """
import sys
from clpt.__main__ import run
assert run(sys.argv[1:]) == 0
side = ("clpt.mie", "clpt.images.tev", "clpt.cli.plots", "clpt.view")
side += ("clpt.cluster", "clpt.bench", "clpt.testing", "matplotlib", "scipy", "trimesh")
side += ("dask", "IPython")
assert "clpt.render.renderer" in sys.modules and not {*side} & sys.modules.keys()
"""
    given = [
        "render",
        str(Path(__file__).parents[1] / "scenes/cornell_box"),
        "--size",
        "16x16",
        "--spp",
        "1",
    ]
    given += ["-o", str(tmp_path / "a.exr")]
    done = subprocess.run([sys.executable, "-c", code, *given], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
