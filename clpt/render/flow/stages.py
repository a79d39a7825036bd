"""Generated parts of the stages' text: camera, lights, materials, null surfaces.

The physics is always in a file.
"""

from __future__ import annotations

from collections.abc import Sequence

from clpt.records import PHOTON
from clpt.render.flow import flags
from clpt.render.lights import cases as lights
from clpt.render.materials import cases as parameters
from clpt.render.materials import thin_films
from clpt.render.records import CameraFeatures, Features, GridFeatures, MaterialFeatures
from clpt.render.records import camera as camera_records
from clpt.render.records.dispatch import Case, Function, active
from clpt.render.records.materials import MIXTURE, row_words, words
from clpt.scene.materials import Dielectric
from clpt.scene.params import device_params, interior_params
from clpt.scene.roles import Role
from clpt.scene.scatterer import Scatterer


def camera_text(features: CameraFeatures, *, moves: bool = False) -> str:
    """Return `camera_ray`, or `camera_weighted_ray`; moves: the camera does."""
    kind, losses = features.kind, features.losses or features.ghosts
    record = camera_records.RECORDS[kind]
    camera = f"(global const {record.name} *)(scene).camera"
    moving = '#include "cameras/motion.cl"\n' * moves
    if features.weighs:
        return (
            f"{record.uniform_text()}{_lens_text(losses) if kind == 'lens' else ''}"
            f'#include "cameras/kinds/{kind}.cl"\n{moving}'
            "#define camera_weighted_ray(scene, film, lens, lambdas, weight) "
            f"{_moved(f'{kind}_ray(scene, {camera}, film, lens, lambdas, weight)', moves)}\n"
        )
    ray = f"{kind}_ray({camera}, film, lens)"
    if features.disperses:
        row = f"(integer)(({camera})->glass)"
        ray = f"{kind}_glass_ray({camera}, film, lens, spectra_row(scene, {row}, lambdas).x)"
    return (
        f'{record.uniform_text()}#include "cameras/kinds/{kind}.cl"\n{moving}'
        f"#define camera_ray(scene, film, lens, lambdas) {_moved(ray, moves)}\n"
    )


def _lens_text(losses: bool) -> str:
    """Return the rows of a lens's surfaces, and the waves in their films where light is lost."""
    surface = camera_records.LENS_SURFACE
    return (
        f"{surface.row_text()}{surface.spread_text()}"
        f"#define LENS_SURFACE_WORDS {surface.words}\n"
        f"#define LENS_GHOST_CELLS {camera_records.GHOST_CELLS}\n"
        + '#include "materials/film_stack.cl"\n'
        * losses
    )


def _moved(ray: str, moves: bool) -> str:
    return f"camera_moved(scene, {ray})" if moves else ray


def connect_text(features: Features) -> str:
    """Return `camera_connect` for light paths, or the file of a lens's ghosts.

    The text is empty if no path is connected to the camera.
    """
    if features.transport.lit_ghosts and features.transport.light_paths:
        return '#include "cameras/kinds/lens.cl#ghosts"\n'
    if not features.transport.joined:
        return ""
    kind = features.camera.kind
    record = camera_records.RECORDS[kind]
    files = f'#include "cameras/kinds/{kind}.cl#connect"\n'
    camera = f"(global const {record.name} *)(scene).camera"
    name = "camera_connect_still" if features.motion.camera else "camera_connect"
    moves = '#include "cameras/motion.cl#connect"\n' * features.motion.camera
    return (
        f"{files}#define {name}(scene, p, away, lens) "
        f"camera_near(scene, {kind}_connect({camera}, "
        f"(scene).settings, p, away, lens))\n{moves}"
    )


def screen_text(features: Features) -> str:
    """Return `camera_screen`, the projection of a point to the film, for the layer of motion."""
    if not features.screen_motion:
        return ""
    kind = features.camera.kind
    camera = f"(global const {camera_records.RECORDS[kind].name} *)(scene).camera"
    return (
        f'#include "cameras/kinds/{kind}.cl#screen"\n#define camera_screen(scene, p, away, seen) '
        f"{kind}_screen({camera}, p, away, seen)\n"
    )


def photon_text(features: Features) -> str:
    """Return the struct of a photon, and `photon_met(kind)`: whether a material stores photons.

    A mixture stores photons before its part is chosen. `photon_along(kind)`: the same in a medium
    of a phase function; `photon_collides(kind)`: whether the kind is a phase function.
    """
    leaves = [*enumerate(features.materials.leaves)]
    kinds = [i for i, cls in leaves if flags.gathers_photons(features, cls)]
    along = [i for i, cls in leaves if flags.gathers_along(features, cls)]
    asked = {
        "met": [*kinds, *along, MIXTURE],
        "along": along,
        "collides": _phases(features),
    }
    rows = [f"{PHOTON.row_text(many=True)}{PHOTON.keep_text()}#define PHOTON_WORDS {PHOTON.words}"]
    rows += [f"#define photon_{name}(kind) ({_among(of)})" for name, of in asked.items()]
    return "\n".join([*rows, ""])


