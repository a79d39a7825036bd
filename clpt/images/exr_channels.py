"""Which channels of an OpenEXR file are its picture, by their names.

A name is a layer, a dot and a letter; the letters of a picture are R, G, B and A, or Y, RY, BY and
A ("Technical Introduction to OpenEXR", Channel Names), here in small letters too. The rule:

1. of each part in turn, those without a layer; X, Y and Z too, which are XYZ;
2. else of each part in turn, those of a layer: of one whose last word is in FAVOURED, else of the
   first one;
3. else, of the first part: its only channel; X, Y and Z of a layer; else all, which are numbers.

Parts without names, which are deep ones, are passed over.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

FAVOURED = ("combined", "beauty", "rgba", "rgb", "color", "colour")  # Blender's is the first


@dataclass(frozen=True)
class Choice:
    """The channels of a picture.

    part: which they are of; names: in the order of the image. form: "rgb", "xyz", "grey", "chroma"
    (luminance and chroma) or "numbers"; all but the last may have alpha. note: what is to be told
    of the choice.
    """

    part: int
    names: tuple[str, ...]
    form: str
    note: str = ""


def choose(parts: Sequence[Sequence[str]]) -> Choice:
    """Choose among the names of the channels of each part."""
    layers = [_layers(names) for names in parts]
    for number, found in enumerate(layers):
        if made := _picture(number, found.get("", {}), whole=True):
            return made
    made, taken = None, ""
    others: list[str] = []
    for number, found in enumerate(layers):
        named = {layer: _picture(number, letters) for layer, letters in found.items()}
        pictures = {layer: picture for layer, picture in named.items() if picture}
        others += pictures
        if made is None and pictures:
            layer = min(pictures, key=_rank)  # the first one of the lowest rank
            made = pictures[layer]
            taken = layer
    if made is None:
        number = next((i for i, names in enumerate(parts) if names), 0)
        return _numbers(number, parts[number], layers[number])
    if len(others) == 1 or _rank(taken) < len(FAVOURED):
        return made
    note = f"its picture is taken from the layer {taken!r}; others with colours are left out"
    return Choice(made.part, made.names, made.form, note)


def _layers(names: Sequence[str]) -> dict[str, dict[str, str]]:
    """The names by layer and letter, which is a capital; the name with a capital comes first."""
    made: dict[str, dict[str, str]] = {}
    for name in sorted(names):
        layer, _, letter = name.rpartition(".")
        made.setdefault(layer, {}).setdefault(letter.upper(), name)
    return made


def _rank(layer: str) -> int:
    word = layer.rpartition(".")[2].lower()
    return next((i for i, one in enumerate(FAVOURED) if word == one), len(FAVOURED))


def _picture(part: int, letters: Mapping[str, str], whole: bool = False) -> Choice | None:
    """The picture that the letters of a layer make; whole: of no layer."""
    alpha = ("A",) if "A" in letters else ()
    for form, needed in _forms(letters, whole):
        if letters.keys() >= set(needed):
            return Choice(part, tuple(letters[one] for one in (*needed, *alpha)), form)
    return None


def _forms(letters: Mapping[str, str], whole: bool) -> Iterator[tuple[str, tuple[str, ...]]]:
    yield "rgb", ("R", "G", "B")
    yield "chroma", ("Y", "RY", "BY")
    if whole:
        yield "xyz", ("X", "Y", "Z")
    if "X" not in letters:  # else it is a coordinate
        yield "grey", ("Y",)


def _numbers(part: int, names: Sequence[str], layers: Mapping[str, Mapping[str, str]]) -> Choice:
    """The channels of a part without a picture."""
    if len(names) == 1:
        return Choice(part, tuple(names), "numbers")
    for letters in layers.values():
        if letters.keys() >= set("XYZ"):
            return Choice(part, tuple(letters[one] for one in "XYZ"), "numbers")
    every = tuple(sorted(names))
    note = f"has no channels R, G and B, nor Y: {', '.join(every)} are taken as they stand"
    return Choice(part, every, "numbers", note)
