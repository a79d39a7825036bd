"""Assembled text: includes once, names kept, clear errors."""

from __future__ import annotations

from pathlib import Path

import pytest

from clpt.device.source import Part, assemble, kernels_folder
from clpt.errors import KernelBuildError


def test_the_kernels_are_found():
    assert (kernels_folder() / "core").is_dir()


def test_a_kernel_file_is_named_by_its_path():
    source = assemble("root", {"root": '#include "core/lanes.cl"\nreal after;'}, {"LANES": 1})
    assert source.files == ("core/lanes.cl", "root")
    assert '"kernels/core/lanes.cl"\n/* Lanes: ' in source.text
    assert source.text.endswith('#line 2 "root"\nreal after;\n')


def test_each_file_once_even_in_a_circle():
    virtual = {"a": '#include "b"\nint a;', "b": '#include "a"\n#include "b"\nint b;'}
    source = assemble("a", virtual)
    assert source.files == ("b", "a")
    assert source.text.count("int a;") == source.text.count("int b;") == 1


def test_lines_are_counted_past_an_include():
    virtual = {"a": 'one\n#include "b"\nthree\n#include "b"\nfive', "b": "x\ny"}
    source = assemble("a", virtual, {"one": 1})
    places = {text: source.location(row) for row, text in enumerate(source.text.splitlines(), 1)}
    assert places["y"] == ("b", 2)
    assert places["three"] == ("a", 3)
    assert places["five"] == ("a", 5)
    assert places["#define one 1"] == (None, None)


def test_defines_come_first_if_the_text_names_them():
    defines = {"N": "K", "K": 3, "M": "uint", "NONE": 0}
    text = assemble("a", {"a": "M x = N;"}, defines).text
    assert text == '#define N K\n#define K 3\n#define M uint\n#line 1 "a"\nM x = N;\n'


def test_a_comment_at_a_files_head_stands_in_front_of_what_is_left_of_it():
    """Of the root it is first of all; rows behind it have the numbers that they have in files."""
    tail = "\n#define NO 1\n\nint x;"
    virtual = {"a": '/* A. */\n#include "b"' + tail, "b": '/* B. */\n#include "c"' + tail}
    source = assemble("a", {**virtual, "c": "int c;"})
    lines = ["/* A. */", '#line 1 "c"', "int c;", '#line 4 "b"', "/* B. */", "int x;"]
    assert source.text.splitlines() == ['#line 1 "a"', *lines, '#line 5 "a"', "int x;"]
    assert source.location(7) == ("b", 5)
    assert source.files == ("a", "c", "b")


def test_members_in_memory_that_nothing_names_are_gaps():
    """The others lie where they lay; a struct of lanes, or one that a file has, stays as it is."""
    made = "generated/s"
    members = "    {0} a; /* A. */\n    {0} b[3];\n    {0} c;\n    {0} d;\n"
    words, lanes = (f"typedef struct {{\n{members.format(name)}}} S;\n" for name in ("int", "real"))
    kernel = f'#include "{made}"\nkernel void run(global S *s) {{ s->c = 1; }}\n'
    text = assemble("a", {"a": kernel, made: words}).text
    rows = ["    int unused_0[4];", "    int c;", "    int unused_1[1];", "} S;"]
    assert text.splitlines()[2:6] == rows
    assert lanes in assemble("a", {"a": kernel, made: lanes}).text
    pasted = kernel.replace("s->c = 1", "OF(s, x) = 1") + "#define OF(s, name) s->name##_c\n"
    text = assemble("a", {"a": pasted, made: words.replace(" c;", " x_c;")}).text
    assert text.splitlines()[2:4] == [rows[0], "    int x_c;"]
    assert words in assemble("a", {"a": words + kernel, made: ""}).text


USED = """\
/* Of one. */
real one(real x);
real one(real x) { return x; }

/* Of two and its helper. */
typedef struct {
    real y;
} Two;
real helper(Two *two) { return two->y + ONE; }
constant float table[2][2] = {{1.0f, 2.0f}, {3.0f, 4.0f}};
#define ONE one(1.0f)
#define UNUSED one(2.0f)

/* Of nothing that is named. */
real unused(real x)
{
    return helper(0) + table[0][0];
}
#undef UNUSED

/* The kernel. */
kernel void run(global float *x) { x[0] = helper(0); }
"""


def test_what_nothing_names_is_left_out():
    text = assemble("a", {"a": USED}).text
    without = USED.replace("constant float table[2][2] = {{1.0f, 2.0f}, {3.0f, 4.0f}};\n", "\n")
    head, rest = without.split("#define UNUSED")
    number = USED.splitlines().index("/* The kernel. */") + 1
    kernel = rest[rest.index("\n/* The kernel") + 1 :].replace("/* The", f"#line {number}\n/* The")
    assert text == f'#line 1 "a"\n{head}{kernel}'
    assert assemble("a", {"a": USED}, library=True).text == f'#line 1 "a"\n{USED}'


