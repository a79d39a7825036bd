"""The stages of a bounce in their order, and the text that takes paths through them in the loop."""

from __future__ import annotations

from dataclasses import dataclass

from clpt.render.codegen import signatures
from clpt.render.codegen.dispatch import indented
from clpt.render.contract.features import Features


@dataclass(frozen=True)
class Stage:
    """A stage of a bounce: its program, its kernel there, how many slots a work-item serves."""

    program: str
    kernel: str
    lanes: int


def order(features: Features, layout: str, lanes: int, interleaved: bool = False) -> list[Stage]:
    """Return the stages of a bounce in their order, but for sorting."""
    tracing, joining = trace_lanes(layout, lanes), join_lanes(features, layout, lanes, interleaved)
    begin, join = begin_and_join(features)
    bounce = [Stage(begin, begin, lanes)]
    if begin == "flare":
        return [*bounce, Stage(join, join, joining)]
    if features.shows_lights:
        bounce.append(Stage(join, join, joining))
    bounce.append(Stage("intersect", "intersect", lanes if interleaved else tracing))
    if features.media.present:
        bounce.append(Stage(flight(features), "flight", lanes))
    if deposits(features):
        bounce.append(Stage("deposit", "deposit", lanes))
    if trains(features):
        bounce.append(Stage("train", "train", lanes))
    if features.materials.mixtures:
        bounce.append(Stage("mix", "mix_materials", lanes))
    bounce += [Stage(f"shade_{kind}", "shade", lanes) for kind in features.materials.kinds]
    if joins(features) and any(not cls.delta for cls in features.materials.leaves):
        bounce.append(Stage(join, join, joining))
    return bounce


def begin_and_join(features: Features) -> tuple[str, str]:
    """Return the stage that begins paths, and the one that tests the rays that join them.

    Rays join paths to a light or, if the paths start at lights, to the camera.
    """
    if not features.transport.light_paths:
        return "generate", "shadow"
    return "flare" if features.transport.lit_ghosts else "emit", "splat"


def joins(features: Features) -> bool:
    """Whether paths are joined to lights or, those that start at lights, to the camera."""
    return not features.transport.light_paths or features.transport.joined


def deposits(features: Features) -> bool:
    """Whether paths leave photons."""
    return features.transport.light_paths and features.transport.merged


def trains(features: Features) -> bool:
    """Whether paths leave what a guide learns from."""
    return features.transport.light_paths and features.transport.guided


def flight(features: Features) -> str:
    """Return the program that takes rays through media: that of light paths does without aims."""
    return "flight_of_light" if features.transport.light_paths and features.media.aims else "flight"


def trace_lanes(layout: str, lanes: int) -> int:
    """Return the number of rays that a work-item traces: one, or `lanes` where there is no tree."""
    return lanes if layout == "brute" else 1


def join_lanes(features: Features, layout: str, lanes: int, interleaved: bool) -> int:
    """Return the number of rays that a work-item tests to join paths.

    Where shapes are analytic, a work-item tests interleaved rays, those of `lanes` paths.
    """
    return lanes if interleaved and features.geometry.analytic else trace_lanes(layout, lanes)


def has_both(features: Features) -> bool:
    """Whether materials shade paths from the camera and from lights."""
    return len(features.passes) > 1 and not features.transport.lit_ghosts


def loop_text(features: Features, layout: str, lanes: int, interleaved: bool) -> str:
    """Return the functions that stage/loop.cl calls: `loop_begin` and `loop_bounce`.

    `loop_bounce` has all other stages in their order; of the kind of paths `which`, where a scene
    has two.
    """
    bounces = [
        [
            _call(features, own, layout, stage, which)
            for stage in order(own, layout, lanes, interleaved)
        ]
        for which, own in enumerate(features.passes)
    ]
    lines = list(dict.fromkeys(call.declaration for calls in bounces for call in calls))
    head = "(SLAB_ARGS, SCENE_ARGS, LOOP_ARGS, uint which, "
    begins = [[calls[0].at("at")] for calls in bounces]
    lines += [f"inline void loop_begin{head}uint at)", "{", *_of_each(begins), "}"]
    rests = [calls[1:] for calls in bounces]
    same = _same(rests)
    own = []
    for which, (kind, calls) in enumerate(zip(features.passes, bounces, strict=True)):
        words = f"blocks_{which}"
        own.append(_bounce_text(calls[1 + same :], _walk_text(kind, calls, words), words))
    lines += [
        f"inline void loop_bounce{head}global uint *queue, uint first, uint end)",
        "{",
        "    SLABS",
        "    uint starts[BSDF_COUNT + 1], block = settings->slots + get_global_id(0) * LANES;",
        *indented(*_bounce_text(rests[0][:same], [], "")),
        *_of_each(own),
        "}",
    ]
    return "\n".join([*lines, ""])


