"""The stages of a bounce in their order, and the verbs of kernels/stage/loop.cl."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from clpt.render.flow import flags, vertices
from clpt.render.records import Features
from clpt.render.records.dispatch import function
from clpt.scene.scatterer import Scatterer

# steps of a bounce, in order
VERBS = (
    "begin", "show", "intersect", "flight", "deposit", "train", "mix", "shade", "join", "reuse",
)  # fmt: skip


# whether a stage of a single slot has work there, which is cheaper to ask than to call it
ASKED = {
    "intersect": "if (slot_flies(path, slot)) ",
    "shadow": "if (slot_joins(shadow, slot)) ",
    "splat": "if (slot_joins(shadow, slot)) ",
    "reuse": "if (slot_reuses(path, hit, slot)) ",
}


@dataclass(frozen=True)
class Stage:
    """A stage of a bounce: verb, program, kernel in the program, and slots of a work-item."""

    verb: str
    program: str
    kernel: str
    lanes: int


def order(features: Features, layout: str, lanes: int, interleaved: bool = False) -> list[Stage]:
    """Return the stages of a bounce in their order, but for sorting."""
    return [*_order(features, layout, lanes, interleaved)]


def _order(features: Features, layout: str, lanes: int, interleaved: bool) -> Iterator[Stage]:
    tracing, joining = trace_lanes(layout, lanes), join_lanes(features, layout, lanes, interleaved)
    begin, join = begin_and_join(features)
    yield Stage("begin", begin, begin, lanes)
    if begin == "flare":
        yield Stage("join", join, join, joining)
        return
    if features.shows_lights:
        yield Stage("show", join, join, joining)
    yield Stage("intersect", "intersect", "intersect", lanes if interleaved else tracing)
    for cls in gathered(features):
        yield Stage("flight", f"gather_{cls.kind}", "gather_along", lanes)
    if features.media.present:
        yield Stage("flight", flight(features), "flight", lanes)
    if deposits(features):
        yield Stage("deposit", "deposit", "deposit", lanes)
    if trains(features):
        yield Stage("train", "train", "train", lanes)
    if features.materials.mixtures:
        yield Stage("mix", "mix", "mix_materials", lanes)
    for kind in features.materials.kinds:
        yield Stage("shade", f"shade_{kind}", "shade", lanes)
    if joins(features) and any(not cls.delta for cls in features.materials.leaves):
        yield Stage("join", join, join, joining)
    if features.film.reuse and lanes > 1:
        yield Stage("reuse", "reuse", "reuse", tracing)


def begin_and_join(features: Features) -> tuple[str, str]:
    """Return the stage that begins paths, and the stage that tests their connecting rays.

    Rays connect paths to a light or, if the paths start at lights, to the camera.
    """
    if not features.transport.light_paths:
        return "generate", "shadow"
    return "flare" if features.transport.lit_ghosts else "emit", "splat"


def joins(features: Features) -> bool:
    """Whether paths from the camera are connected to lights, or light paths to the camera."""
    return not features.transport.light_paths or features.transport.joined


def deposits(features: Features) -> bool:
    """Whether paths store photons."""
    return features.transport.light_paths and features.transport.merged


def gathered(features: Features) -> list[type[Scatterer]]:
    """Return the phase functions of media where rays from the camera gather photons."""
    if not features.transport.merged or features.transport.light_paths:
        return []
    return [cls for cls in features.materials.leaves if flags.gathers_along(features, cls)]


def trains(features: Features) -> bool:
    """Whether paths train a guide."""
    return features.transport.light_paths and features.transport.guided


def flight(features: Features) -> str:
    """Return the program that takes rays through media.

    The program of light paths has no aims, and adds to no layers.
    """
    layers = features.media.emissive and bool(features.film.layers.lights)
    of_light = features.transport.light_paths and (features.media.aims or layers)
    return "flight_of_light" if of_light else "flight"


def trace_lanes(layout: str, lanes: int) -> int:
    """Return the number of rays that a work-item traces: 1, or `lanes` without a tree."""
    return lanes if layout == "brute" else 1


def join_lanes(features: Features, layout: str, lanes: int, interleaved: bool) -> int:
    """Return the number of connecting rays that a work-item tests.

    In scenes with analytic shapes a work-item tests the interleaved rays of `lanes` paths.
    """
    return lanes if interleaved and features.geometry.analytic else trace_lanes(layout, lanes)


def has_both(features: Features) -> bool:
    """Whether materials shade paths from the camera and from lights."""
    return len(features.passes) > 1 and not features.transport.lit_ghosts


@dataclass(frozen=True)
class _Call:
    """A call of a stage in the loop, where it is a function.

    args: arguments beside slabs and scene, each a type and an expression.
    """

    stage: Stage
    args: tuple[tuple[str, str], ...]

    @property
    def declaration(self) -> str:
        types = "".join(f", {type_}" for type_, _ in self.args)
        return f"void loop_{self.stage.program}(SLAB_ARGS, SCENE_ARGS{types}, uint at);"

    @property
    def text(self) -> str:
        """The statement that calls it for the slots from `slot` on."""
        passed = "".join(f", {value}" for _, value in self.args)
        return f"loop_{self.stage.program}(SLAB_PASSED, SCENE_PASSED{passed}, slot);"

    @property
    def through(self) -> str:
        """The statement that calls it for the slots from `first` to `end`."""
        step = "LANES" if self.stage.lanes > 1 else "1"
        asked = ASKED.get(self.stage.kernel, "") if self.stage.lanes == 1 else ""
        return f"for (uint slot = first; slot < end; slot += {step}) {asked}{self.text}"


def stages_text(features: Features, layout: str, lanes: int, interleaved: bool) -> str:
    """Return the stages of the loop as functions, and the verbs of kernels/stage/loop.cl.

    A verb takes the slots from `first` to `end` through a stage, with the arguments of the loop. If
    kinds of paths differ in the stage, it asks `which` are traced. A verb without a stage is empty.
    """
    passes = [
        [_call(features, kind, layout, stage) for stage in order(kind, layout, lanes, interleaved)]
        for kind in features.passes
    ]
    declared = dict.fromkeys(call.declaration for calls in passes for call in calls)
    of_verbs = {
        verb: [[call for call in calls if call.stage.verb == verb] for calls in passes]
        for verb in VERBS
    }
    shading = of_verbs.pop("shade")
    head = "void bounce_shade_at(SLAB_ARGS, SCENE_ARGS, LOOP_ARGS, uint which, int kind, uint slot)"
    kinds = enumerate(features.materials.leaves)
    phases = " || ".join(f"(kind) == {i}" for i, cls in kinds if cls.is_phase)
    of_camera = [[not kind.transport.light_paths] for kind in features.passes]
    rows = [
        *declared,
        *(_verb(verb, calls) for verb, calls in of_verbs.items()),
        function(head, *_cases(max(shading, key=len))),
        f"#define PATHS_ARE_SHADED {_asked(shading)}",
        f"#define PATHS_WALK {_asked(of_camera)}",
        f"#define kind_is_phase(kind) ({phases or 0})",
    ]
    return "\n".join([*rows, ""])


def _call(features: Features, paths: Features, layout: str, stage: Stage) -> _Call:
    """The call of a stage for a kind of paths."""
    begin, join = begin_and_join(paths)
    groups = {
        begin: flags.begin_args(paths),
        "intersect": flags.trace_args(paths, layout),
        "flight": flags.flight_args(paths),
        "reuse": flags.trace_args(paths, layout),
        "gather_along": flags.gather_args(paths),
        "deposit": flags.deposit_args(paths),
        "train": flags.deposit_args(paths),
        join: flags.join_args(paths, layout),
        "shade": flags.shade_args(features),
    }
    args = [(type_, name) for name, type_ in groups.get(stage.kernel, {}).items()]
    if stage.kernel == "shade":
        args += [("uint ", "which")] if has_both(features) else []
        return _shade_call(features, stage, args)
    return _Call(stage, tuple(args))


def _shade_call(features: Features, stage: Stage, args: list[tuple[str, str]]) -> _Call:
    """The call of the part that shades a kind, and other kinds of a shared vertex."""
    leaves = features.materials.leaves
    for vertex in vertices.vertices(features, stage.lanes):
        if stage.program in (f"shade_{leaves[kind].kind}" for kind in vertex.kinds):
            args += [("uint ", "kind")] if vertex.shared else []
            stage = replace(stage, program=vertex.program)
            break
    return _Call(stage, tuple(args))


def _verb(verb: str, passes: list[list[_Call]]) -> str:
    """The macro of a verb, with the calls of each kind of paths.

    Equal calls stand there once: compilers inline functions with a single call into the loop, which
    saves some hundredths of the time.
    """
    each = [" ".join(call.through for call in calls) for calls in passes]
    if len(set(each)) == 1:
        rows = [each[0]]
    else:
        rows = [f"if (which == {i}) {{ {calls} }}" for i, calls in enumerate(each) if calls]
    return " \\\n    ".join([f"#define bounce_{verb}(first, end)", *filter(None, rows)])


def _cases(shading: list[_Call]) -> list[str]:
    """Statements that shade by the kind of material."""
    kinds: dict[str, list[str]] = {}
    for kind, call in enumerate(shading):
        kinds.setdefault(call.text, []).append(f"case {kind}:")
    if len(kinds) == 1:
        return [*kinds]
    rows = (f"{' '.join(cases)} {call} break;" for call, cases in kinds.items())
    return ["switch (kind) {", *rows, "}"]


def _asked(passes: Sequence[Sequence[object]]) -> str:
    """The condition that a kind of paths has a true value."""
    having = [i for i, values in enumerate(passes) if any(values)]
    if len(having) in (0, len(passes)):
        return str(int(bool(having)))
    return f"(which == {having[0]})"
