"""Materials as networks of MaterialX on a stage, with UsdPreviewSurface beside them."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from pxr import Gf, Sdf, Tf, Usd, UsdShade

from clpt import images
from clpt.arrays import Floats
from clpt.files import output_files
from clpt.formats import as_openpbr
from clpt.formats.as_openpbr import Surface, dispersion, rgb, split, two_by_two
from clpt.formats.usd.export_graphs import OF_USD, GraphWriter, Lost
from clpt.scene import materials
from clpt.scene.lights import Area
from clpt.scene.media import Homogeneous, Medium
from clpt.scene.params import fields_of, params
from clpt.scene.phases import HenyeyGreenstein
from clpt.scene.pixels import image_file
from clpt.scene.roles import REAL, REFLECTANCE, Param, Spectral
from clpt.scene.textures import Bitmap, Checkerboard, Graph, MeshAttribute, Mix, Product
from clpt.scene.values import Texture, Textured

TYPES = Sdf.ValueTypeNames
ADDRESSES = {"repeat": "periodic", "clamp": "clamp", "mirror": "mirror", "zero": "constant"}
PREVIEW_WRAPS = {"repeat": "repeat", "clamp": "clamp", "mirror": "mirror", "zero": "black"}
EIGHT_BITS = (".png", ".jpg", ".jpeg")  # of files that are copied as they are
NOT_INPUTS = (  # parameters that become other inputs of the shader, or none
    "absorption", "anisotropy_rotation", "name", "specular_ior", "subsurface_inside",
    "thin_walled", "transmission_tint",
)  # fmt: skip


@dataclass
class MaterialWriter:
    """Writes each material once. lost: what the stage cannot say, for people."""

    stage: Usd.Stage
    folder: Path
    lost: dict[str, None] = field(default_factory=dict)
    paths: dict[Any, UsdShade.Material] = field(default_factory=dict)
    files: dict[Any, str] = field(default_factory=dict)

    def warn(self, message: str) -> None:
        self.lost.setdefault(message)

    def material(
        self, material: materials.Material, emission: Area | None, interior: Medium | None
    ) -> UsdShade.Material:
        """Return the material of a shape: its surface, light and inside."""
        key = id(material), id(emission), id(interior)
        if key not in self.paths:
            self.paths[key] = self._material(material, emission, interior)
        return self.paths[key]

    def _material(
        self, material: materials.Material, emission: Area | None, interior: Medium | None
    ) -> UsdShade.Material:
        path = unused(self.stage, "/Materials", material.name or material.kind)
        prim = UsdShade.Material.Define(self.stage, path)
        material = as_openpbr.of_lamp(material, emission is not None, self.warn)
        surface = as_openpbr.surface(material, self.warn)
        network = Network(self, path)
        shader = network.shader("surface", "open_pbr_surface_surfaceshader", "surfaceshader")
        prim.CreateSurfaceOutput("mtlx").ConnectToSource(shader.GetOutput("out"))
        self._surface(network, shader, surface)
        if emission is not None:
            _emit(network, shader, emission)
        if interior is not None:
            self._inside(shader, surface, interior)
        self._preview(prim, path, surface)
        return prim

    def _surface(self, network: Network, shader: UsdShade.Shader, surface: Surface) -> None:
        base, roles = surface.base, params(materials.Openpbr)
        usual = fields_of(materials.Openpbr())
        for name, value in fields_of(base).items():
            if name in NOT_INPUTS or name not in roles:
                continue
            if isinstance(value, Texture) or value != usual[name]:
                network.set(shader, name, value, roles[name])
        shader.CreateInput("geometry_thin_walled", TYPES.Bool).Set(bool(base.thin_walled))
        ior, abbe = dispersion(base.specular_ior)
        shader.CreateInput("specular_ior", TYPES.Float).Set(ior)
        if abbe > 0.0:
            shader.CreateInput("transmission_dispersion_scale", TYPES.Float).Set(1.0)
            shader.CreateInput("transmission_dispersion_abbe_number", TYPES.Float).Set(abbe)
        if base.transmission_weight != 0.0:
            _absorb(self, network, shader, base)
        rotation = base.anisotropy_rotation
        if isinstance(rotation, Texture):
            self.warn("rotations of anisotropy by a texture")
        elif rotation != 0.0:
            turn = network.shader("tangent", "rotate3d_vector3", "vector3")
            turn.CreateInput("amount", TYPES.Float).Set(float(rotation))
            along = network.shader("tangent_of_mesh", "tangent_vector3", "vector3")
            turn.CreateInput("in", TYPES.Vector3f).ConnectToSource(along.GetOutput("out"))
            _connect(shader, "geometry_tangent", TYPES.Vector3f, turn)
        if surface.opacity != 1.0:
            network.set(shader, "geometry_opacity", surface.opacity, None)
        _bend(network, shader, surface)

    def _inside(self, shader: UsdShade.Shader, surface: Surface, interior: Medium) -> None:
        """Say what is inside of a body that lets light through."""
        base = surface.base
        if (
            not isinstance(interior, Homogeneous)
            or base.thin_walled
            or base.transmission_weight == 0
        ):
            self.warn(f"the medium {interior.kind} inside of shapes")
            return
        absorbed, scattered = (
            rgb(value, "unbounded") for value in interior.coefficients(spectral=False)
        )
        total = absorbed + scattered + rgb(base.absorption, "unbounded")
        if not total.max() > 0.0:
            return
        depth = _color_at_depth(shader, total)
        _color(shader, "transmission_scatter", scattered * depth)
        if isinstance(interior.phase, HenyeyGreenstein):
            g = float(np.mean(rgb(interior.phase.g, "unbounded")))
            shader.CreateInput("transmission_scatter_anisotropy", TYPES.Float).Set(g)

    def _preview(self, prim: UsdShade.Material, path: str, surface: Surface) -> None:
        """Write what programs without MaterialX show."""
        base = surface.base
        shader = UsdShade.Shader.Define(self.stage, f"{path}/preview")
        shader.CreateIdAttr("UsdPreviewSurface")
        shown: dict[str, tuple[Textured, Sdf.ValueTypeName]] = {
            "diffuseColor": (base.base_color, TYPES.Color3f),
            "metallic": (base.base_metalness, TYPES.Float),
            "roughness": (base.specular_roughness, TYPES.Float),
            "clearcoat": (base.coat_weight, TYPES.Float),
            "clearcoatRoughness": (base.coat_roughness, TYPES.Float),
        }
        for name, (value, kind) in shown.items():
            source = value if isinstance(value, Bitmap) else None
            if source is not None and source.mapping == "uv":
                _connect_preview(self, path, shader, name, source, kind)
            elif kind == TYPES.Color3f and not isinstance(value, Texture):
                _color(shader, name, rgb(value, "reflectance"))
            elif not isinstance(value, Texture):
                shader.CreateInput(name, kind).Set(value)
        shader.CreateInput("ior", TYPES.Float).Set(dispersion(base.specular_ior)[0])
        if not isinstance(surface.opacity, Texture):
            clear = base.transmission_weight
            share = 1.0 if isinstance(clear, Texture) else 1.0 - clear
            shader.CreateInput("opacity", TYPES.Float).Set(surface.opacity * share)
        shader.CreateOutput("surface", TYPES.Token)
        prim.CreateSurfaceOutput().ConnectToSource(shader.GetOutput("surface"))

    def image(self, bitmap: Bitmap, *, number: bool) -> tuple[str, str]:
        """Write an image once; return its file beside the stage, and its color space."""
        key = *bitmap.identity, number
        if key not in self.files:
            self.files[key] = self._image(bitmap, number)
        name = self.files[key]
        return name, "srgb_texture" if name.lower().endswith(EIGHT_BITS) else "raw"

    def _image(self, bitmap: Bitmap, number: bool) -> str:
        file = image_file(bitmap.image)
        stem = Path(file).stem if file else "image"
        folder = self.folder / "textures"
        folder.mkdir(exist_ok=True)
        suffix = Path(file).suffix.lower() if file else ""
        copied = suffix in EIGHT_BITS and not bitmap.raw and not number
        taken = {Path(name).name for name in self.files.values()}
        name = next(
            name
            for i in range(len(taken) + 1)
            if (name := f"{stem}{i or ''}{suffix if copied else '.exr'}") not in taken
        )
        if copied:
            output_files.write(folder / name, Path(str(file)).read_bytes())
        else:
            if bitmap.spectral(REFLECTANCE) is not None:
                self.warn("the spectra of images; their colors are written")
            pixels = bitmap.pixels(REAL if number else REFLECTANCE)
            images.write(folder / name, np.repeat(pixels, 3 // pixels.shape[2], axis=2))
        return f"textures/{name}"


@dataclass
class Network:
    """The shaders below a material."""

    writer: MaterialWriter
    path: str
    known: dict[Any, UsdShade.Shader] = field(default_factory=dict)

    def shader(self, name: str, kind: str, output: str) -> UsdShade.Shader:
        """Add a shader. kind: its definition without ND_; output: the type of `out`."""
        path = unused(self.writer.stage, self.path, name)
        shader = UsdShade.Shader.Define(self.writer.stage, path)
        shader.CreateIdAttr(f"ND_{kind}")
        shader.CreateOutput("out", OF_USD[output])
        return shader

    def set(self, shader: UsdShade.Shader, name: str, value: Textured, param: Param | None) -> None:
        """Set an input to a value, or connect it to the nodes of a texture."""
        role = param.role if param is not None else REAL
        wide = isinstance(role, Spectral)
        kind = TYPES.Color3f if wide else TYPES.Float
        if isinstance(value, Texture):
            _connect(shader, name, kind, self.texture(value, wide=wide))
        elif wide:
            assert isinstance(role, Spectral)
            _color(shader, name, rgb(value, role.meaning))
        else:
            shader.CreateInput(name, kind).Set(np.asarray(value, np.float64).item())

    def texture(self, texture: Texture, *, wide: bool) -> UsdShade.Shader:
        """Return the last node of a texture. wide: a color is asked for, else a number."""
        key = id(texture), wide
        if key not in self.known:
            self.known[key] = self._texture(texture, wide)
        return self.known[key]

    def _texture(self, texture: Texture, wide: bool) -> UsdShade.Shader:
        form = "color3" if wide else "float"
        if isinstance(texture, Checkerboard):
            texture = two_by_two(texture)
        if isinstance(texture, Bitmap):
            return self._image(texture, form)
        if isinstance(texture, Graph):
            try:
                return GraphWriter(self, texture).written(form)
            except Lost as lost:
                self.writer.warn(f"{lost} in a graph; grey stands for it")
                return self._grey(form, wide)
        if isinstance(texture, MeshAttribute) and texture.name.startswith("vertex_"):
            node = self.shader("attribute", f"geompropvalue_{form}", form)
            node.CreateInput("geomprop", TYPES.String).Set(texture.name.removeprefix("vertex_"))
            return node
        if isinstance(texture, Product):
            node = self.shader("product", f"multiply_{form}", form)
            return self._operands(node, {"in1": texture.first, "in2": texture.second}, wide)
        if isinstance(texture, Mix):
            node = self.shader("mix", f"mix_{form}", form)
            self._operand(node, "mix", texture.amount, wide=False)
            return self._operands(node, {"bg": texture.first, "fg": texture.second}, wide)
        self.writer.warn(f"the pattern {texture.kind}; grey stands for it")
        return self._grey(form, wide)

    def look_up(
        self, texture: Texture, form: str, uv: UsdShade.Shader | None = None
    ) -> UsdShade.Shader:
        """Return a texture of a graph as a type; uv: coordinates in the place of the surface's."""
        if isinstance(texture, Bitmap):
            return self._image(texture, form, uv)
        return self.texture(texture, wide=form != "float")

    def _grey(self, form: str, wide: bool) -> UsdShade.Shader:
        node = self.shader("constant", f"constant_{form}", form)
        return self._operands(node, {"value": 0.5}, wide)

    def _operands(
        self, node: UsdShade.Shader, values: dict[str, Any], wide: bool
    ) -> UsdShade.Shader:
        for name, value in values.items():
            self._operand(node, name, value, wide=wide)
        return node

    def _operand(self, node: UsdShade.Shader, name: str, value: Textured, *, wide: bool) -> None:
        kind = TYPES.Color3f if wide else TYPES.Float
        if isinstance(value, Texture):
            _connect(node, name, kind, self.texture(value, wide=wide))
        elif wide:
            _color(node, name, rgb(value, "unbounded"))
        else:
            node.CreateInput(name, kind).Set(float(np.mean(rgb(value, "unbounded"))))

    def _image(
        self, bitmap: Bitmap, form: str, uv: UsdShade.Shader | None = None
    ) -> UsdShade.Shader:
        file, space = self.writer.image(bitmap, number=form == "float")
        node = self.shader("image", f"image_{form}", form)
        source = node.CreateInput("file", TYPES.Asset)
        source.Set(Sdf.AssetPath(f"./{file}"))
        source.GetAttr().SetColorSpace("raw" if form == "vector3" else space)
        for side, wrap in zip("uv", bitmap.wraps, strict=True):
            node.CreateInput(f"{side}addressmode", TYPES.String).Set(ADDRESSES[wrap])
        nearest = bitmap.filter == "nearest"
        node.CreateInput("filtertype", TYPES.String).Set("closest" if nearest else "linear")
        self._place(node, bitmap, uv or self.coordinates(bitmap.mapping))
        return node

    def coordinates(self, mapping: str) -> UsdShade.Shader:
        """Return u and v of the mesh."""
        if mapping not in ("uv", "uv1"):
            self.writer.warn(f"the mapping {mapping}; texture coordinates stand for it")
        uv = self.shader("uv", "geompropvalue_vector2", "vector2")
        uv.CreateInput("geomprop", TYPES.String).Set("st1" if mapping == "uv1" else "st")
        return uv

    def _place(self, node: UsdShade.Shader, bitmap: Bitmap, uv: UsdShade.Shader) -> None:
        """Connect an image's coordinates, moved by `to_uv`."""
        to_uv = np.asarray(bitmap.to_uv, np.float64)
        if not np.array_equal(to_uv, np.eye(3)):
            uv = self._moved(uv, to_uv)
        _connect(node, "texcoord", TYPES.Float2, uv)

    def _moved(self, uv: UsdShade.Shader, to_uv: np.ndarray) -> UsdShade.Shader:
        """Return coordinates under an affine map: two dot products and an offset."""
        rows = self.shader("rows", "combine2_vector2", "vector2")
        for i, name in enumerate(("in1", "in2")):
            row = self.shader(f"row{i}", "dotproduct_vector2", "float")
            _connect(row, "in1", TYPES.Float2, uv)
            row.CreateInput("in2", TYPES.Float2).Set(Gf.Vec2f(*to_uv[i, :2].tolist()))
            _connect(rows, name, TYPES.Float, row)
        offset = self.shader("offset", "add_vector2", "vector2")
        _connect(offset, "in1", TYPES.Float2, rows)
        offset.CreateInput("in2", TYPES.Float2).Set(Gf.Vec2f(*to_uv[:2, 2].tolist()))
        return offset


