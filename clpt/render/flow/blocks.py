"""Blocks: the words of a slot's state that shading uses, see kernels/transport/queue.cl."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from clpt.records import HIT, REUSE_GROUP, SHADOW, SLABS
from clpt.render.records import Features

ESCAPE = ("escape", "escape_axis", "escape_width", "escape_plane", "escape_depth")
REUSE = ("reuse", "reuse_n", "reuse_ns", "reuse_beta", "reuse_y", "reuse_yn", "reuse_yns")
COATS = ("reuse_coat", "reuse_y_coat")
CHANGED = (
    "o", "d", "beta", "radiance", "lambdas", "pdf", "sampled_hemisphere", "sampled_wo",
    "sampled_gloss", "null_distance", "nulls", "ratio", "eta", "length", "slope", "medium",
    "around", "bodies", "ray_offset", "mis_ratio", "merge_ratio", "expected", *ESCAPE, "state",
    "cone", *REUSE, *COATS,
)  # fmt: skip
READ = ("weight", "light", "time", "pixel_index", "pixel_key", "sample")  # and not written
# optional members, each with the features that need it
NEEDED: dict[str, Callable[[Features], bool]] = {
    "lambdas": lambda f: f.spectra.spectral,
    "sampled_hemisphere": lambda f: f.hemispheres,
    "sampled_wo": lambda f: f.lights.gloss > 0,
    "sampled_gloss": lambda f: f.lights.gloss > 0,
    "null_distance": lambda f: f.materials.null_surfaces or "depth" in f.film.layers.names,
    "nulls": lambda f: f.materials.null_surfaces,
    "ratio": lambda f: f.ratios,
    "length": lambda f: f.film.layers.time_bins > 0,
    "slope": lambda f: f.grouped,
    "medium": lambda f: f.media.absorbing,
    "around": lambda f: f.media.present and f.media.absorption and not f.media.bodies,
    "bodies": lambda f: f.media.bodies,
    "ray_offset": lambda f: f.media.absorbing,
    "through": lambda f: f.shadow_media,
    "into": lambda f: f.lights.volumes,
    # kernels take these words by their number
    **dict.fromkeys((f"reuse_density{k}" for k in range(REUSE_GROUP)), lambda _: False),
    "mis_ratio": lambda f: f.transport.balanced,
    "merge_ratio": lambda f: f.transport.merged,
    "expected": lambda f: f.transport.guided,
    **dict.fromkeys(ESCAPE, lambda f: f.media.escapes),
    "cone": lambda f: f.textures.mips,
    **dict.fromkeys((*REUSE, "reuse_x", "reuse_before"), lambda f: f.film.reuse),
    **dict.fromkeys(COATS, lambda f: f.film.coats),
    "weight": lambda f: f.transport.light_paths or _has_layers(f),
    "light": lambda f: f.transport.balanced,
    "time": lambda f: f.motion.present,
    "pixel_index": lambda f: f.transport.light_paths or _has_layers(f),
    "film": lambda f: f.transport.light_paths,
    "instance": lambda f: f.geometry.instances,
}


def _has_layers(features: Features) -> bool:
    """Whether a film has layers beside the picture."""
    layers = features.film.layers
    return layers.first_samples or layers.light_pictures > 0


# members that stages other than shading use too, whatever the flags above
ELSEWHERE = frozenset({"weight", "light", "pixel_index", "film"})


def unused(features: Features) -> frozenset[str]:
    """Return the members of slabs that no kind of paths of a scene uses."""
    used = set(ELSEWHERE)
    for kind in features.passes:
        used |= {name for name in NEEDED if _has(kind, name)}
    return frozenset(NEEDED.keys() - used)


def _has(features: Features, name: str) -> bool:
    """Whether paths with these features have a member."""
    return name not in NEEDED or NEEDED[name](features)


def members(features: Features) -> dict[str, list[str]]:
    """Return the members of each slab in a block.

    "changed" has the members of a path that shading may write; they come first in "path".
    """

    def there(names: Iterable[str]) -> list[str]:
        return [name for name in names if _has(features, name)]

    chosen = ("light",) if features.film.layers.groups else ()  # by next-event estimation
    changed = [*there(CHANGED), *chosen]
    return {
        "changed": changed,
        "path": [*changed, *(name for name in there(READ) if name not in chosen)],
        "hit": there(m.name for m in HIT.members),
        "shadow": there(m.name for m in SHADOW.members),
    }


def blocks_text(kinds: Sequence[Features]) -> str:
    """Return the table of the words in a block: `BLOCK_WORDS(which)` for each kind of paths.

    Words of a path that shading may write are first.
    """
    counted = "".join(f"    uint {name};\n" for name in ("path", "changed", "hit", "shadow"))
    arrays = "".join(f"    uchar {r.name.lower()}_words[{r.words}];\n" for r in SLABS)
    rows = [f"typedef struct {{\n{counted}{arrays}}} BlockWords;"]
    values = []
    for features in kinds:
        kept = members(features)
        words = {name: _words(features, name, names) for name, names in kept.items()}
        counts = [str(len(words[name])) for name in ("path", "changed", "hit", "shadow")]
        lists = (", ".join(map(str, words[record.name.lower()])) for record in SLABS)
        values.append(", ".join([*counts, *(f"{{{numbers}}}" for numbers in lists)]))
    table = ", ".join(f"{{{row}}}" for row in values)
    rows.append(f"constant BlockWords block_words[{len(kinds)}] = {{{table}}};")
    which = "which" if len(kinds) > 1 else "0"
    rows.append(f"#define BLOCK_WORDS(which) (&block_words[{which}])")
    return "\n".join([*rows, ""])


def _words(features: Features, slab: str, names: Iterable[str]) -> list[int]:
    """The words of a slab's members; "changed" is a part of a path's."""
    record = next(r for r in SLABS if r.name.lower() == ("path" if slab == "changed" else slab))
    words: list[int] = []
    for member in (next(m for m in record.members if m.name == name) for name in names):
        count = member.words - (member.type == "spectrum" and not features.spectra.spectral)
        words += [member.word + i for i in range(count)]
    return words
