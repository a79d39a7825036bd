"""Conditions of the preprocessor: what a text decides, and what it leaves to compilers."""

from __future__ import annotations

import pytest

from clpt.device.conditions import Macros
from clpt.device.source import assemble
from clpt.errors import KernelBuildError

DEFINES = {
    "ONE": "1", "TWO": "(ONE + 1)", "SUM": "1 + 1", "NAME": "TWO", "TEXT": "1.5f", "NOTHING": "",
    "CALL(x)": "x", "SELF": "SELF", "HEX": "0x1f",
}  # fmt: skip


def left(text: str, **defines: int) -> list[str]:
    """The rows that stay of a text, without what says where they stand, and without `defines`."""
    whole = assemble("a", {"a": text}, defines, library=True).text
    rows = whole.partition(' "a"\n')[2].splitlines()
    return [row for row in rows if row and not row.startswith("#line")]


@pytest.mark.parametrize(
    ("condition", "value"),
    [
        ("1", 1), ("0", 0), ("HEX", 31), ("017", 15), ("ONE == 1", 1), ("NAME == 2", 1),
        ("-3 / 2", -1),
        ("-3 % 2", -1), ("1 + 2 * 3 == 7", 1), ("(1 + 2) * 3", 9), ("1 << 3 | 1", 9), ("~0", -1),
        ("SUM * 2", 3),  # a value is put in as it stands
        ("!ONE == 0", 1), ("1 ? 2 : 3", 2), ("NONE ? 2 : 0 ? 4 : 5", 5), ("NONE", 0),
        ("NONE == 0", 1),
        ("defined ONE", 1), ("defined(NONE)", 0), ("defined NOTHING && defined(CALL)", 1),
        ("!defined(ONE) || NONE", 0), ("3 > 2 && 2 >= 2 && 1 < 2 && 1 <= 1 && 1 != 2", 1),
        ("6 & 3 ^ 1", 3), ("1 - 1 - 1", -1), ("- - 1", 1), ("8 >> 1 >> 1", 2),
    ],
)  # fmt: skip
def test_what_a_text_decides(condition: str, value: int) -> None:
    assert Macros(DEFINES).value("if", condition) == value


@pytest.mark.parametrize(
    "condition",
    [
        "__AVX__", "defined(__AVX__)", "__has_builtin(__builtin_ctz)", "cl_khr_fp64", "NOT_INLINED",
        "ONE && __AVX__", "NONE || !__AVX__", "__AVX__ ? 1 : 0", "__AVX__ + 1", "FP_FAST_FMAF",
        "__has_builtin((a, b)) && ONE",
        "TEXT", "NOTHING", "CALL(1)", "SELF", "1 / 0", "1 % NONE", "(1", "1 2", "", "'a'", "08",
        "1u > 0",
    ],
)  # fmt: skip
def test_what_is_left_to_compilers(condition: str) -> None:
    """What compilers know, and what they refuse."""
    assert Macros(DEFINES).value("if", condition) is None


@pytest.mark.parametrize(
    ("condition", "value"),
    [
        ("__AVX__ && NONE", 0), ("NONE && __has_builtin(x)", 0), ("ONE || __AVX__", 1),
        ("__AVX__ && __AVX2__ && 0", 0), ("LANES == 8 && defined(__AVX__)", 0),
    ],
)  # fmt: skip
def test_what_compilers_know_may_not_matter(condition: str, value: int) -> None:
    assert Macros(DEFINES).value("if", condition) == value


def test_branches() -> None:
    text = "#if A\na\n#elif B == 2\nb\n#elif C\nc\n#else\nd\n#endif\n"
    assert left(text, A=1, B=2) == ["a"]
    assert left(text, B=2, C=1) == ["b"]
    assert left(text, C=1) == ["c"]
    assert left(text) == ["d"]


def test_branches_in_branches() -> None:
    text = "#ifdef A\n#ifndef B\na\n#else\n#if 1\nb\n#endif\n#endif\n"
    text += "#else\n#if A\nno\n#endif\nc\n#endif"
    assert left(text, A=0) == ["a"]
    assert left(text, A=0, B=0) == ["b"]
    assert left(text) == ["c"]


def test_a_branch_that_compilers_decide_stays() -> None:
    text = "#if NONE\na\n#elif __AVX__\nb\n#elif NONE\nc\n#elif ONE\nd\n#else\ne\n#endif"
    assert left(text, ONE=1) == ["#if __AVX__", "b", "#else", "d", "#endif"]
    text = "#if __AVX__\na\n#elif NONE\nb\n#elif FP_FAST_FMAF\nc\n#else\nd\n#endif"
    assert left(text) == ["#if __AVX__", "a", "#elif FP_FAST_FMAF", "c", "#else", "d", "#endif"]
    assert left("#ifdef __AVX__\n#if 0\nb\n#endif\n\n#else\n#endif\na") == ["a"], "nothing is in it"


def test_macros_are_those_of_their_place() -> None:
    text = "#if A\n1\n#endif\n#define A 1\n#if A\n2\n#endif\n#undef A\n#ifdef A\n3\n#endif\n"
    assert left(text) == ["#define A 1", "2", "#undef A"]
    assert left("#if 0\n#define A\n#endif\n#ifdef A\na\n#endif\nb") == ["b"]


def test_what_compilers_decide_makes_a_macro_open() -> None:
    text = "#ifdef __AVX__\n#define A 1\n#endif\n"
    asked = "#if A\na\n#endif"
    assert left(text + asked)[3:] == ["#if A", "a", "#endif"]
    assert left(text + "#undef A\n" + asked)[3:] == ["#undef A"]
    assert left(text + "#define A 0\n" + asked)[3:] == ["#define A 0"]


def test_comments_and_continuations() -> None:
    text = "/* #if 0\n#endif */ a\n#if /* no 0 */ 1 // 0\nb\n#endif /* of\nb */\n"
    text += "#if 1 && \\\n  0\nc\n#endif\nd"
    assert left(text) == ["/* #if 0", "#endif */ a", "b", "d"]
    assert left("#if __AVX__ && \\\n  1\na\n#endif") == ["#if __AVX__ && \\", "  1", "a", "#endif"]
    assert left("#define A \\\n  1\n#if A\na\n#endif\r\nb") == ["#define A \\", "  1", "a", "b"]
    rows = ["#define A 1 /* one", "line */", "a"]
    assert left("#define A 1 /* one\nline */\n#if A\na\n#endif") == rows


def test_an_if_has_an_end() -> None:
    with pytest.raises(KernelBuildError, match="no #endif") as raised:
        assemble("a", {"a": '#include "b"\n', "b": "\n#if 1\n#if 0\n#endif\n"})
    assert (raised.value.file, raised.value.line) == ("b", 2)
