"""The code keeps to the words of docs/glossary.md: names that were given up do not come back."""

from __future__ import annotations

import io
import keyword
import re
import tokenize
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
# What a name was, and what it is now; whole identifiers of Python, or of OpenCL where marked.
RETIRED = {
    "Bend": "NormalPerturbation",
    "Bent": "NormalMapped",
    "Facts": "RenderStats",
    "Held": "DeviceArg",
    "Kept": "ProgramCache",
    "Memo": "LoweringCache",
    "Resident": "DeviceScene",
    "Sink": "TableStore",
    "Tables": "TableStore and Encoder",
    "Turns": "DeviceOwner",
    "Twice": "DuplicateKey",
    "choosy": "uses_lobe_sample",
    "exposed": "samples_per_pixel",
    "flies": "interleaved",
    "flights": "interleaved",
    "hollow": "no_back",
    "sibling": "with_channel",
    "suited_slots": "default_slots",
    "told": "warnings_of",
}
RETIRED_KERNEL_WORDS = {
    "APART": "NO_VECTORIZE",
    "Facing": "ShadingFrame",
    "bent": "perturbed",
    "flights": "states",
    "gone": "null_distance",
    "lamps": "light_params",
    "null_share": "null_transmittance",
    "trace_open": "trace_transmittance",
    "walk": "work_list",
}


def names_in(path: Path) -> set[str]:
    """The identifiers of a Python file."""
    tokens = tokenize.generate_tokens(io.StringIO(path.read_text("utf-8")).readline)
    return {t.string for t in tokens if t.type == tokenize.NAME} - set(keyword.kwlist)


@pytest.mark.parametrize("package", ["clpt", "bench", "examples"])
def test_no_retired_name_in_python(package: str) -> None:
    for path in (ROOT / package).rglob("*.py"):
        wrong = names_in(path) & RETIRED.keys()
        assert not wrong, f"{path}: {[f'{name}: {RETIRED[name]}' for name in sorted(wrong)]}"


def test_no_retired_name_in_kernels() -> None:
    for path in (ROOT / "kernels").rglob("*.cl"):
        code = re.sub(r"/\*.*?\*/|//[^\n]*", "", path.read_text("utf-8"), flags=re.DOTALL)
        wrong = set(re.findall(r"\w+", code)) & RETIRED_KERNEL_WORDS.keys()
        assert not wrong, f"{path}: {[f'{n}: {RETIRED_KERNEL_WORDS[n]}' for n in sorted(wrong)]}"


def test_the_glossary_has_the_words_that_took_their_places() -> None:
    glossary = (ROOT / "docs/glossary.md").read_text("utf-8")
    for word in ("null surface", "work list", "pixel index", "perturbation", "emission mode"):
        assert f"| {word} |" in glossary
