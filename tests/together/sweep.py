"""As many random scenes as wanted: each is refused in words, or all its programs compile.

    python -m tests.together.sweep --scenes 20000 --seed 1 --output sweep.jsonl

Scenes are drawn in blocks of BLOCK, each from a seed of its own, so a sweep goes on where its
output ends. A line of the output is a block: what was drawn, refused by which rule, how many texts
were new, and what failed. A failure's smallest scene is printed and written once.
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import json
import re
import sys
import time
import traceback
from collections import Counter
from pathlib import Path
from typing import Any

import hypothesis

from clpt.errors import SceneError
from clpt.render.lowering.scene import lower
from clpt.scene import Scene
from tests.front_end import CLANG, errors
from tests.together.builds import Way, texts
from tests.together.strategies import WAYS, scenes, shown

BLOCK = 100  # scenes
SHRINKING = 400  # scenes that are tried for a smaller one
QUIET: dict[str, Any] = {
    "deadline": None,
    "database": None,
    "print_blob": False,
    "report_multiple_bugs": False,
    "suppress_health_check": list(hypothesis.HealthCheck),
}


class Failed(Exception):
    """A scene fails as another one did."""


def attempt(scene: Scene, way: Way) -> tuple[str, list[str]]:
    """The rule that refuses a scene and no texts; or how it fails; or "" and its texts."""
    try:
        return "", texts(lower(scene).features, way)
    except SceneError as error:
        return f"refused: {re.sub(r'[0-9.]+', 'n', error.message)[:80]}", []
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        place = "/".join(Path(last.filename).parts[-3:])
        return f"failed: {type(error).__name__} at {place}:{last.lineno}: {error}"[:200], []


def kind_of(error: str) -> str:
    """The first error of clang's, without what differs between scenes."""
    first = next((row for row in error.splitlines() if "error:" in row), error[:200])
    return f"failed: {re.sub(r':[0-9]+:', ':', first)}"[:200]


def block(seed: int, count: int, known: set[bytes]) -> tuple[Counter, dict[str, int], list[Any]]:
    """Draw scenes; return counts of what became of them, of texts, and the failures."""
    found: Counter = Counter()
    new: dict[bytes, str] = {}
    owners: dict[bytes, tuple[Scene, Way]] = {}
    failures: list[tuple[str, Scene, Way]] = []
    made = 0

    @hypothesis.seed(seed)
    @hypothesis.settings(max_examples=count, phases=[hypothesis.Phase.generate], **QUIET)
    @hypothesis.given(scenes(), WAYS)
    def draw(scene: Scene, way: Way) -> None:
        nonlocal made
        what, programs = attempt(scene, way)
        found[what or "built"] += 1
        if what.startswith("failed"):
            failures.append((what, scene, way))
        made += len(programs)
        for text in programs:
            digest = hashlib.blake2b(text.encode(), digest_size=16).digest()
            if digest not in known:
                known.add(digest)
                new[digest] = text
                owners[digest] = scene, way

    draw()
    for digest, error in zip(new, errors(new.values()), strict=True):
        if error:
            failures.append((kind_of(error), *owners[digest]))
            found[kind_of(error)] += 1
    return found, {"texts": made, "distinct": len(new)}, failures


def smallest(seed: int, count: int, what: str) -> str:
    """The smallest scene that fails in that way, of a block's; as Python has it."""
    last = ""

    @hypothesis.seed(seed)
    @hypothesis.settings(
        max_examples=count,
        phases=[hypothesis.Phase.generate, hypothesis.Phase.shrink],
        **QUIET,
    )
    @hypothesis.given(scenes(), WAYS)
    def shrink(scene: Scene, way: Way) -> None:
        nonlocal last
        result, programs = attempt(scene, way)
        kinds = {result, *(kind_of(error) for error in errors(programs) if error)}
        if what in kinds:
            last = f"{way}\n{shown(scene)}"
            raise Failed

    with contextlib.suppress(Failed):
        shrink()
    return last


def main() -> int:
    """Sweep; 1 where a scene failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1, help="of the first block")
    parser.add_argument("--output", type=Path, help="JSON lines; a sweep goes on behind them")
    parser.add_argument("--no-shrink", action="store_true", help="do not look for smaller scenes")
    given = parser.parse_args()
    if CLANG is None:
        sys.exit("clang is not installed")
    done = []
    if given.output and given.output.exists():
        done = [json.loads(row) for row in given.output.read_text().splitlines()]
    total: Counter = Counter()
    sizes: Counter = Counter()
    for row in done:
        total.update(row["found"])
        sizes.update({**row["texts"], "seconds": row["seconds"]})
    known: set[bytes] = set()
    shrunk = {what for row in done for what in row["smallest"]}
    for number in range(len(done), -(-given.scenes // BLOCK)):
        start = time.process_time()
        seed = given.seed + number
        found, texts_, failures = block(seed, BLOCK, known)
        small = {}
        for what, scene, way in failures:
            if what in shrunk:
                continue
            shrunk.add(what)
            small[what] = f"{way}\n{shown(scene)}"
            if not given.no_shrink:
                small[what] = smallest(seed, BLOCK, what) or small[what]
            print(f"{what}\n{small[what]}", flush=True)
        seconds = round(time.process_time() - start, 2)
        row = {
            "seed": seed, "found": found, "texts": texts_, "seconds": seconds, "smallest": small,
        }  # fmt: skip
        if given.output:
            with given.output.open("a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")
        total.update(found)
        sizes.update({**texts_, "seconds": seconds})
    print(json.dumps({**sizes, **dict(total.most_common())}, indent=1))
    return int(any(what.startswith("failed") for what in total))


if __name__ == "__main__":
    sys.exit(main())
