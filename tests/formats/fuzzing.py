"""What the tests of damaged files share: whatever stands in a file, a loader gives a SceneError."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from clpt.errors import SceneError
from clpt.formats import load

hypothesis = pytest.importorskip("hypothesis")
st = hypothesis.strategies

LONGEST = 500  # characters of a message


def settings(max_examples: int) -> Any:
    """The same examples each time, as many as take a second or two."""
    return hypothesis.settings(
        max_examples=max_examples,
        deadline=None,
        derandomize=True,
        database=None,
        suppress_health_check=list(hypothesis.HealthCheck),
    )


def check(path: Path, content: bytes, read: Callable[..., Any] = load, **variables: object) -> None:
    """Write a file and read it: there is a result, or a SceneError of one line."""
    path.write_bytes(content)
    try:
        read(path, **variables)
    except SceneError as error:
        assert "\n" not in str(error) and len(str(error)) < LONGEST


@st.composite
def damaged(draw: Any, source: bytes, words: Any) -> bytes:
    """The source with some of it cut out, doubled, or overwritten by words or bytes."""
    text = source
    for _ in range(draw(st.integers(1, 3))):
        start = draw(st.integers(0, len(text)))
        end = min(len(text), start + draw(st.integers(0, 40)))
        new = draw(
            st.just(b"")
            | st.just(text[start:end] * 2)
            | words.map(str.encode)
            | st.binary(max_size=4)
        )
        text = text[:start] + new + text[end:]
    return text


def json_values(scalars: Any, keys: Any) -> Any:
    """Small JSON documents of these scalars and keys."""
    return st.recursive(
        scalars,
        lambda inner: st.lists(inner, max_size=4) | st.dictionaries(keys, inner, max_size=4),
        max_leaves=8,
    )


def json_paths(value: Any, path: tuple = ()) -> Iterator[tuple]:
    """The keys and indices that lead to each value of a JSON document."""
    if isinstance(value, (dict, list)):
        for key, inner in value.items() if isinstance(value, dict) else enumerate(value):
            yield (*path, key)
            yield from json_paths(inner, (*path, key))


def replace(document: Any, path: tuple, value: Any) -> None:
    """Put a value at a path of a JSON document. Raises KeyError, IndexError or TypeError."""
    for key in path[:-1]:
        document = document[key]
    document[path[-1]] = value
