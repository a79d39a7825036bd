"""Materials and images of a glTF file that is written."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, cast

import numpy as np

from clpt.arrays import Floats, Floats32
from clpt.formats.as_gltf import surface
from clpt.formats.as_openpbr import Surface, dispersion, of_lamp, rgb, split, two_by_two
from clpt.formats.gltf.textures import FLIP, WRAPS
from clpt.formats.pbrt.scattering import body_albedo
from clpt.images import colour, screen_files
from clpt.scene.lights import Area
from clpt.scene.materials import GltfSurface, Material
from clpt.scene.media import Homogeneous, Medium
from clpt.scene.params import fields_of
from clpt.scene.phases import HenyeyGreenstein
from clpt.scene.roles import REAL, REFLECTANCE
from clpt.scene.textures import Bitmap, Checkerboard, Graph, MeshAttribute, Mix, Product
from clpt.scene.values import Look, Texture, Textured, TexturedNumber
from clpt.spectra.spectrum import Role

SIDE = 512  # texels of a pattern's image
CODES = {name: code for code, name in WRAPS.items()}
KHR = "KHR_materials_"
FIELDS = {  # parameters: their extension, the beginning of their keys, the channel of a number
    "specular": ("specular", "specular", "a"),
    "specular_color": ("specular", "specularColor", ""),
    "clearcoat": ("clearcoat", "clearcoat", "r"),
    "clearcoat_roughness": ("clearcoat", "clearcoatRoughness", "g"),
    "sheen_color": ("sheen", "sheenColor", ""),
    "sheen_roughness": ("sheen", "sheenRoughness", "a"),
    "transmission": ("transmission", "transmission", "r"),
    "diffuse_transmission": ("diffuse_transmission", "diffuseTransmission", "a"),
    "diffuse_transmission_color": ("diffuse_transmission", "diffuseTransmissionColor", ""),
    "iridescence": ("iridescence", "iridescence", "r"),
    "anisotropy": ("anisotropy", "anisotropy", "b"),
}
VERTICES = ("vertex_color", "vertex_alpha")  # attributes of a mesh that a file's colors hold
UNUSED = cast(Look, None)  # numbers of textures ask for no film


@dataclass
class MaterialWriter:
    """Writes each material once.

    add_view: takes bytes, returns the number of their buffer view; unit: what a radiance of 1
    shows; lost: what the file cannot say, for people; attributes: of meshes that a material reads.
    """

    document: dict[str, Any]
    add_view: Callable[[bytes], int]
    unit: float
    lost: dict[str, None] = field(default_factory=dict)
    known: dict[Any, tuple[int, Any]] = field(default_factory=dict)
    attributes: set[str] = field(default_factory=set)
    written: dict[Any, tuple[int, set[str]]] = field(default_factory=dict)

    def warn(self, message: str) -> None:
        self.lost.setdefault(message)

    def material(
        self, material: Material, emission: Area | None, interior: Medium | None
    ) -> tuple[int, set[str]]:
        """Return the material of a shape: its surface, light and inside, and the attributes."""
        key = id(material), id(emission), id(interior)
        if key not in self.written:
            self.attributes = set()
            rows = self.document["materials"]
            rows.append(self._material(material, emission, interior))
            self.written[key] = len(rows) - 1, self.attributes
        return self.written[key]

    def _material(
        self, material: Material, emission: Area | None, interior: Medium | None
    ) -> dict[str, Any]:
        material = of_lamp(material, emission is not None, self.warn)
        leaf, around, culled = surface(material, self.warn)
        row: dict[str, Any] = {"name": leaf.name or material.name or material.kind}
        row["doubleSided"] = emission.two_sided if emission is not None else not culled
        self._core(row, leaf, around)
        extensions = self._extensions(leaf) | self._body(leaf, interior)
        if emission is not None:
            extensions |= self._emission(row, emission, around.opacity)
        row["extensions"] = {KHR + name: values for name, values in extensions.items()}
        self.document["used"].update(row["extensions"])
        if isinstance(around.normals, Bitmap):
            row["normalTexture"] = self.texture(around.normals, "plain")
            row["normalTexture"]["scale"] = float(around.scale)
        elif around.normals is not None or around.bump is not None:
            self.warn("bump maps, and normals by a graph")
        return row

    def _core(self, row: dict[str, Any], leaf: GltfSurface, around: Surface) -> None:
        core = row["pbrMetallicRoughness"] = {}
        factor, image = self.split(leaf.base_color, "reflectance")
        alpha, mask = self.split(around.opacity, "unbounded")
        core["baseColorFactor"] = [*np.clip(factor, 0.0, 1.0).tolist(), float(alpha[0])]
        if image is not None or mask is not None:
            form = "color" if image is not None else "numbers"
            core["baseColorTexture"] = self.texture(image or cast(Bitmap, mask), form, a=mask)
        if around.opacity != 1.0:
            row["alphaMode"] = "BLEND"
        numbers = {"metallic": (leaf.metallic, "b"), "roughness": (leaf.roughness, "g")}
        images: dict[str, Bitmap] = {}
        for name, (value, channel) in numbers.items():
            number, source = self.split(value, "unbounded")
            core[f"{name}Factor"] = float(number[0])
            if source is not None:
                images[channel] = source
        if images:
            first = next(iter(images.values()))
            core["metallicRoughnessTexture"] = self.texture(first, "numbers", **images)

    def _extensions(self, leaf: GltfSurface) -> dict[str, Any]:
        """Return the extensions that change the surface, by name."""
        fields = fields_of(leaf)
        used: dict[str, Any] = {}
        for name, (extension, key, channel) in FIELDS.items():
            values = self._slot(key, fields[name], channel)
            if extension in used:
                used[extension] |= values
            elif np.any(next(iter(values.values()))) or extension == "specular":
                used[extension] = values
        if used["specular"] == {"specularFactor": 1.0, "specularColorFactor": [1.0] * 3}:
            del used["specular"]
        if leaf.ior != 1.5:
            used["ior"] = {"ior": dispersion(leaf.ior)[0]}
        if isinstance(leaf.clearcoat_normal_x, Bitmap) and "clearcoat" in used:
            normals = self.texture(leaf.clearcoat_normal_x, "plain")
            normals["scale"] = leaf.clearcoat_normal_scale
            used["clearcoat"]["clearcoatNormalTexture"] = normals
        thickness, turn = leaf.iridescence_thickness, leaf.anisotropy_rotation
        if isinstance(thickness, Texture) or isinstance(turn, Texture):
            self.warn("thickness of films, and directions of anisotropy, by a texture")
        if "iridescence" in used:
            nm = 400.0 if isinstance(thickness, Texture) else thickness
            film = {"iridescenceIor": leaf.iridescence_ior, "iridescenceThicknessMaximum": nm}
            used["iridescence"] |= film
        if "anisotropy" in used:
            angle = 0.0 if isinstance(turn, Texture) else math.radians(turn)
            used["anisotropy"]["anisotropyRotation"] = angle
        return used

    def _slot(self, key: str, value: Textured, channel: str) -> dict[str, Any]:
        """Return a factor and its texture under their keys. channel: of a number, "" of a color."""
        factor, image = self.split(value, "unbounded")
        parts = ("Strength", "Texture") if key == "anisotropy" else ("Factor", "Texture")
        values: dict[str, Any] = {key + parts[0]: float(factor[0]) if channel else factor.tolist()}
        if image is not None:
            channels = {channel: image} if channel else {}
            form = "numbers" if channel else "color"
            values[key + parts[1]] = self.texture(image, form, **channels)
        return values

    def _body(self, leaf: GltfSurface, interior: Medium | None) -> dict[str, Any]:
        """Return what a body absorbs and scatters, and how its index disperses."""
        is_body = leaf.transmits and not leaf.thin
        medium = interior if is_body and isinstance(interior, Homogeneous) else None
        if interior is not medium:
            self.warn("media inside of shapes that let no light through, or that are not even")
        if not is_body:
            return {}
        volume: dict[str, Any] = {"thicknessFactor": 1.0}
        extensions = {"volume": volume}
        abbe = dispersion(leaf.ior)[1]
        if abbe > 0.0:
            extensions["dispersion"] = {"dispersion": 20.0 / abbe}
        extinction = rgb(leaf.absorption, "unbounded")
        if medium is not None:
            absorbed, scattered = (rgb(v, "unbounded") for v in medium.coefficients(spectral=False))
            extinction = extinction + absorbed + scattered
            if scattered.any():
                phase = medium.phase
                g = phase.g if isinstance(phase, HenyeyGreenstein) else 0.0
                g = float(np.mean(rgb(g, "unbounded")))
                seen = np.clip(body_albedo(scattered, extinction - scattered, g), 0.0, 1.0)
                extensions["volume_scatter"] = {
                    "multiscatterColor": seen.tolist(), "scatterAnisotropy": g,
                }  # fmt: skip
        if extinction.any():
            depth = 1.0 / float(extinction.max())
            volume["attenuationDistance"] = depth
            volume["attenuationColor"] = np.exp(-extinction * depth).tolist()
        return extensions

    def _emission(
        self, row: dict[str, Any], emission: Area, opacity: TexturedNumber
    ) -> dict[str, Any]:
        radiance = emission.radiance
        if isinstance(radiance, Product) and radiance.second is opacity:
            radiance = radiance.first  # a file's alpha dims what it emits
        factor, image = self.split(radiance, "emission")
        strength, share = split(self.unit * factor)
        if image is not None:
            scale, image = cast(tuple[float, Bitmap], image.normalized())
            strength *= scale
            row["emissiveTexture"] = self.texture(image, "color")
        row["emissiveFactor"] = share.tolist()
        return {"emissive_strength": {"emissiveStrength": strength}}

    def split(self, value: Textured, role: Role) -> tuple[Floats, Bitmap | None]:
        """Return a value as a factor (3,) and an image."""
        if not isinstance(value, Texture):
            return rgb(value, role), None
        if isinstance(value, Product):
            (a, first), (b, second) = self.split(value.first, role), self.split(value.second, role)
            if first is None or second is None:
                return a * b, first or second
        if isinstance(value, MeshAttribute) and value.name in VERTICES:
            self.attributes.add(value.name)
            return np.ones(3), None
        if isinstance(value, Checkerboard) and not value.combines:
            value = two_by_two(value)
        if isinstance(value, Bitmap) and value.mapping in ("uv", "uv1"):
            return np.ones(3), value
        return np.ones(3), self._baked(value)

    def _baked(self, texture: Texture) -> Bitmap | None:
        """Return a pattern as an image over uv; its mean color where it lies in space."""
        axis = (np.arange(SIDE) + 0.5) / SIDE
        uv = np.stack(np.meshgrid(axis, 1.0 - axis), axis=-1)
        colors = _colors(texture, uv)
        if colors is None:
            self.warn(f"the pattern {texture.kind}; grey stands for it")
            colors = np.full((1, 1, 3), 0.5)
        else:
            self.warn(f"a {texture.kind} becomes an image of {SIDE} x {SIDE}")
        return Bitmap(image=np.clip(colors, 0.0, 1.0).astype(np.float32), raw=True)

    def texture(self, bitmap: Bitmap, form: str, **channels: Bitmap | None) -> dict[str, Any]:
        """Return the textureInfo of an image.

        form: "color" in sRGB, "plain" for numbers of three channels, "numbers" for `channels`
        alone: images by the channel, r to a, that takes their number.
        """
        parts = {name: image for name, image in channels.items() if image is not None}
        key = form, bitmap.identity, tuple((c, image.identity) for c, image in parts.items())
        if key not in self.known:
            source = len(self.document["images"])
            png = screen_files.png(_codes(bitmap, form, parts))
            view = self.add_view(png)
            self.document["images"].append({"bufferView": view, "mimeType": "image/png"})
            nearest = bitmap.filter == "nearest"
            wraps = [CODES.get(wrap, CODES["clamp"]) for wrap in bitmap.wraps]
            sampler = {"wrapS": wraps[0], "wrapT": wraps[1], "magFilter": 9728 if nearest else 9729}
            if "zero" in bitmap.wraps:
                self.warn("that images are black outside; their edges go on")
            self.document["samplers"].append(sampler)
            self.known[key] = len(self.document["textures"]), (bitmap, parts)  # keys are ids
            self.document["textures"].append({"source": source, "sampler": source})
        info: dict[str, Any] = {"index": self.known[key][0]}
        if bitmap.mapping == "uv1":
            info["texCoord"] = 1
        moved = FLIP @ bitmap.affine @ FLIP
        if not np.allclose(moved, np.eye(3)):
            info["extensions"] = {"KHR_texture_transform": self._transform(moved)}
            self.document["used"].add("KHR_texture_transform")
        return info

    def _transform(self, moved: Floats) -> dict[str, Any]:
        """Return an affine map of glTF's uv as T R S."""
        sx, angle = math.hypot(*moved[:2, 0]), math.atan2(-moved[1, 0], moved[0, 0])
        across = np.array([math.sin(angle), math.cos(angle)])
        sy = float(moved[:2, 1] @ across)
        if not np.allclose(moved[:2, 1], sy * across, atol=1e-4 * abs(sy)):
            self.warn("that images are sheared")
        return {"offset": moved[:2, 2].tolist(), "rotation": angle, "scale": [sx, sy]}


