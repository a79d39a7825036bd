"""Cryptomatte: the objects or materials that a pixel shows, and the coverage of each.

Specification 1.2 (Friedman and Jones, Psyop): names are hashed to float32; channels hold pairs of a
hash and a coverage, by falling coverage. The header has the names.
"""

from __future__ import annotations

import json
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Image, Words

RANKS = 6  # pairs of a pixel in a file
COUNT_BITS = 7  # lowest bits of a matte's word, see kernels/film/layers.cl
LETTERS = ("red", "green", "blue", "alpha")  # channels of two pairs in a file
SHORT_LETTERS = ("r", "g", "b", "a")  # their names in Blender


def murmur3_32(text: str) -> int:
    """Return MurmurHash3_x86_32 with the seed 0 of a text in UTF-8 (Appleby, public domain)."""
    data, mask = text.encode("utf-8", "replace"), 0xFFFFFFFF

    def scrambled(k: int) -> int:
        k = k * 0xCC9E2D51 & mask
        return ((k << 15 | k >> 17) & mask) * 0x1B873593 & mask

    h, whole = 0, len(data) // 4 * 4
    for i in range(0, whole, 4):
        h ^= scrambled(int.from_bytes(data[i : i + 4], "little"))
        h = ((h << 13 | h >> 19) * 5 + 0xE6546B64) & mask
    h ^= scrambled(int.from_bytes(data[whole:], "little")) ^ len(data)
    h = (h ^ h >> 16) * 0x85EBCA6B & mask
    h = (h ^ h >> 13) * 0xC2B2AE35 & mask
    return h ^ h >> 16


def name_bits(name: str) -> int:
    """Return the bits of the float32 that stands for a name: neither infinite, NaN nor tiny."""
    h = murmur3_32(name)
    exponent = h >> 23 & 255
    return h ^ 1 << 23 if exponent in (0, 255) else h


def pairs_of(slots: Words, samples: Words, names: Sequence[str]) -> Image:
    """Return RANKS pairs of hash and coverage of each pixel, (h, w, 2 RANKS) float32.

    slots: (slots, h, w), words of a matte; samples: (h, w), their numbers; names: by number.
    """
    codes = np.array([0, *map(name_bits, names)], np.uint32)
    hashes, counts = codes[slots >> COUNT_BITS], (slots & (1 << COUNT_BITS) - 1).astype(np.int64)
    hashes, counts = _joined(hashes, counts)
    order = np.argsort(-counts, axis=0, kind="stable")[:RANKS]
    hashes, counts = np.take_along_axis(hashes, order, 0), np.take_along_axis(counts, order, 0)
    present = counts > 0
    pairs = np.zeros((*slots.shape[1:], RANKS, 2), np.float32)
    pairs[..., 0] = np.moveaxis(
        np.where(present, hashes, 0).astype(np.uint32).view(np.float32), 0, 2
    )
    pairs[..., 1] = np.moveaxis(np.where(present, counts / np.maximum(samples, 1), 0.0), 0, 2)
    return pairs.reshape(*slots.shape[1:], 2 * RANKS)


def _joined(
    hashes: NDArray[np.uint32], counts: NDArray[np.int64]
) -> tuple[NDArray[np.uint32], NDArray[np.int64]]:
    """Return hashes and counts (slots, h, w) with the counts of equal hashes added up."""
    order = np.argsort(hashes, axis=0, kind="stable")
    hashes, counts = np.take_along_axis(hashes, order, 0), np.take_along_axis(counts, order, 0)
    for i in range(len(hashes) - 1):
        same = hashes[i] == hashes[i + 1]
        counts[i + 1] += np.where(same, counts[i], 0)
        counts[i] = np.where(same, 0, counts[i])
    return hashes, counts


def channels_of(prefix: str, pairs: Image, letters: Sequence[str] = LETTERS) -> dict[str, Image]:
    """Return pairs (h, w, 2 n) as channels of a file, such as CryptoObject00.red."""
    return {f"{prefix}{i // 4:02d}.{letters[i % 4]}": pairs[..., i] for i in range(pairs.shape[2])}


def attributes_of(prefix: str, names: Sequence[str]) -> dict[str, str]:
    """Return the attributes of a file with such channels: the names behind the hashes."""
    key = f"cryptomatte/{murmur3_32(prefix):08x}"[: len("cryptomatte/") + 7]
    manifest = {name: f"{name_bits(name):08x}" for name in dict.fromkeys(names)}
    return {
        f"{key}/name": prefix,
        f"{key}/hash": "MurmurHash3_32",
        f"{key}/conversion": "uint32_to_float32",
        f"{key}/manifest": json.dumps(manifest, ensure_ascii=False, separators=(",", ":")),
    }
