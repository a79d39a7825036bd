"""As many random scenes as wanted: each is refused in words, or all its programs compile.

    python -m tests.together.sweep --scenes 20000 --seed 1 --output sweep.jsonl

Each scene has a seed of its own. A line of the output is a block of scenes: what was drawn, refused
by which rule, how many programs there were and how many were new, and what failed; a sweep goes on
behind the lines that its output has. A failure is written once, as the smallest scene that has it.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import random
import re
import sys
import traceback
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

from clpt.errors import SceneError
from clpt.render.flow.check import check
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Scene
from tests.front_end import CLANG, errors
from tests.together.builds import Way, texts
from tests.together.strategies import scene_of, shown, way_of

BLOCK = 200  # scenes
TRIES = 300  # scenes that are tried for a smaller one


class Choices:
    """Numbers that choose a scene: those given, then others by chance, or 0. Keeps them."""

    def __init__(self, given: list[int], more: random.Random | None = None):
        self.given, self.more, self.made = given, more, list[int]()

    def __call__(self, most: int) -> int:
        at = len(self.made)
        if at < len(self.given):
            number = min(self.given[at], most)
        else:
            number = self.more.randint(0, most) if self.more else 0
        self.made.append(number)
        return number


def drawn(choose: Callable[[int], int]) -> tuple[Scene, Way]:
    """A scene, and a way in which a device renders it."""
    way = way_of(choose)
    return scene_of(choose), way


def attempt(scene: Scene, way: Way) -> tuple[str, list[str]]:
    """The rule that refuses a scene and no texts; or how it fails; or "" and its texts."""
    try:
        check(scene)
    except SceneError as error:
        return f"refused: {re.sub(r'[0-9.]+', 'n', error.message)[:80]}", []
    except Exception as error:
        return _failure(error), []
    try:
        return "", texts(lower(scene).features, way)
    except Exception as error:  # what `check` has let pass is not refused any more
        return _failure(error), []


def _failure(error: Exception) -> str:
    last = traceback.extract_tb(error.__traceback__)[-1]
    place = "/".join(Path(last.filename).parts[-3:])
    return f"failed: {type(error).__name__} at {place}:{last.lineno}: {error}"[:200]


def kind_of(error: str) -> str:
    """The first error of clang's, without what differs between scenes."""
    first = next((row for row in error.splitlines() if "error:" in row), error[:200])
    return f"failed: {re.sub(r':[0-9]+:', ':', first)}"[:200]


def kinds_of(scene: Scene, way: Way) -> set[str]:
    """All the ways in which a scene fails."""
    what, programs = attempt(scene, way)
    found = {kind_of(error) for error in errors(programs) if error}
    return found | ({what} if what.startswith("failed") else set())


def smallest(choices: list[int], what: str) -> list[int]:
    """Choices as small as they get, of a scene that still fails in that way."""
    tried: set[tuple[int, ...]] = set()

    def smaller(given: list[int]) -> list[int]:
        """What a scene of these choices is made of if it fails, nothing if not or if tried."""
        if tuple(given) in tried or len(tried) >= TRIES:
            return []
        tried.add(tuple(given))
        made = Choices(given)
        try:
            fails = what in kinds_of(*drawn(made))
        except SceneError:  # of a part that nobody can make
            return []
        found = made.made
        while found and found[-1] == 0:
            found.pop()
        return found if fails and (len(found), found) < (len(choices), choices) else []

    before: list[int] = []
    while before != choices:
        before = choices
        for size in (64, 32, 16, 8, 4, 2, 1):
            at = 0
            while at < len(choices):
                head, span, tail = choices[:at], choices[at : at + size], choices[at + size :]
                zeros, lower = [0] * len(span), [max(n - 1, 0) for n in span]
                for instead in ([], zeros, lower):
                    found = smaller([*head, *instead, *tail])
                    if found:
                        choices = found
                        break
                else:
                    at += size
    return choices


def block(first: int, count: int, known: set[bytes]) -> dict[str, Any]:
    """Draw scenes of these seeds; return the counts of what became of them, and what failed."""
    found: Counter = Counter()
    new: dict[bytes, str] = {}
    owners: dict[bytes, list[int]] = {}
    failures: dict[str, list[int]] = {}
    made = 0
    for seed in range(first, first + count):
        choices = Choices([], random.Random(seed))
        what, programs = attempt(*drawn(choices))
        found[what or "built"] += 1
        if what.startswith("failed"):
            failures.setdefault(what, choices.made)
        made += len(programs)
        for text in programs:
            digest = hashlib.blake2b(text.encode(), digest_size=16).digest()
            if digest not in known:
                known.add(digest)
                new[digest], owners[digest] = text, choices.made
    for digest, error in zip(new, errors(new.values()), strict=True):
        if error:
            found[kind_of(error)] += 1
            failures.setdefault(kind_of(error), owners[digest])
    return {"found": found, "texts": made, "distinct": len(new), "failures": failures}


def seconds() -> float:
    """Processor time, of clang too."""
    return sum(os.times()[:4])


def main() -> int:
    """Sweep; 1 where a scene failed."""
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("--scenes", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1, help="of the first scene")
    parser.add_argument("--output", type=Path, help="JSON lines; a sweep goes on behind them")
    parser.add_argument("--no-shrink", action="store_true", help="do not look for smaller scenes")
    given = parser.parse_args()
    if CLANG is None:
        sys.exit("clang is not installed")
    rows: list[dict[str, Any]] = []
    if given.output and given.output.exists():
        rows = [json.loads(row) for row in given.output.read_text().splitlines()]
    known: set[bytes] = set()
    shrunk = {what for row in rows for what in row["failures"]}
    for first in range(given.seed + BLOCK * len(rows), given.seed + given.scenes, BLOCK):
        start = seconds()
        row = block(first, min(BLOCK, given.seed + given.scenes - first), known)
        row = {"seed": first, "seconds": round(seconds() - start, 2), **row}
        for what, choices in row["failures"].items():
            if what not in shrunk and not given.no_shrink:
                row["failures"][what] = choices = smallest(choices, what)
            if what not in shrunk:
                scene, way = drawn(Choices(choices))
                print(f"{what}\n{way}\n{shown(scene)}", flush=True)
            shrunk.add(what)
        rows.append(row)
        if given.output:
            with given.output.open("a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")
    total: Counter = sum((Counter(row["found"]) for row in rows), Counter())
    sizes = {name: sum(row[name] for row in rows) for name in ("seconds", "texts", "distinct")}
    print(json.dumps({**sizes, **dict(total.most_common())}, indent=1))
    return int(any(what.startswith("failed") for what in total))


if __name__ == "__main__":
    sys.exit(main())
