"""Devices in processes of their own: what they tell, and how they end."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import pytest

from clpt.bench import apart
from clpt.bench.figures import Figure
from clpt.errors import ClptError
from clpt.files import child_processes

FIGURE = {"part": "rays", "name": "any", "unit": "Mrays/s", "rounds": [1.0, 2.0]}
TELL = f"print({json.dumps(json.dumps({'device': {'device': 'D', 'kind': 'gpu'}}))}); "
TELL += f"print({json.dumps(json.dumps({'figure': FIGURE}))}, flush=True); "


def ended(
    monkeypatch: pytest.MonkeyPatch, code: str, label: str | None = "D", limit: float = 60.0
) -> list[Figure]:
    """The figures of a process that runs some code in the place of what measures."""
    code = f"import os, sys, time; {code}"
    monkeypatch.setattr(child_processes, "command", lambda main, *given: COMMAND(code, *given))
    return [figure for _, figure in apart.measured(3, label, {}, limit)]


COMMAND = child_processes.command


def test_what_a_process_tells(monkeypatch: pytest.MonkeyPatch) -> None:
    code = TELL + "print('{\"end\": true}', flush=True); os.abort()"
    figures = ended(monkeypatch, code)  # what it does after the end counts no more
    assert figures == [Figure("rays", "any", "Mrays/s", (1.0, 2.0))]
    ((about, _),) = apart.measured(3, None, {}, 60.0)
    assert about == {"device": "D", "kind": "gpu"}


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_a_crash_is_a_row(monkeypatch: pytest.MonkeyPatch) -> None:
    code = (
        TELL + "print('the driver is lost', file=sys.stderr, flush=True); os.kill(os.getpid(), 9)"
    )
    first, last = ended(monkeypatch, code)
    assert first.rounds and not first.refused
    assert last.refused == "it died (SIGKILL) after rays any: the driver is lost"
    assert last.part == apart.PART and not last.rounds


def test_a_process_that_stops_early_is_a_row(monkeypatch: pytest.MonkeyPatch) -> None:
    (figure,) = ended(monkeypatch, "raise SystemExit('no memory')")
    assert figure.refused == "it died (status 1) after its start: no memory"


def test_a_process_that_hangs_is_a_row_and_killed(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    began: list[subprocess.Popen] = []
    start = subprocess.Popen

    def noted(*given: object, **named: object) -> subprocess.Popen:
        began.append(start(*given, **named))  # type: ignore[call-overload]
        return began[-1]

    monkeypatch.setattr(apart.subprocess, "Popen", noted)
    (figure,) = ended(monkeypatch, "time.sleep(3600)", limit=0.5)
    assert figure.refused == "it hangs: nothing came for 0.5 s after its start"
    assert began[0].returncode is not None


def test_an_error_of_clpt_is_raised_or_a_row(monkeypatch: pytest.MonkeyPatch) -> None:
    code = 'print(\'{"error": "no kernel was built"}\', flush=True)'
    (figure,) = ended(monkeypatch, code)
    assert figure.refused == "no kernel was built"
    with pytest.raises(ClptError, match="no kernel was built"):
        ended(monkeypatch, code, label=None)
