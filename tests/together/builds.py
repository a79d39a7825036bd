"""The programs of a scene, by the ways in which devices render it."""

from __future__ import annotations

from dataclasses import dataclass

from clpt import bvh
from clpt.render.flow import programs
from clpt.render.records import Features
from clpt.render.wavefront.strategy import can_interleave

FORMS = ("stages", "loop", "queues", "interleaved", "film")


@dataclass(frozen=True)
class Way:
    """A layout of triangles, paths that a work-item shades, and what becomes programs.

    form: "stages", a kernel each; "queues": these, shading along queues, of one lane; "loop": all
    of them in one kernel; "interleaved": the same with several rays in flight, where a scene can
    have them; "film": what makes pictures of a film.
    """

    layout: str = "wide8"
    lanes: int = 1
    form: str = "stages"


def layouts(features: Features) -> list[str]:
    """The layouts that can hold a scene's triangles."""
    return [name for name in bvh.LAYOUTS if not (name == "brute" and features.geometry.instances)]


def texts(features: Features, way: Way) -> list[str]:
    """The texts of all programs of a scene in one way; through trees where it has instances."""
    layout, lanes = way.layout, way.lanes
    if layout == "brute" and features.geometry.instances:
        layout = bvh.TREES[0]
    if way.form == "film":
        made = {
            **programs.film_sources(features, layout),
            **programs.noise_sources(features, layout),
        }
        return [source.text for source in made.values()]
    interleaved = way.form == "interleaved" and can_interleave(features, layout, lanes)
    if way.form in ("loop", "interleaved"):
        looped = programs.loop_sources(features, layout, lanes, interleaved)
        return [source.text for source in looped.values()]
    found: dict[str, None] = {}
    for own in features.passes:
        made = programs.sources(own, layout, lanes, queued=way.form == "queues")
        found |= dict.fromkeys(source.text for source in made.values())
    return list(found)