def _codes(bitmap: Bitmap, form: str, channels: dict[str, Bitmap]) -> np.ndarray[Any, Any]:
    """Return an image as bytes (h, w, 3 or 4), see `MaterialWriter.texture`."""
    numbers = {name: image.pixels(REAL)[..., 0] for name, image in channels.items()}
    bitmap = dataclasses.replace(bitmap, raw=True) if form == "plain" else bitmap
    pixels = bitmap.pixels(REFLECTANCE)
    sizes = [pixels.shape[:2], *(values.shape for values in numbers.values())]
    height, width = (max(size[i] for size in sizes) for i in range(2))
    shares: Floats32 = np.ones((height, width, 4), np.float32)
    if form != "numbers":
        values = _resized(np.broadcast_to(pixels, (*pixels.shape[:2], 3)), height, width)
        clipped = np.clip(values, 0.0, 1.0)
        shares[..., :3] = colour.linear_to_srgb(clipped) if form == "color" else clipped
    for name, values in numbers.items():
        shares[..., "rgba".index(name)] = np.clip(_resized(values, height, width), 0.0, 1.0)
    wide = 4 if "a" in numbers else 3
    return np.round(shares[..., :wide] * 255.0).astype(np.uint8)


def _resized(values: Floats32, height: int, width: int) -> Floats32:
    """Return texels (h, w, ...) repeated or left out."""
    rows = np.arange(height) * values.shape[0] // height
    columns = np.arange(width) * values.shape[1] // width
    return values[rows][:, columns]