def phases_text(features: Features) -> str:
    """Return `is_phase(kind)`: whether a material is a phase function."""
    return f"#define is_phase(kind) ({_among(_phases(features))})\n"


def _phases(features: Features) -> list[int]:
    """Return the numbers of the phase functions of a scene."""
    return [i for i, cls in enumerate(features.materials.leaves) if cls.is_phase]


def _among(kinds: Sequence[int]) -> str:
    """The condition, in each lane, that a kind is among kinds."""
    return " | ".join(f"((kind) == {kind})" for kind in kinds) or "mask_of(0)"


def grid_words_text(grids: GridFeatures) -> str:
    """Return the offsets of the words of a grid's colours and parts from its coefficients."""
    albedo = (
        19 + 6 * grids.emissive
    )  # behind the words of its light, kernels/media/medium_grid_light.cl
    colour = albedo + grids.tinted
    words = {"ALBEDO": albedo, "COLOUR": colour, "MIXED": colour + grids.coloured}
    rows = [f"#define GRID_{name} (2 * MEDIUM_SCATTERING + {n})" for name, n in words.items()]
    # whether extinction has other colours from point to point
    return "\n".join([*rows, f"#define GRIDS_VARY {int(grids.coloured or grids.mixed > 0)}", ""])


def lights_text(features: Features) -> str:
    """Return the loader of emissions, for all their sources in this scene, and the dispatch."""
    emissions = lights.emission_sources(features)
    factors = features.materials.sources_of("factor").get("value", frozenset())
    densities = lights.densities_text(features) if features.transport.balanced else ""
    return (
        ('#include "generated/textures.cl"\n' if "texture" in emissions | factors else "")
        + parameters.emission_text(emissions)
        + (parameters.factor_text(factors) if factors else "")
        + lights.dispatch_text(features, densities)
    )


def null_transmittance_text(features: Features) -> str:
    """Return `null_transmittance`: the share of light that passes a surface without a vertex.

    Mixtures have a function for each level of nesting, since kernels cannot call themselves.
    """
    leaves = [*enumerate(features.materials.leaves)]
    passing = [f"(MATERIAL_KIND(word) == {i})" for i, cls in leaves if cls.is_null]
    arguments = "(Scene scene, integer word, TexturePoint point, Wavelengths lambdas, real c)"
    passes = f"sel({' | '.join(passing) or 'mask_of(0)'}, (real)(1.0f), (real)(0.0f))"
    of = "Spectrum" if features.materials.free_panes else "real"
    parts, cases = [], []
    for i, cls in leaves if features.materials.free_panes else ():
        if cls.is_pane:
            parts += _pane_text(features, cls)
            load = f"{cls.__name__} r = {cls.kind}_load"
            row = active("MATERIAL_ROW(word)")
            cases.append(
                Case(
                    f"MATERIAL_KIND(word) == {i}",
                    "thin_slab_passed(c, r.int_ior, r.ext_ior, r.specular_transmittance)",
                    (f"{load}(scene, {row}, point, lambdas);",),
                )
            )
    first = Function(f"{of} null_transmittance_0{arguments}", f"passage_of({passes})", cases)
    parts.append(first.text())
    last, name = features.materials.mixtures, "null_transmittance"
    parts += [
        f"{of} {name}_{i + 1}{arguments}\n{{\n    MIXTURE_TRANSMITTANCE({name}_{i})\n}}\n"
        for i in range(last)
    ]
    return "".join([*parts, f"#define {name} {name}_{last}\n"])


def _pane_text(features: Features, cls: type[Scatterer]) -> list[str]:
    """The struct and the loader of thin glass."""
    sources = features.materials.sources_of(cls.kind)
    return [
        '#include "materials/fresnel.cl#thin_slab"\n',
        parameters.struct_text(cls, sources),
        parameters.load_text(cls, sources, "materials"),
    ]


def smooth_boundary_text(features: Features) -> str:
    """Return the kind of smooth boundaries, for rays that leave sealed media."""
    if not features.media.escapes:
        return ""
    number, sources = features.materials.leaves.index(Dielectric), features.materials.sources_of
    return (
        f"#define SMOOTH_BOUNDARY {number}\n"
        + functions_text(Dielectric, features.spectra.mode, features)
        + parameters.load_text(Dielectric, sources(Dielectric.kind), "materials")
    )


