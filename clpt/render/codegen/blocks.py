"""Blocks: which words of a slot's state shading reads and changes, see kernels/path/queue.cl."""

from __future__ import annotations

from collections.abc import Iterable

from clpt.layout import Record
from clpt.records import HIT, PATH, SHADOW, SLABS
from clpt.render.codegen import flags
from clpt.render.contract.features import Features

CHANGED = (
    "o", "d", "beta", "radiance", "lambdas", "pdf", "sampled_hemisphere", "null_distance", "nulls",
    "ratio", "eta", "medium", "lead", "rival", "pending", "state",
)  # fmt: skip
READ = ("weight", "light", "pixel_index", "pixel_key", "sample")  # and not changed
# members that a scene has only with a flag
NEEDED = {
    "lambdas": "SPECTRAL",
    "sampled_hemisphere": "USES_HEMISPHERE",
    "null_distance": "USES_NULL_SURFACES",
    "nulls": "USES_NULL_SURFACES",
    "ratio": "USES_DISPERSION",
    "medium": "USES_ABSORPTION",
    "lead": "USES_ABSORPTION",
    "rival": "WEIGHS_LIGHT_PATHS",
    "pending": "MERGES",
    "weight": "LIGHT_PATHS",
    "light": "WEIGHS_LIGHT_PATHS",
    "pixel_index": "LIGHT_PATHS",
    "film": "LIGHT_PATHS",
    "instance": "USES_INSTANCES",
}


def members(features: Features) -> dict[str, list[str]]:
    """Return the members of each slab that a block takes, and as "changed" those of a path that
    shading may change, which come first."""
    defined = flags.defines(flags.SCENE, features)

    def there(names: Iterable[str]) -> list[str]:
        has = {"SPECTRAL": features.mode == "spectral", "": True, **defined}
        return [name for name in names if has.get(NEEDED.get(name, ""))]

    return {
        "changed": there(CHANGED),
        "path": there((*CHANGED, *READ)),
        "hit": there(m.name for m in HIT.members),
        "shadow": there(m.name for m in SHADOW.members),
    }


def block_text(features: Features) -> str:
    """Return the words of each slab that a block takes."""
    kept = members(features)

    def words(record: Record, names: Iterable[str]) -> list[int]:
        found = []
        for member in (next(m for m in record.members if m.name == name) for name in names):
            count = member.words - (member.type == "spectrum" and features.mode == "rgb")
            found += [member.word + i for i in range(count)]
        return found

    lines = [f"#define BLOCK_PATH_CHANGED {len(words(PATH, kept['changed']))}"]
    for record in SLABS:
        name, own = record.name.upper(), words(record, kept[record.name.lower()])
        lines.append(f"#define BLOCK_{name} {len(own)}")
        lines.append(f"constant uchar BLOCK_{name}_WORDS[] = {{{', '.join(map(str, own))}}};")
    return "\n".join([*lines, f"#define SHADOW_T {words(SHADOW, ['t'])[0]}", ""])