def unused(stage: Usd.Stage, parent: str, name: str) -> str:
    """Return a path below a parent that no prim has, by a name that USD allows."""
    valid = Tf.MakeValidIdentifier(name or "prim")
    path, count = f"{parent}/{valid}", 1
    while stage.GetPrimAtPath(path):
        count += 1
        path = f"{parent}/{valid}_{count}"
    return path


def _connect(
    shader: UsdShade.Shader, name: str, kind: Sdf.ValueTypeName, source: UsdShade.Shader
) -> None:
    shader.CreateInput(name, kind).ConnectToSource(source.GetOutput("out"))


def _color(shader: UsdShade.Shader, name: str, color: ArrayLike) -> None:
    shader.CreateInput(name, TYPES.Color3f).Set(Gf.Vec3f(*np.asarray(color, float).tolist()))


def _emit(network: Network, shader: UsdShade.Shader, emission: Area) -> None:
    """Write what a surface emits: color times luminance, as `load` reads it."""
    radiance = emission.radiance
    if isinstance(radiance, Texture):
        _connect(shader, "emission_color", TYPES.Color3f, network.texture(radiance, wide=True))
        shader.CreateInput("emission_luminance", TYPES.Float).Set(1.0)
        return
    strength, color = split(rgb(radiance, "emission"))
    _color(shader, "emission_color", color)
    shader.CreateInput("emission_luminance", TYPES.Float).Set(strength)


