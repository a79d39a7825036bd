"""Blocks: which words of a slot's state shading reads and changes, see kernels/path/queue.cl."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from clpt.records import HIT, SHADOW
from clpt.render.codegen import flags
from clpt.render.contract.features import Features

CHANGED = (
    "o", "d", "beta", "radiance", "lambdas", "pdf", "sampled_hemisphere", "null_distance", "nulls",
    "ratio", "eta", "medium", "bodies", "lead", "rival", "pending", "expected", "state",
    "cone",
)  # fmt: skip
READ = ("weight", "light", "time", "pixel_index", "pixel_key", "sample")  # and not changed
# members that a scene has only with a flag, or one of two
NEEDED = {
    "lambdas": "SPECTRAL",
    "sampled_hemisphere": "USES_HEMISPHERE",
    "null_distance": "USES_NULL_SURFACES",
    "nulls": "USES_NULL_SURFACES",
    "ratio": "USES_RATIO",
    "medium": "USES_ABSORPTION",
    "bodies": "USES_BODIES",
    "lead": "USES_ABSORPTION",
    "through": "SHADOW_MEDIA",
    "into": "BRICK_LIGHTS",
    "rival": "WEIGHS_LIGHT_PATHS",
    "pending": "MERGES",
    "expected": "USES_GUIDE",
    "cone": "USES_MIPS",
    "weight": "LIGHT_PATHS USES_LAYERS LIGHT_LAYERS",
    "light": "WEIGHS_LIGHT_PATHS",
    "time": "USES_MOTION",
    "pixel_index": "LIGHT_PATHS USES_LAYERS LIGHT_LAYERS",
    "film": "LIGHT_PATHS",
    "instance": "USES_INSTANCES",
}


def members(features: Features) -> dict[str, list[str]]:
    """Return the members of each slab that a block takes, and as "changed" those of a path that
    shading may change, which come first."""
    defined = flags.of_scene(features)

    def there(names: Iterable[str]) -> list[str]:
        has = {"SPECTRAL": features.spectra.spectral, "": True, **defined}
        wanted = {name: NEEDED[name].split() if name in NEEDED else [""] for name in names}
        return [name for name, of in wanted.items() if any(has.get(flag) for flag in of)]

    chosen = ("light",) if "LIGHT_LAYER_GROUPS" in defined else ()  # by next-event estimation
    changed = [*there(CHANGED), *chosen]
    return {
        "changed": changed,
        "path": [*changed, *(name for name in there(READ) if name not in chosen)],
        "hit": there(m.name for m in HIT.members),
        "shadow": there(m.name for m in SHADOW.members),
    }


def blocks_text(kinds: Sequence[Features]) -> str:
    """Return `blocks_0` and further, for each kind of paths: the words of a slot's state that a
    block takes, of a path first those that shading may change."""
    numbers = "".join(f"    uint {name};\n" for name in ("path", "changed", "hit", "shadow"))
    slabs = kinds[0].slabs
    arrays = "".join(f"    uchar {r.name.lower()}_words[{r.words}];\n" for r in slabs)
    t = next(m.word for m in SHADOW.members if m.name == "t")
    rows = [f"typedef struct {{\n{numbers}{arrays}}} BlockWords;", f"#define SHADOW_T {t}"]
    for which, features in enumerate(kinds):
        kept = members(features)
        own = {name: _words(features, name, names) for name, names in kept.items()}
        counts = [str(len(own[name])) for name in ("path", "changed", "hit", "shadow")]
        lists = (", ".join(map(str, own[record.name.lower()])) for record in slabs)
        values = ", ".join([*counts, *(f"{{{words}}}" for words in lists)])
        rows.append(f"constant BlockWords blocks_{which} = {{{values}}};")
    return "\n".join([*rows, ""])


def _words(features: Features, slab: str, names: Iterable[str]) -> list[int]:
    """The words of a slab's members; "changed" is a part of a path's."""
    record = next(
        r for r in features.slabs if r.name.lower() == ("path" if slab == "changed" else slab)
    )
    found = []
    for member in (next(m for m in record.members if m.name == name) for name in names):
        count = member.words - (member.type == "spectrum" and not features.spectra.spectral)
        found += [member.word + i for i in range(count)]
    return found