@dataclass(frozen=True)
class _Call:
    """A call of a stage in the loop, where it is a function.

    args: what it takes beside slabs and scene, each a type and what is passed.
    """

    stage: Stage
    args: tuple[tuple[str, str], ...]

    @property
    def declaration(self) -> str:
        own = "".join(f", {type_}" for type_, _ in self.args)
        return f"void loop_{self.stage.program}(SLAB_ARGS, SCENE_ARGS{own}, uint at);"

    def at(self, slot: str) -> str:
        """Return the call for the slots from `slot` on."""
        own = "".join(f", {passed}" for _, passed in self.args)
        return f"loop_{self.stage.program}(SLAB_PASSED, SCENE_PASSED{own}, {slot});"

    def through(self, first: str, end: str) -> str:
        """Return the statement that calls it for a range of slots."""
        step = "LANES" if self.stage.lanes > 1 else "1"
        return f"for (uint at = {first}; at < {end}; at += {step}) {self.at('at')}"


def _call(features: Features, own: Features, layout: str, stage: Stage, which: int) -> _Call:
    """The call of a stage for one kind of paths, whose features are `own`."""
    begin, join = begin_and_join(own)
    groups = {
        begin: signatures.begin_args(own),
        "intersect": signatures.trace_args(own, layout),
        "flight": signatures.flight_args(own),
        "deposit": signatures.deposit_args(own),
        "train": signatures.deposit_args(own),
        join: signatures.join_args(own, layout),
        "shade": signatures.shade_args(features),
    }
    args = [(type_, name) for name, type_ in groups.get(stage.kernel, {}).items()]
    if stage.kernel == "shade" and has_both(features):
        args.append(("uint ", str(which)))
    return _Call(stage, tuple(args))


def _same(bounces: list[list[_Call]]) -> int:
    """Return the number of calls before shading that all kinds of paths have in common.

    Compilers put into the loop what is called in one place alone, which saves some hundredths of
    the time.
    """
    first, *others = bounces
    same = 0
    while first[same].stage.kernel != "shade" and all(o[same] == first[same] for o in others):
        same += 1
    return same


def _of_each(texts: list[list[str]]) -> list[str]:
    """Statements for each kind of paths, of which `which` is traced."""
    if len(texts) == 1:
        return indented(*texts[0])
    rows = []
    for which, text in enumerate(texts):
        rows += [f"if (which == {which}) {{", *indented(*text), "}"]
    return indented(*rows)


def _bounce_text(calls: list[_Call], walk: list[str], words: str) -> list[str]:
    """Return statements that take slots through stages.

    walk: what is done before shading; words: of a slot's state, which are sorted.
    """
    shading = [call for call in calls if call.stage.kernel == "shade"]
    sort = "queue_sort(path, hit, queue, starts, first, end);"
    lines = []
    for call in calls:
        if call not in shading:
            lines.append(call.through("first", "end"))
            continue
        kind = shading.index(call)
        if kind == 0:
            lines += [sort, *walk, *([sort] if walk else [])]
        begins, ends = f"starts[{kind}]", f"starts[{kind + 1}]"
        lines += [
            f"if (queue_is_dense({ends} - {begins}, end - first)) {{",
            f"    {call.through('first', 'end')}",
            "} else {",
            f"    for (uint entry = {begins}; entry < {ends}; entry += LANES) {{",
            f"        queue_take(path, hit, shadow, &{words}, queue, entry, {ends}, block);",
            f"        {call.at('block')}",
            f"        {_return_text('shadow', words, ends)}",
            "    }",
            "}",
        ]
    return lines


def _return_text(slab: str, words: str, ends: str) -> str:
    """The statement that brings back paths and a slab."""
    own = f"{words}.{slab}_words, {words}.{slab}"
    return f"queue_return(path, {slab}, &{words}, {own}, queue, entry, {ends}, block);"


def _walk_text(own: Features, calls: list[_Call], words: str) -> list[str]:
    """Return statements that take the camera's paths in media from collision to collision.

    They do so in a block while most of its lanes have one; own: the paths' features; calls: all
    of a bounce.
    """
    shading = [call for call in calls if call.stage.kernel == "shade"]
    if not shading:
        return []
    rest = [call for call in calls[1:] if call not in shading]
    join = [call for call in rest if calls.index(call) > calls.index(shading[0])]
    of_camera = () if own.transport.light_paths else own.materials.leaves
    phases = {cls.kind for cls in of_camera if cls.is_phase}
    lines = []
    for kind, call in enumerate(shading):
        if call.stage.program.removeprefix("shade_") not in phases:
            continue
        begins, ends = f"starts[{kind}]", f"starts[{kind + 1}]"
        again = [*join, *(one for one in rest if one not in join)]
        lines += [
            f"for (uint entry = {begins}; entry < {ends}; entry += LANES) {{",
            "    integer ended = 0;",
            f"    queue_take(path, hit, shadow, &{words}, queue, entry, {ends}, block);",
            f"    for (int n = 0; queue_walks(path, hit, {kind}, n, &ended, block); n++) {{",
            f"        {call.at('block')}",
            *(f"        {one.through('block', 'block + LANES')}" for one in again),
            "    }",
            "    queue_walked(path, ended, block);",
            f"    {_return_text('hit', words, ends)}",
            "}",
        ]
    return lines