def test_a_part_is_left_whole_if_it_pastes_names_together():
    text = "#define CALL(kind, verb) kind##verb\nreal a_b(real x);\n"
    files = {"a": '#include "part"\nkernel void run(void) {}', "part": Part(text, "b.py", 7)}
    assert assemble("a", files).text.startswith(f'#line 7 "b.py"\n{text}#line 2 "a"\n')
    files["part"] = Part(text.replace("##", ""), "b.py", 7)
    assert assemble("a", files).text == '#line 2 "a"\nkernel void run(void) {}\n'


def test_generated_files_are_numbered_as_they_stand():
    virtual = {"generated/a": '#include "b"\n' + USED, "b": "int b;"}
    rows = assemble("generated/a", virtual).text.splitlines()
    assert rows.count('#line 1 "generated/a"') == sum(row.startswith("#line") for row in rows) - 1
    assert rows[-2:] == USED.splitlines()[-2:] and rows[-3] == ""


@pytest.mark.parametrize(
    "kept",
    [
        "#pragma OPENCL FP_CONTRACT OFF", "STAGE(name)(real x) { }", "int several; int more;",
        "real a(void) { return 0; } real b(void) { return 0; }", "kernel void k(void) { }",
        "struct Named { int x; };", "enum { A, B };", "real LAYOUT(verb)(real x) { return x; }",
        "#if __AVX__\nreal a(real x)\n#else\nreal b(real x)\n#endif\n{ return x; }",
    ],
)  # fmt: skip
def test_what_is_not_a_definition_stays(kept: str):
    text = f"real used(void) {{ return 0; }}\nreal unused(void);\n{kept}"
    assert kept in assemble("a", {"a": text}).text
    assert "unused" not in assemble("a", {"a": text}).text


@pytest.mark.parametrize(
    "macro", ["LAYOUT(verb) wide_##verb", "END(x) x##_closest", "A(x) f(wide_##x)"]
)
def test_names_that_are_pasted_together_are_named(macro: str):
    name = macro.split("(")[0]
    text = f"#define {macro}\nreal wide_closest(void);\nkernel void k(void) {{ {name}(closest); }}"
    assert "real wide_closest" in assemble("a", {"a": text}).text
    text = "real t(void);\nreal s_t(void);\nkernel void k(void) {\n#define F(i) v.s##i;\nF(1) }"
    assert "real" not in assemble("a", {"a": text}).text, "members are no functions"


def test_a_generated_file_wins_over_one_on_disk():
    virtual = {"a": '#include "core/lanes.cl"', "core/lanes.cl": "mine"}
    assert "mine" in assemble("a", virtual).text


def test_a_missing_include_names_its_place():
    with pytest.raises(KernelBuildError, match=r"no file 'lib/none\.cl'") as raised:
        assemble("a", {"a": '\n#include "lib/none.cl"'})
    assert (raised.value.stage, raised.value.file, raised.value.line) == ("a", "a", 2)


def test_no_include_leaves_the_folder():
    with pytest.raises(KernelBuildError, match="no file"):
        assemble("a", {"a": '#include "../pyproject.toml"'})


def test_an_include_inside_an_if_is_refused():
    with pytest.raises(KernelBuildError, match="stands inside an #if"):
        assemble("a", {"a": '#ifdef X\n#include "b"\n#endif', "b": ""})


def test_an_include_takes_a_section(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """It takes a step or the step's twin; the shared text of the steps comes once, before both."""
    rows = [
        "/* Steps of a trip. */", "typedef int Trip;", "", "/* Step walk: on foot. */",
        "void walk(Trip t) { slow(t); }", "", "/* Twin, at home. */", "void walk(Trip t) {}", "",
"/* Step ride: on a horse. */", "void ride(Trip t) {}",
    ]  # fmt: skip
    (tmp_path / "trip.cl").write_text("\n".join(rows))
    monkeypatch.setattr("clpt.device.source.kernels_folder", lambda: tmp_path)
    source = assemble(
        "a", {"a": '#include "trip.cl#walk#none"\n#include "trip.cl#ride"'}, library=True
    )
    assert source.text.count("typedef int Trip;") == 1 and "slow" not in source.text
    assert "Twin" not in source.text
    text = source.text.splitlines()
    for wanted in (rows[7], rows[10]):
        assert source.location(text.index(wanted) + 1) == ("trip.cl", rows.index(wanted) + 1)
    for name in ("trip.cl#run", "trip.cl#ride#none", "trip.cl#none"):
        with pytest.raises(KernelBuildError, match="no file"):
            assemble("a", {"a": f'#include "{name}"'})


@pytest.mark.parametrize("step", ["", "/* Step. */\n"])
def test_a_file_has_a_step_without_a_name(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, step: str
) -> None:
    begin = f"/* A trip. */\n#define FAR 1\n{step}"
    text = "void walk(void) { FAR; }\n\n/* Twin, at home. */\nvoid walk(void) {}\n"
    (tmp_path / "trip.cl").write_text(begin + text)
    monkeypatch.setattr("clpt.device.source.kernels_folder", lambda: tmp_path)
    taken = assemble("a", {"a": '#include "trip.cl"'}, library=True).text
    twin = assemble("a", {"a": '#include "trip.cl#none"'}, library=True).text
    assert "FAR; }" in taken and "walk(void) {}" not in taken
    assert "walk(void) {}" in twin and ("#define FAR" in twin) == bool(step)