def _absorb(
    writer: MaterialWriter, network: Network, shader: UsdShade.Shader, base: materials.Openpbr
) -> None:
    """Write the color of what is let through: at the surface, or at a depth."""
    absorption = rgb(base.absorption, "unbounded")
    tint = base.transmission_tint
    if not absorption.any():
        network.set(
            shader, "transmission_color", tint, params(materials.Openpbr)["transmission_tint"]
        )
        return
    if isinstance(tint, Texture) or not np.allclose(rgb(tint, "reflectance"), 1.0):
        writer.warn("the tint of what absorbs inside as well")
    _color_at_depth(shader, absorption)


def _color_at_depth(shader: UsdShade.Shader, extinction: Floats) -> float:
    """Write the light's color at a depth; return the depth [m]. extinction: (3,) [1/m]."""
    depth = 1.0 / float(extinction.max())
    _color(shader, "transmission_color", np.exp(-extinction * depth))
    shader.CreateInput("transmission_depth", TYPES.Float).Set(depth)
    return depth


def _bend(network: Network, shader: UsdShade.Shader, surface: Surface) -> None:
    """Connect a map of normals, or of heights."""
    if isinstance(surface.normals, Bitmap):
        image = network.look_up(dataclasses.replace(surface.normals, raw=True), "vector3")
        node = network.shader("normals", "normalmap_float", "vector3")
        _connect(node, "in", TYPES.Vector3f, image)
    elif isinstance(surface.normals, Graph):
        node = network.shader("normals", "normalmap_float", "vector3")
        color = network.texture(surface.normals, wide=True)
        vector = network.shader("vector", "convert_color3_vector3", "vector3")
        _connect(vector, "in", TYPES.Color3f, color)
        _connect(node, "in", TYPES.Vector3f, vector)
    elif surface.bump is not None and isinstance(surface.bump, Texture):
        node = network.shader("bump", "bump_vector3", "vector3")
        _connect(node, "height", TYPES.Float, network.texture(surface.bump, wide=False))
    else:
        return
    node.CreateInput("scale", TYPES.Float).Set(float(surface.scale))
    _connect(shader, "geometry_normal", TYPES.Vector3f, node)