def functions_text(cls: type[Scatterer], mode: str, features: Features | None = None) -> str:
    """Return a kind's struct and functions, with the files of its boundary.

    features: with the sources of its parameters; without features all are constants.
    """
    loaded = features.materials if features else MaterialFeatures()
    sources, layer = loaded.sources_of(cls.kind), loaded.sources_of("layer")
    measured = sources.get("data", frozenset())
    boundary = thin_films.boundary_text(cls, mode, sources, layer)
    used = {param.role for param in device_params(cls).values()}
    for role, table in parameters.TABLES.items():
        if role in used:
            boundary += _counts_text(role, measured) if table.counted else ""
            boundary += f'#include "{table.file}"\n'
            boundary += f'#include "{table.load_file}"\n' if features else ""
    struct, declared = parameters.struct_text(cls, sources), _declared_text(cls)
    return f'{boundary}{struct}{declared}#include "{cls.folder}/{cls.kind}.cl"\n'


def _counts_text(role: Role, sources: frozenset[str]) -> str:
    """Define the counts at the head of a measurement, where all of a scene have the same."""
    if len(sources) != 1:
        return ""
    _, *counts = next(iter(sources)).split()
    chosen = " : ".join(f"(i) == {i} ? {count}" for i, count in enumerate(counts))
    return f"#define {role.name.upper()}_COUNT(t, i) ((integer)({chosen} : 0))\n"


def _declared_text(cls: type[Scatterer]) -> str:
    """Declare a kind's costly functions as inline.

    Then compilers remove lobes that a scene does not use, and shared parts of the functions.
    """
    types = {"sample": "BsdfSample", "eval": "Spectrum", "pdf": "real", "pdfs": "Spectrum"}
    last = {"sample": "vec3 u"}
    return "".join(
        f"inline {types[verb]} {cls.kind}_{verb}"
        f"({cls.__name__} m, vec3 wo, {last.get(verb, 'vec3 wi')});\n"
        for verb in types
        if verb != "pdfs" or cls.chromatic
    )


def bsdf_text(features: Features, cls: type[Scatterer]) -> str:
    """Return a kind's struct, functions and loader, under the names that the integrators use."""
    kind = cls.kind
    reflectivity = "(m).reflectivity" if "reflectivity" in device_params(cls) else "(real)(0.0f)"
    others = {
        "pdfs": cls.chromatic,
        "across": flags.refracts_widely(features, cls),
        "diffuse_lobe": features.film.coats and cls.has_diffuse_lobe,
    }
    lobeless = features.film.coats and not cls.has_diffuse_lobe
    verbs = ("sample", "eval", "pdf", "albedo", "load", *(verb for verb in others if others[verb]))
    return "\n".join(
        [
            functions_text(cls, features.spectra.mode, features),
            parameters.load_text(
                cls,
                features.materials.sources_of(kind),
                "materials",
                flags.filters_at_random(features, cls),
            ),
            f"typedef {cls.__name__} Bsdf;",
            f"#define BSDF_REFLECTIVITY(m) {reflectivity}",
            *(f"#define bsdf_{verb} {kind}_{verb}" for verb in verbs),
            "#define bsdf_albedo_in(scene, m) bsdf_albedo(m)",
            "#define bsdf_diffuse_lobe(m, wo) diffuse_lobe_nothing()" if lobeless else "",
            f"#define BSDF_INTERIOR(row) {interior(cls)}" if features.media.absorbing else "",
            *(_shift_text(cls) if flags.fluoresces(features, cls) else ()),
            "",
        ]
    )


def interior(cls: type[Scatterer]) -> str:
    """The name of the medium inside of a material at `row`, see kernels/media/medium.cl."""
    declared = interior_params(cls)
    first = row_words(cls) - sum(map(words, declared.values()))
    inside = f"((row) + {1 + first})" if declared else "((integer)(0))"
    if declared and "thin" in device_params(cls):  # a sheet has no inside
        at = parameters.word_before(cls, "thin")
        thin = f"gather_i(scene.materials, (row) + {at}) != 0"
        inside = f"sel_i({thin}, (integer)(0), {inside})"
    return inside


def _shift_text(cls: type[Scatterer]) -> list[str]:
    """`bsdf_shift`: the wavelengths of light that excites a surface at `row`."""
    at = parameters.word_before(cls, "reradiation")
    table = f"gather_i((scene).materials, (row) + {at})"
    values = "&(m).reflectance, &(m).reradiation, (m).amount"
    return [
        '#include "materials/reradiation.cl"',
        "#define bsdf_shift(scene, row, m, lambdas, u, depth) "
        f"reradiation_shift(scene, {table}, {values}, lambdas, u, depth)",
    ]
