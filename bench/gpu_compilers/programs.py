"""Programs of scenes for GPUs: a single lane, queues, two layouts of trees."""

from __future__ import annotations

import dataclasses
import hashlib
import itertools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path as FilePath

import click

import clpt
from bench import machine
from clpt import device
from clpt.errors import SceneError
from clpt.render.flow import programs
from clpt.render.flow.scene_to_tables import lower
from clpt.render.records import Features
from clpt.scene import Scene
from clpt.scene.integrators import Path

MODES = ("rgb", "spectral")
LAYOUTS = ("compact", "wide8")
GUIDED = ("pool", "three_spheres")  # scenes whose paths are compiled with a guide, too


@dataclass(frozen=True)
class Program:
    """A text, and where it stands first.

    stage: with its layout, if the text hangs on that; registers: as of `device.Source`.
    """

    text: str
    stage: str
    scene: str
    mode: str
    registers: tuple[int, ...] = ()

    @property
    def digest(self) -> str:
        """What is equal for equal texts and limits."""
        limits = "".join(map(str, self.registers))
        return hashlib.sha256((self.text + limits).encode()).hexdigest()[:16]


def scenes() -> list[FilePath]:
    """The scenes that stand in files."""
    return sorted(path.parent for path in (machine.ROOT / "scenes").glob("*/scene.json"))


def of_scenes(paths: Iterable[FilePath], modes: Iterable[str] = MODES) -> list[Program]:
    """Every text of scenes once; scenes whose files are not made are told and left out."""
    by_text: dict[str, Program] = {}
    layouts: dict[str, set[str]] = {}
    for path in paths:
        try:
            scene = clpt.load(path)
        except SceneError as error:
            click.echo(f"{path.name} is left out: {error}", err=True)
            continue
        for variant, mode in itertools.product(_ways(scene, path.name), modes):
            film = dataclasses.replace(scene.film, mode=mode)
            features = lower(dataclasses.replace(variant, film=film)).features
            for layout in LAYOUTS:
                for stage, source in _sources(features, layout):
                    program = Program(source.text, stage, path.name, mode, source.registers)
                    by_text.setdefault(source.text, program)
                    layouts.setdefault(source.text, set()).add(layout)
    return [_named(program, layouts[text]) for text, program in by_text.items()]


def _ways(scene: Scene, name: str) -> list[Scene]:
    """A scene as it is and, where its paths are to be guided, so."""
    if name not in GUIDED:
        return [scene]
    return [scene, dataclasses.replace(scene, integrator=Path(guiding=True))]


def longest(candidates: Iterable[Program], count: int) -> list[Program]:
    """Of each stage and mode the longest texts: what asks for most."""
    groups: dict[tuple[str, str], list[Program]] = {}
    for program in sorted(candidates, key=lambda candidate: -len(candidate.text)):
        groups.setdefault((program.stage, program.mode), []).append(program)
    return [program for programs in groups.values() for program in programs[:count]]


def _sources(features: Features, layout: str) -> Iterator[tuple[str, device.Source]]:
    """The texts of a picture, by the names of their stages."""
    for name, root in (
        ("guide", "transport/guiding/sum.cl"),
        ("photons", "transport/photons/sort.cl"),
    ):
        yield name, device.assemble(root)
    for pass_features in features.passes:
        yield from programs.sources(pass_features, layout, 1, queued=True).items()
    yield from programs.film_sources(features, layout).items()
    yield from programs.noise_sources(features, layout).items()


def _named(program: Program, layouts: set[str]) -> Program:
    """Return the program of a stage; with its layout, if only that layout has this text."""
    if len(layouts) > 1:
        return program
    (layout,) = layouts
    return dataclasses.replace(program, stage=f"{program.stage} {layout}")
