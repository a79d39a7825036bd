"""A film: the features of its filter, sums and layers, and the names in its layers."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from clpt.render.records.macros import flag, macro, number
from clpt.scene.layers import LAYERS, WORDS, Form


def layer_places(names: Iterable[str]) -> dict[str, int]:
    """Return the first of a pixel's words for each layer of the first samples, after their number.

    Layers for denoisers come last.
    """
    places, word = {}, 1
    for name in names:
        if LAYERS[name].form in WORDS:
            places[name] = word
            word += LAYERS[name].words
    return places


@dataclass(frozen=True)
class FilterFeatures:
    """The pixel filter."""

    kind: str = "box"
    taps: int = number("FILTER_TAPS")  # pixels of an axis that light may serve; 0: its own alone
    reach: int = number("FILTER_REACH")  # how far these are from its own
    profile: int = number("FILTER_PROFILE")  # where in `distributions` its values begin

    @property
    @macro("FILTER_BOX")
    def is_box(self) -> bool:
        """Whether the filter weighs all light alike."""
        return self.kind == "box"


@dataclass(frozen=True)
class LayerFeatures:
    """The layers beside the picture, by their names in the order of LAYERS."""

    names: tuple[str, ...] = ()
    present: bool = False  # for any kind of paths of the scene
    material_numbers: int = 0  # where they stand in `distributions`
    primitive_rows: int = 0  # where those stand of shapes whose primitives have other rows
    light_groups: int = 0  # of lights, where there is a layer for each
    light_group_row: int | None = None  # where in `distributions` they are
    time_bins: int = 0  # of light by time

    @property
    def places(self) -> dict[str, int]:
        """The first word of each layer of the first samples."""
        return layer_places(self.names)

    @property
    def first_for_denoisers(self) -> int:
        """The first word of the layers for denoisers, which come last; 0 where there is none."""
        places = self.places
        return min((places[name] for name in places if LAYERS[name].denoising), default=0)

    @property
    def words(self) -> int:
        """Words of a pixel that these have, with the number of samples, which mattes need too."""
        if not self.places and not self.mattes:
            return 0
        return 1 + sum(LAYERS[name].words for name in self.names)

    @property
    def of_surfaces(self) -> bool:
        """Whether some layer is of the first surface that is seen."""
        first = (name for name in self.places if not LAYERS[name].denoising)
        return any(first) or bool(self.mattes)

    @property
    @macro("USES_LAYERS")
    def first_samples(self) -> bool:
        """Whether the first samples of a pixel add to some layer."""
        return self.words > 0

    @property
    def mattes(self) -> tuple[str, ...]:
        """The layers that are lists of names."""
        return self._of("matte")

    @property
    def matte_count(self) -> int:
        """Number of layers that are lists of names."""
        return len(self.mattes)

    @property
    def matte_of_objects(self) -> int:
        """1 more than where the list of objects stands."""
        return _number("crypto_object", self.mattes)

    @property
    def matte_of_materials(self) -> int:
        """1 more than where the list of materials stands."""
        return _number("crypto_material", self.mattes)

    @property
    def lights(self) -> tuple[str, ...]:
        """The layers of light; `light_groups`, which comes last, is a picture for each group."""
        return self._of("light")

    @property
    @macro("LIGHT_LAYERS")
    def light_pictures(self) -> int:
        """Number of pictures of light beside the picture, of each group of sums."""
        names = len(self.lights) + (self.light_groups - 1 if self.groups else 0)
        return names + (self.time_bins + 1 if self.time_bins else 0)

    @property
    def times(self) -> int:
        """1 more than where light by time begins, which comes last; 0 where there is none."""
        return self.light_pictures - self.time_bins if self.time_bins else 0

    @property
    def direct(self) -> int:
        """1 more than where the layer of direct light stands."""
        return _number("direct", self.lights)

    @property
    def indirect(self) -> int:
        """1 more than where the layer of indirect light stands."""
        return _number("indirect", self.lights)

    @property
    @macro("LIGHT_LAYER_GROUPS")
    def groups(self) -> int:
        """1 more than where the layers of the groups of lights begin."""
        return _number("light_groups", self.lights)

    def _of(self, form: Form) -> tuple[str, ...]:
        return tuple(name for name in self.names if LAYERS[name].form == form)


def _number(name: str, names: tuple[str, ...]) -> int:
    """1 more than where a name stands, 0 where it does not."""
    return names.index(name) + 1 if name in names else 0


@dataclass(frozen=True)
class FilmFeatures:
    """The sums of a pixel of the film."""

    filter: FilterFeatures = FilterFeatures()
    layers: LayerFeatures = LayerFeatures()
    first_word: int = 0  # the first of a pixel's words that paths add to
    bands: bool = flag("USES_BANDS")  # a spectral film
    alpha: bool = flag("USES_ALPHA")  # a film with coverage
    reuse: bool = False  # its pixels share second vertices of paths
    coats: bool = False  # and some of these are below a coat


@dataclass(frozen=True)
class LayerNames:
    """Names of the shapes, materials and groups of lights in a scene's layers.

    objects: of the scene's shapes, in their order; materials: of all materials, by number;
    light_groups: of groups of lights.
    """

    objects: tuple[str, ...] = ()
    materials: tuple[str, ...] = ()
    light_groups: tuple[str, ...] = ()
