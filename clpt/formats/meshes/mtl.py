"""Materials of Wavefront's MTL files (Ramey, Rose, Tyerman 1995), with the common additions.

Its illumination models are made from clpt's materials as docs/meshes.md tells.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import images, spectra
from clpt.choices import Missing
from clpt.errors import SceneError
from clpt.formats.meshes.mtl_statements import (
    BLACK,
    WHITE,
    Options,
    Statement,
    Statements,
    read,
    uncommented,
)
from clpt.formats.reading import EVEN, GREY, find, grey_for
from clpt.scene.lights import Area
from clpt.scene.materials import (
    Blend,
    BumpMap,
    Conductor,
    Dielectric,
    Diffuse,
    Mask,
    Material,
    NormalMap,
    Plastic,
    Principled,
    RoughConductor,
    RoughDielectric,
    RoughPlastic,
    TwoSided,
    parts,
)
from clpt.scene.textures import Bitmap, Product
from clpt.scene.values import ImageLike, Textured
from clpt.spectra import Spectrum, Tabulated

UNSAID = (0.6, 0.6, 0.6)  # Kd
ROUNDING = 1e-3  # of colours that are converted
COAT, SMOOTHEST = 1.5, 1e-4  # index where none above 1 is given; the least alpha of microfacets
CHANNELS = {"r": "r", "g": "g", "b": "b", "m": "a", "l": "luminance"}
UNUSED = {  # options that are left out, and their values that ask for nothing
    "-t": (BLACK,), "-boost": ((0.0,),), "-cc": ("off",), "-type": (), "-imfchan": (*CHANNELS,),
}  # fmt: skip
BEHIND = re.compile(r"\s(?=-(?:s|o|t|mm|bm|blendu|blendv|clamp|imfchan|cc|boost|texres)\s)")
PHYSICAL = ("pr", "pm", "ps", "pc", "aniso", "map_pr", "map_pm", "map_ps", "map_pc")
GLASS = (4, 6, 7, 9)
MIRRORS = (3, 8)


@dataclass
class Library:
    """The materials that the libraries of a mesh hold, and what is told about them."""

    folder: Path
    missing: Missing = "error"
    statements: dict[str, Statements] = field(default_factory=dict)
    short: dict[str, str] = field(default_factory=dict)  # names without comments -> whole names
    absent: list[str] = field(default_factory=list)
    left_out: dict[str, None] = field(default_factory=dict)
    remarks: dict[str, list[str]] = field(default_factory=dict)  # to the materials' names
    read_materials: dict[str, tuple[Material, Area | None]] = field(default_factory=dict)

    def add(self, names: str) -> None:
        """Read the libraries that a line names; a name may have blanks. Raises SceneError."""
        for name in self._split(names):
            path = find(self.folder, name)
            if path is None:
                self.absent.append(name)
                continue
            for key, statements in read(path).items():
                self.statements.setdefault(key, statements)
                self.short.setdefault(uncommented(key), key)

    def _split(self, names: str) -> list[str]:
        for whole in (names, uncommented(names)):
            if find(self.folder, whole) is not None:
                return [whole]
        quoted = r"\"[^\"]+\"|'[^']+'"
        ending = re.findall(rf"{quoted}|\S.*?\.mtl(?=\s|$)", uncommented(names), re.IGNORECASE)
        left = " ".join(ending).split() == uncommented(names).split()
        return ending if ending and left else re.findall(rf"{quoted}|\S+", uncommented(names))

    def known(self, name: str) -> str | None:
        """Return the name of the material that `usemtl name` means, None where there is none."""
        if name in self.statements:
            return name
        short = uncommented(name)
        return short if short in self.statements else self.short.get(name, self.short.get(short))

    def material(self, name: str) -> tuple[Material, Area | None]:
        """Return a known material, and what it emits. Raises SceneError."""
        if name not in self.read_materials:
            self.read_materials[name] = _Maker(self, name, self.statements[name]).material()
        return self.read_materials[name]

    def warnings(self) -> list[str]:
        """Return what was left out, in a line for each kind."""
        messages = [
            f"there is no library {name!r}: what it holds is left out" for name in self.absent
        ]
        if self.left_out:
            messages.append(f"left out of its materials: {', '.join(self.left_out)}")
        for remark, names in self.remarks.items():
            more = f" and {len(names) - 1} more" if len(names) > 1 else ""
            messages.append(f"material {names[0]!r}{more}: {remark}")
        return messages


@dataclass
class _Maker:
    """Makes a material of its statements."""

    library: Library
    name: str
    statements: Statements
    used: set[str] = field(default_factory=set)

    def material(self) -> tuple[Material, Area | None]:
        surface = self.bumped(self.surface())
        opacity = self.opacity(surface)
        emission = self.emission()
        if opacity is not None:
            surface = Mask(material=surface, opacity=opacity)
            if emission is not None:  # a surface that is cut away does not shine
                radiance = Product(first=emission.radiance, second=opacity)
                emission = replace(emission, radiance=radiance)
        self.tell_rest()
        return surface if _transmits(surface) else TwoSided(front=surface), emission

    def tell_rest(self) -> None:
        """Take note of the statements that were not used."""
        same = [self.statements[k].value for k in ("map_ka", "map_kd") if k in self.statements]
        if len(same) == 2 and same[0] == same[1]:
            self.used.add("map_ka")
        for key, statement in self.statements.items():
            if key not in self.used and not statement.is_neutral(key):
                self.library.left_out[statement.key] = None

    # What a surface is

    def surface(self) -> Material:
        """Return the material without normals, holes and light of its own."""
        model = self.model()
        if any(key in self.statements for key in PHYSICAL):
            return self.physical(model)
        if model in GLASS:
            if (index := self.glass_index(model)) > 1.0:
                return self.glass(index)
            if model != 4 or "ni" not in self.statements:  # Maya writes 4 and Ni 1 of all materials
                self.remark(f"illum {model} is glass where Ni is above 1, which it is not")
        if model in (0, 1):
            self.used.add("map_ks")
            gloss: Textured = BLACK
        else:
            mirrors = model in (*MIRRORS, 5)
            gloss = self.reflectance("ks", "map_ks", WHITE if mirrors else BLACK)
        diffuse = self.reflectance("kd", "map_kd", UNSAID)
        if gloss == BLACK:
            if model in MIRRORS:
                self.remark(f"illum {model} mirrors nothing, for Ks is 0")
            return Diffuse(reflectance=diffuse, name=self.name)
        if model in MIRRORS:
            return self.mirror(diffuse, gloss)
        if model == 5:
            return Plastic(
                diffuse_reflectance=diffuse,
                specular_reflectance=gloss,
                int_ior=self.index(COAT),
                name=self.name,
            )
        return self.glossy(diffuse, gloss)

    def glossy(self, diffuse: Textured, gloss: Textured) -> Material:
        """Return a material with a highlight, as wide as Ns says."""
        alpha = self.alpha()
        if diffuse == BLACK:
            return RoughConductor(specular_reflectance=gloss, alpha=alpha, name=self.name)
        if (self.number("ns", 0.0) or 0.0) <= 0.0:  # no highlight, but a second Kd
            return Diffuse(reflectance=diffuse, name=self.name)
        return RoughPlastic(
            diffuse_reflectance=diffuse,
            specular_reflectance=gloss,
            int_ior=self.index(COAT),
            alpha=alpha,
            name=self.name,
        )

    def model(self) -> int | None:
        """Return the illumination model, None where none is given."""
        value = self.number("illum", None)
        if value is None:
            return None
        if not (value.is_integer() and 0 <= value <= 10):
            self.remark(f"illum {value:g} is unknown; as without it")
            return None
        if value in (0, 10):
            effect = "colour without shading" if value == 0 else "shadows on what is not seen"
            self.remark(f"illum {value:g}, {effect}, is rendered as the other statements say")
        return int(value)

    def index(self, otherwise: float) -> float:
        """Return Ni where it is above 1, and else `otherwise`."""
        index = self.number("ni", otherwise)
        return index if index is not None and 1.0 < index < math.inf else otherwise

    def glass_index(self, model: int) -> float:
        """Return the index of glass; 1 where the material is none."""
        return self.index(COAT if model in (6, 7) and "ni" not in self.statements else 1.0)

    def alpha(self) -> float:
        """Return the roughness of microfacets whose highlight has the exponent Ns."""
        exponent = max(self.number("ns", 0.0) or 0.0, 0.0)
        return max(math.sqrt(2.0 / (exponent + 2.0)), SMOOTHEST)

    def glass(self, index: float) -> Material:
        """Return a boundary that Tf colours; Kd, d and Ks do not count."""
        passed = self.reflectance("tf", None, WHITE)
        return Dielectric(int_ior=index, ext_ior=1.0, specular_transmittance=passed, name=self.name)

    def mirror(self, diffuse: Textured, gloss: Textured) -> Material:
        """Return Kd scattered and Ks mirrored; what exceeds 1 in sum is taken off Kd."""
        if diffuse == BLACK:
            return Conductor(specular_reflectance=gloss, name=self.name)
        share: Any = gloss
        mirror, base = Conductor(name=self.name), diffuse
        if isinstance(gloss, tuple):
            share = max(gloss)
            colour = tuple(value / share for value in gloss)
            mirror = Conductor(specular_reflectance=colour, name=self.name)
            if share < 1.0 and isinstance(diffuse, tuple):
                base = tuple(min(value / (1.0 - share), 1.0) for value in diffuse)
        first = Diffuse(reflectance=base, name=self.name)
        return Blend(first=first, second=mirror, weight=share, name=self.name)

    def physical(self, model: int | None) -> Material:
        """Return the material of Pr, Pm, Ps, Pc, Pcr and aniso."""
        roughness = self.share("pr", 0.5)
        if model in GLASS and (index := self.glass_index(model)) > 1.0:
            if roughness == 0.0:
                return self.glass(index)
            alpha: Any = Product(first=roughness, second=roughness)
            if isinstance(roughness, float):
                alpha = max(roughness**2, SMOOTHEST)
            return RoughDielectric(
                int_ior=index,
                ext_ior=1.0,
                alpha=alpha,
                specular_transmittance=self.reflectance("tf", None, WHITE),
                name=self.name,
            )
        coat = self.number("pcr", 0.0) or 0.0
        return Principled(
            base_color=self.reflectance("kd", "map_kd", UNSAID),
            roughness=roughness,
            metallic=self.share("pm", 0.0),
            sheen=self.share("ps", 0.0),
            clearcoat=self.share("pc", 0.0),
            clearcoat_gloss=1.0 - min(max(coat, 0.0), 1.0),
            anisotropic=self.share("aniso", 0.0, image=False),
            eta=self.index(COAT),
            name=self.name,
        )

    def bumped(self, surface: Material) -> Material:
        """Return a material with the normals that an image bends."""
        if (statement := self.take("norm")) is not None:
            map_, options = self.bitmap(statement, raw=True, even=True)
            self.used.add("bump")
            scale = options.get("-bm", (1.0,))[0]
            return NormalMap(material=surface, map=map_, scale=scale, along_v=True)
        if (statement := self.take("bump")) is None:
            return surface
        map_, options = self.bitmap(statement, raw=True)
        scale = options.get("-bm", (1.0,))[0]
        if map_.image is GREY:
            return surface
        if "-imfchan" not in options and _is_normal_map(_pixels(map_)):
            self.remark(f"{statement.key} looks like a normal map, and is read as one")
            return NormalMap(material=surface, map=map_, scale=scale, along_v=True)
        return BumpMap(material=surface, height=map_, scale=scale)

    def opacity(self, surface: Material) -> Any:
        """Return the share of light that meets the surface, None where all does."""
        if _transmits(surface):
            return None
        value = 1.0
        if "d" in self.statements:
            statement_d = self.statements["d"]
            words = statement_d.words()
            if words[:1] == ["-halo"]:
                self.remark("d -halo is rendered as d, the same from all sides")
                words = words[1:]
            value = statement_d.numbers(words)[0]
        elif (through := self.number("tr", None)) is not None:
            if through >= 1.0:  # MeshLab and others write it for opaque materials
                self.remark("Tr 1 without d is taken as opaque")
            value = 1.0 - through if through < 1.0 else 1.0
        value = min(max(value, 0.0), 1.0)
        statement = self.take("map_d")
        if statement is None:
            if value == 0.0:
                self.remark("d is 0: it is not seen")
            return None if value == 1.0 else value
        image, options = self.bitmap(statement, raw=True)
        if image.image is GREY:
            return None if value == 1.0 else value
        pixels = _pixels(image)
        if "-imfchan" not in options and pixels.shape[2] == 4 and pixels[..., 3].min() < 1.0:
            image = replace(image, channel="a")
        if value == 0.0:
            self.remark(f"d is 0 beside {statement.key}: the image alone counts")
        return image if value in (0.0, 1.0) else Product(first=image, second=value)

    def emission(self) -> Area | None:
        """Return the light that Ke and map_Ke give out, from both sides."""
        image = self.take("map_ke")
        colour = self.colour("ke")
        radiance = WHITE if colour is None else colour
        if image is None and (colour is None or radiance == BLACK):
            return None
        if image is not None:
            radiance = self.product(image, radiance, "Ke")
        return Area(radiance=radiance, two_sided=True)

    # Numbers and images

    def take(self, key: str) -> Statement | None:
        """Return a statement, which is used now."""
        self.used.add(key)
        return self.statements.get(key)

    def remark(self, message: str) -> None:
        names = self.library.remarks.setdefault(message, [])
        if self.name not in names:
            names.append(self.name)

    def find(self, statement: Statement, name: str) -> Path | None:
        """Return the file of a name, beside the library or else beside the mesh."""
        return find(statement.file.parent, name) or find(self.library.folder, name)

    def number(self, key: str, default: float | None) -> float | None:
        """Return the first number of a statement."""
        statement = self.take(key)
        return default if statement is None else statement.numbers()[0]

    def colour(self, key: str) -> Any:
        """Return linear r, g, b, none below 0, or a spectrum; None where there is no statement."""
        statement = self.take(key)
        if statement is None:
            return None
        words = statement.words()
        form = words[0].lower() if words else ""
        if form == "spectral":
            return self.curve(statement)
        values = statement.numbers(words[1:] if form in ("xyz", "ciexyz") else words)
        values += [values[0]] * (3 - len(values))
        if form in ("xyz", "ciexyz"):
            values = spectra.xyz_to_rgb(values[:3]).tolist()
        if min(values[:3]) < -ROUNDING:
            self.remark(f"{statement.key} is below 0, which is taken as 0")
        return tuple(max(value, 0.0) for value in values[:3])

    def curve(self, statement: Statement) -> Spectrum:
        """Return a spectrum from a file, times a factor."""
        operands = uncommented(statement.value).split(None, 1)[1:]
        name, factor = (operands or [""])[0], 1.0
        path = self.find(statement, name)
        if path is None and len(words := name.rsplit(None, 1)) == 2:
            path = self.find(statement, words[0])
            factor = statement.numbers(words[1:])[0]
        if path is None:
            raise statement.error(f"there is no file {name!r}")
        table = spectra.read_table(path)
        values = np.clip(np.array(table.values) * factor, 0.0, None)
        return Tabulated(table.lambdas, values, table.outside)

    def reflectance(self, key: str, image_key: str | None, default: object) -> Any:
        """Return a colour in [0, 1], times its image."""
        image = None if image_key is None else self.take(image_key)
        value = self.colour(key)
        if value is None:
            value = default if image is None else WHITE
        if isinstance(value, tuple) and max(value) > 1.0:
            statement = self.statements[key]
            self.remark(f"{statement.key} is above 1, which is taken as 1")
            value = tuple(min(part, 1.0) for part in value)
        if image is None or (key == "ks" and value == BLACK):
            return value
        return self.product(image, value, key.capitalize())

    def product(self, statement: Statement, value: Any, key: str) -> Any:
        """Return an image times a colour; the image alone where an exporter has left 0 there."""
        image, _ = self.bitmap(statement)
        if value == BLACK:
            self.remark(f"{key} is 0 beside {statement.key}: the image alone counts")
        if value in (BLACK, WHITE):
            return image
        tinted = isinstance(value, tuple) and max(value) > min(value)
        if isinstance(value, tuple) and max(value) > 1.0:
            value = spectra.RGBUnbounded(*value)
        return Product(first=image, second=value, rgb=tinted)

    def share(self, key: str, default: float, *, image: bool = True) -> Any:
        """Return a number in [0, 1], times its image."""
        value = self.number(key, None)
        statement = self.take(f"map_{key}") if image else None
        factor = min(max(default if value is None else value, 0.0), 1.0)
        if statement is None:
            return factor
        map_, _ = self.bitmap(statement, raw=True)
        if map_.image is GREY:
            return factor
        if value == 0.0:
            self.remark(f"{self.statements[key].key} is 0 beside {statement.key}: the image counts")
        return map_ if value in (None, 0.0, 1.0) else Product(first=map_, second=factor)

    def bitmap(
        self, statement: Statement, *, raw: bool = False, even: bool = False
    ) -> tuple[Bitmap, Options]:
        """Return the image of a statement and its options; grey if missing images are grey.

        even: the stand-in is a flat normal map.
        """
        name, options = statement.image(statement.value)
        path = self.find(statement, name)
        if path is None and (behind := BEHIND.search(name)):
            options |= statement.image(name[behind.end() :])[1]
            name = name[: behind.start()]
            path = self.find(statement, name)
        if path is None:
            name = uncommented(name)
            path = self.find(statement, name)
        try:
            if path is None:
                raise SceneError(f"there is no file {name!r}")
            images.check_input(path)
        except SceneError as error:
            if self.library.missing == "error":
                raise statement.error(error.message) from None
            self.remark(grey_for(name))
            return Bitmap(image=EVEN if even else GREY, raw=True), options
        for option in options.keys() & UNUSED:
            if options[option] not in UNUSED[option]:
                self.library.left_out[f"{statement.key} {option}"] = None
        return _placed(path, options, raw), options


def _placed(path: Path, options: Options, raw: bool) -> Bitmap:
    """Return an image where its options place it."""
    image: ImageLike = path
    base, gain = options.get("-mm", (0.0, 1.0))
    if (base, gain) != (0.0, 1.0):
        values = images.read(path, linear=not raw) * np.float32(gain) + np.float32(base)
        image, raw = np.maximum(values, np.float32(0.0)), True
    (across, along, _), (right, up, _) = options.get("-s", WHITE), options.get("-o", BLACK)
    unblended = options.get("-blendu") == options.get("-blendv") == "off"
    return Bitmap(
        image=image,
        raw=raw,
        to_uv=np.array([[across, 0.0, right], [0.0, along, up], [0.0, 0.0, 1.0]]),
        wrap="clamp" if options.get("-clamp") == "on" else "repeat",
        filter="nearest" if unblended else "bilinear",
        channel=CHANNELS.get(options.get("-imfchan", "l"), "luminance"),
    )


def _pixels(map_: Bitmap) -> NDArray[np.float32]:
    """Return what an image holds, (h, w, c), from 0 to 1 where it has 8 bits."""
    if isinstance(map_.image, Path):
        return images.read_stored(map_.image).decoded(linear=False)
    return np.asarray(map_.image, np.float32)


def _is_normal_map(pixels: NDArray[np.float32]) -> bool:
    """Return whether colours are near (1/2, 1/2, 1), as those of normals on an even surface."""
    if pixels.shape[2] < 3:
        return False
    red, green, blue = pixels[..., :3].reshape(-1, 3).mean(axis=0)
    return abs(red - 0.5) < 0.15 and abs(green - 0.5) < 0.15 and blue > 0.7


def _transmits(material: Material) -> bool:
    return any(part.transmits for part in parts(material))