def _colors(value: Textured, uv: Floats) -> Floats | None:
    """Return linear colors at uv (m, k, 2), (m, k, 3); None for what uv does not tell."""
    if not isinstance(value, Texture):
        return np.broadcast_to(rgb(value, "unbounded"), (*uv.shape[:2], 3))
    if isinstance(value, Checkerboard):
        value = Mix(first=value.color1, second=value.color0, amount=dataclasses.replace(
            value, color0=1.0, color1=0.0)) if value.combines else two_by_two(value)  # fmt: skip
    if isinstance(value, Bitmap) and value.mapping == "uv":
        area = np.zeros(len(uv))
        channels = [value.with_channel(c).number_at(UNUSED, uv, area, {}) for c in "rgb"]
        return np.stack(channels, axis=-1)
    if isinstance(value, Graph) and "position" not in value.sources:
        values = value.values_at(UNUSED, uv)[..., :3]
        return np.broadcast_to(values, (*uv.shape[:2], 3))
    if isinstance(value, (Product, Mix)):
        ends = [_colors(end, uv) for end in (value.first, value.second)]
        share = _colors(value.amount, uv) if isinstance(value, Mix) else np.zeros(1)
        if ends[0] is None or ends[1] is None or share is None:
            return None
        product = isinstance(value, Product)
        return ends[0] * ends[1] if product else ends[0] + share * (ends[1] - ends[0])
    return None
