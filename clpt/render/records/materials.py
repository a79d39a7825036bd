"""Materials: the words of parameters in a row, and the features of materials."""

from __future__ import annotations

from dataclasses import dataclass

from clpt.records import MATERIAL_KINDS, RERADIATION_SIZES
from clpt.render.records.macros import flag, macro
from clpt.scene import roles
from clpt.scene.params import Kind, device_params, interior_params
from clpt.scene.roles import INDEX, ORDERS, Param, Role
from clpt.scene.scatterer import Scatterer

NORMAL_MAP_WORDS = 23  # before a material's row, see kernels/materials/shading_frame.cl
MIXTURE = MATERIAL_KINDS["mixture"]
FILM_COSINES = 128  # of the table of a film's colours, from 0 to 1
RERADIATION_STEP = RERADIATION_SIZES["step"]  # [nm] between the nodes of a matrix

# How many words a parameter takes in a row of `materials`, `textures` or `light_params`.
SPECTRUM_WORDS = 5  # x y z w and where the value comes from: 0 here, > 0 texture, < 0 table
REAL_WORDS = 2  # the value, and 0 or 1 + the texture
ORDERS_WORDS = 2 * ORDERS + 1
ANGULAR_WORDS = 5  # of the table: first value, cosines, rows; first wavelength, rows a nm
MEASUREMENT_WORDS = 1 + SPECTRUM_WORDS  # its first number; which colour a wavelength has
MERL_WORDS = 4  # its first number; rows of the spectra of red, green and blue
LAYERS_WORDS = 2  # where the layers lie, see clpt.render.materials.thin_films; how many


@dataclass(frozen=True)
class Member:
    """A parameter in kernels: words in its row, and `count` values of a type in its struct."""

    words: int
    lane_type: str
    count: int = 1


MEMBERS: dict[Role, Member] = {
    **dict.fromkeys((*roles.SPECTRA, roles.RERADIATION), Member(SPECTRUM_WORDS, "Spectrum")),
    roles.REAL: Member(REAL_WORDS, "real"),
    roles.FLAG: Member(1, "integer"),
    roles.CHOICE: Member(1, "integer"),
    roles.ORDERS_OF_LIGHT: Member(ORDERS_WORDS, "real", ORDERS_WORDS),
    roles.LAYERS: Member(LAYERS_WORDS, "Layers"),
    roles.ANGULAR: Member(ANGULAR_WORDS, "AngularTable"),
    roles.MEASUREMENT: Member(MEASUREMENT_WORDS, "Measurement"),
    roles.MERL: Member(MERL_WORDS, "MerlTable"),
}


def words(param: Param) -> int:
    """Return the number of 4-byte words that a parameter takes in its row."""
    return MEMBERS[param.role].words


def lane_type(param: Param) -> str:
    """Return the parameter's type in a kind's struct."""
    return MEMBERS[param.role].lane_type


def array_size(param: Param) -> int:
    """Return how many values of `lane_type` a parameter has in a kind's struct."""
    return MEMBERS[param.role].count


def row_words(cls: type[Kind]) -> int:
    """Return the length of a kind's row."""
    return sum(map(words, [*device_params(cls).values(), *interior_params(cls).values()]))


Sources = frozenset[tuple[str, str, str]]


@dataclass(frozen=True)
class MaterialFeatures:
    """The materials that a path may meet.

    leaves: classes of leaf materials in their order, then of phase functions: a material word's
    upper bits count in it; transmitting: kinds of leaves that let light through somewhere; shining:
    kinds of leaves on shapes that are lights; sources: (kind, parameter, source) of all that is
    loaded, of lights and media too, see clpt.render.materials.cases.
    """

    leaves: tuple[type[Scatterer], ...] = ()
    transmitting: tuple[str, ...] = ()
    shining: tuple[str, ...] = ()
    mixtures: int = 0  # how deep masks and blends nest
    normal_mapped: bool = False  # some material has a normal or a bump map
    free_panes: bool = flag("FREE_PANES")  # light goes straight through thin glass
    sources: Sources = frozenset()

    @property
    @macro("BSDF_COUNT")
    def count(self) -> int:
        """Number of kinds."""
        return len(self.leaves)

    @property
    def kinds(self) -> tuple[str, ...]:
        """Names of the leaf materials, in their order."""
        return tuple(cls.kind for cls in self.leaves)

    @property
    def null_surfaces(self) -> bool:
        """Whether some surface lets light through as if it were not there."""
        return self.free_panes or any(cls.is_null for cls in self.leaves)

    @property
    def disperses(self) -> bool:
        """Whether the direction of light depends on its wavelength at some material."""
        indices = (
            (cls.kind, name, "table")
            for cls in self.leaves
            if cls.refracts
            for name, param in device_params(cls).items()
            if param.role is INDEX
        )
        return any(cls.disperses for cls in self.leaves) or not self.sources.isdisjoint(indices)

    def sources_of(self, kind: str) -> dict[str, frozenset[str]]:
        """Return the sources of each parameter of a kind that has some."""
        by_name: dict[str, frozenset[str]] = {}
        for owner, name, source in self.sources:
            if owner == kind:
                by_name[name] = by_name.get(name, frozenset()) | {source}
        return by_name

    def phase_varies(self, cls: type[Scatterer]) -> bool:
        """Return whether a phase function differs between wavelengths."""
        varies = cls.is_phase and cls.chromatic
        sources = frozenset[str]().union(*self.sources_of(cls.kind).values())
        return varies and not sources <= {"grey", "row"}