def _connect_preview(
    writer: MaterialWriter,
    path: str,
    shader: UsdShade.Shader,
    name: str,
    bitmap: Bitmap,
    kind: Sdf.ValueTypeName,
) -> None:
    """Connect an input of UsdPreviewSurface to an image."""
    wide = kind == TYPES.Color3f
    file, space = writer.image(bitmap, number=not wide)
    node = UsdShade.Shader.Define(writer.stage, unused(writer.stage, path, f"preview_{name}"))
    node.CreateIdAttr("UsdUVTexture")
    node.CreateInput("file", TYPES.Asset).Set(Sdf.AssetPath(f"./{file}"))
    colors = "sRGB" if space == "srgb_texture" else "raw"
    node.CreateInput("sourceColorSpace", TYPES.Token).Set(colors)
    for side, wrap in zip("ST", bitmap.wraps, strict=True):
        node.CreateInput(f"wrap{side}", TYPES.Token).Set(PREVIEW_WRAPS[wrap])
    reader = UsdShade.Shader.Define(writer.stage, unused(writer.stage, path, f"st_{name}"))
    reader.CreateIdAttr("UsdPrimvarReader_float2")
    reader.CreateInput("varname", TYPES.String).Set("st")
    uv = reader.CreateOutput("result", TYPES.Float2)
    to_uv = np.asarray(bitmap.to_uv, np.float64)
    if not np.array_equal(to_uv, np.eye(3)):
        moved = UsdShade.Shader.Define(writer.stage, unused(writer.stage, path, f"place_{name}"))
        moved.CreateIdAttr("UsdTransform2d")
        moved.CreateInput("in", TYPES.Float2).ConnectToSource(uv)
        scale = np.hypot(to_uv[0, :2], to_uv[1, :2])
        turn = math.degrees(math.atan2(to_uv[1, 0], to_uv[0, 0]))
        moved.CreateInput("scale", TYPES.Float2).Set(Gf.Vec2f(*scale.tolist()))
        moved.CreateInput("rotation", TYPES.Float).Set(turn)
        moved.CreateInput("translation", TYPES.Float2).Set(Gf.Vec2f(*to_uv[:2, 2].tolist()))
        uv = moved.CreateOutput("result", TYPES.Float2)
    node.CreateInput("st", TYPES.Float2).ConnectToSource(uv)
    output = node.CreateOutput("rgb" if wide else "r", TYPES.Float3 if wide else TYPES.Float)
    shader.CreateInput(name, kind).ConnectToSource(output)
