"""Programs and tables of all scenes of the repository as hashes: whether a change kept them all.

    python -m bench.text_hashes > before.json
    python -m bench.text_hashes --compare before.json

takes the scenes of `bench.picture_hashes`, and a ball of each kind of material. It lowers each, and
hashes its tables and the texts of all its programs, with 1 and 8 lanes, for two layouts. No device
is needed. Equal hashes of a change on the host mean equal pictures.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from pathlib import Path

import click

import clpt
from bench import picture_hashes
from clpt.render.flow import programs, stages
from clpt.render.flow.scene_to_tables import Lowered, lower
from clpt.scene import Scene, materials, shapes
from clpt.scene.lights import Constant

LANES = (1, 8)
LAYOUTS = ("compact", "wide8")


def cases(only: str) -> Iterator[tuple[str, Scene]]:
    """Name and scene of everything whose name holds `only`."""
    for name, scene, options in picture_hashes.cases(only):
        if not options:
            yield name, scene
    box = clpt.load(picture_hashes.ROOT / "scenes/cornell_box/scene.json")
    for mode in picture_hashes.MODES:
        for cls in materials.LEAVES:
            ball = shapes.Sphere(material=cls())
            scene = Scene(camera=box.camera, film=box.film, shapes=[ball], lights=[Constant()])
            yield f"material {cls.kind} {mode}", picture_hashes.small(scene, mode)


def texts(lowered: Lowered) -> str:
    """The hash of all programs that a scene can ask for."""
    hashed = hashlib.sha256()
    for layout in LAYOUTS:
        by_name = {}
        for number, pass_features in enumerate(lowered.features.passes):
            for lanes in LANES:
                for interleaved in (False, True):
                    asked = {"queued": lanes == 1, "interleaved": interleaved}
                    sources = programs.sources(pass_features, layout, lanes, **asked)
                    by_name |= {
                        f"{number} {lanes} {interleaved} {k}": v for k, v in sources.items()
                    }
        looped = programs.loop_sources(lowered.features, layout, 8, True)
        by_name |= {f"loop {name}": source for name, source in looped.items()}
        for make in (programs.film_sources, programs.noise_sources):
            by_name |= make(lowered.features, layout)
        for name, source in sorted(by_name.items()):
            hashed.update(f"{layout} {name}\n{source.text}\n".encode())
    return hashed.hexdigest()


def tables(lowered: Lowered) -> str:
    """Return the hash of all arrays of a scene, and of its warnings."""
    hashed = hashlib.sha256()
    named = dict(lowered.tables)
    for name in ("vertices", "faces", "tags", "boxes", "settings"):
        named[name] = getattr(lowered, name)
    named |= {"rows": lowered.instances.rows, "instance boxes": lowered.instances.boxes}
    for name, array in sorted(named.items()):
        hashed.update(f"{name} {array.dtype} {array.shape}\n".encode())
        hashed.update(array.tobytes())
    hashed.update(repr((lowered.warnings, lowered.reason, lowered.glass_rows)).encode())
    return hashed.hexdigest()


def hashes(scene: Scene) -> tuple[str, str]:
    """Return the hashes of a scene's texts and tables, or a refused scene's error."""
    try:
        lowered = lower(scene)
    except clpt.ClptError as error:
        return repr(error), ""
    return texts(lowered), tables(lowered)


@click.command()
@click.option("--compare", type=click.Path(exists=True, path_type=Path), help="Former hashes.")
@click.option("--only", default="", help="Part of the names of the scenes to lower.")
def main(compare: Path | None, only: str) -> None:
    """Print the hashes as JSON, or their differences from former hashes."""
    digests: dict[str, str] = {}
    for name, scene in cases(only):
        if only in name:
            digests[f"{name}: texts"], digests[f"{name}: tables"] = hashes(scene)
    for mode in picture_hashes.MODES:
        for cls in materials.LEAVES:
            if not only:
                text = stages.functions_text(cls, mode)
                digests[f"functions {cls.kind} {mode}"] = hashlib.sha256(text.encode()).hexdigest()
    if compare is None:
        click.echo(json.dumps(digests, indent=1))
        return
    former = json.loads(compare.read_text("utf-8"))
    differ = [name for name in {**former, **digests} if former.get(name) != digests.get(name)]
    differ = [name for name in differ if only in name]
    click.echo("\n".join([*differ, f"{len(digests) - len(differ)} of {len(digests)} are equal"]))
    raise SystemExit(bool(differ))


if __name__ == "__main__":
    main()
