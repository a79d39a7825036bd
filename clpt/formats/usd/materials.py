"""Materials: MaterialX, UsdPreviewSurface 2.6, and gprims without one in their display color."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import numpy as np
from pxr import Sdf, Tf, Usd, UsdShade

from clpt import images
from clpt.files import input_files
from clpt.formats import materialx
from clpt.formats.usd import arnold, textures
from clpt.formats.usd.document import Document
from clpt.formats.usd.textures import Node, Uses
from clpt.scene import gltf_material
from clpt.scene.lights import Area
from clpt.scene.materials import Blend, GltfSurface, Material, NormalMap, ThinDielectric, TwoSided
from clpt.scene.media import Medium
from clpt.scene.params import Kind, fields_of
from clpt.scene.textures import Bitmap, MeshAttribute
from clpt.scene.values import Texture, Textured

PREVIEW = "UsdPreviewSurface"
CONTEXTS = ("mtlx", "", "arnold")  # of surfaces that may be nodes of MaterialX, in this order
GREY = (0.18, 0.18, 0.18)
COLOR, ATTRIBUTE = "displayColor", "vertex_"  # a primvar, and how names of attributes begin
NORMALS = ((2.0, 2.0, 2.0), (-1.0, -1.0, -1.0))  # scale and bias of a map of 8 bits


@dataclass(frozen=True)
class Surface:
    """A material, what it emits, what is inside of its shapes, and the primvars that it reads.

    uv_sets: names of sets of texture coordinates; fallbacks: values of a mesh without a primvar.
    """

    material: Material
    emission: Area | None = None
    uv_sets: tuple[str, ...] = ()
    fallbacks: dict[str, tuple[float, ...]] = field(default_factory=dict)
    interior: Medium | None = None

    @property
    def primvars(self) -> dict[str, int]:
        """The width of each primvar that it reads, by name."""
        widths = {name: len(values) for name, values in self.fallbacks.items()}
        return {**widths, **dict.fromkeys(self.uv_sets, 2)}

    def settled(self, values: Mapping[str, tuple[float, ...]]) -> Surface:
        """Return the surface of a shape without primvars: numbers stand for them.

        values: of the primvars by their names; others have their fallbacks.
        """
        if not self.fallbacks:
            return self
        rows = {**self.fallbacks, **values}
        emission = None if self.emission is None else _settled(self.emission, rows)
        inner = _settled(self.material, rows)
        return Surface(inner, emission, self.uv_sets, interior=self.interior)


def _settled(part: Any, rows: dict[str, tuple[float, ...]]) -> Any:
    """Return a kind with numbers in place of the primvars in it."""
    if isinstance(part, MeshAttribute):
        row = rows[part.name.removeprefix(ATTRIBUTE)]
        return row[0] if len(row) == 1 else row
    kinds = {name: value for name, value in fields_of(part).items() if isinstance(value, Kind)}
    changes = {name: _settled(value, rows) for name, value in kinds.items()}
    return dataclasses.replace(part, **changes)


def surface(
    document: Document, bound: UsdShade.Material | None, prim: Usd.Prim, *, both: bool
) -> Surface:
    """Return the surface of a gprim.

    bound: its material, None for its display color. both: what it emits leaves its back too.
    """
    if bound:
        path = str(bound.GetPath())
        return document.once(("material", path, both), lambda: _bound(document, bound, both))
    if prim.HasAttribute(f"primvars:{COLOR}") and prim.GetAttribute(f"primvars:{COLOR}").HasValue():
        return document.once(("material", COLOR), _coloured)
    return document.once(
        ("material", ""), lambda: Surface(_sided(GltfSurface(base_color=GREY, roughness=0.5)))
    )


def _coloured() -> Surface:
    shown = MeshAttribute(name=f"{ATTRIBUTE}{COLOR}")
    return Surface(_sided(GltfSurface(base_color=shown, roughness=0.5)), fallbacks={COLOR: GREY})


def _sided(inner: Material) -> Material:
    return TwoSided(front=inner)


def _bound(document: Document, material: UsdShade.Material, both: bool) -> Surface:
    """Return a material that a prim binds: that of MaterialX, else its universal surface."""
    name, path = material.GetPrim().GetName(), str(material.GetPath())
    network = _network(document, material) or _of_document(document, material)
    if network is not None:
        read = materialx.surface(*network, name)
        found = Surface(read.material, read.emission, interior=read.interior)
        return _told(document, path, found, network[1], both)
    uses = Uses(document)
    shader = material.ComputeSurfaceSource("")[0]
    node = Node(document, shader) if shader else None
    if node is None or node.kind != PREVIEW:
        kind = (
            "it has no universal surface"
            if node is None
            else f"{node.kind or 'its shader'} is not read"
        )
        document.warn(f"{kind}; grey stands for it", path)
        return Surface(_sided(GltfSurface(base_color=GREY, roughness=0.5, name=name)))
    if material.ComputeDisplacementSource("")[0] and node.source("displacement"):
        document.warn("displacement is left out", path)
    return _told(document, path, Surface(*_preview(node, uses, name)), uses, both)


MATERIALX, FILE, NAME = "MaterialX", "clpt_file", "clpt_name"  # of a document that a stage names


def stand_in(file: Path) -> Sdf.Layer:
    """Return a layer for a document of MaterialX: its materials, where OpenUSD's plugin has them.

    The package `usd-core` lacks that plugin. Raises SceneError, see `materialx.networks`.
    """
    layer = Sdf.Layer.CreateAnonymous(f"{file.name}.usda")
    layer.defaultPrim = MATERIALX
    for name in materialx.networks(file)[0]:
        place = Sdf.Path(f"/{MATERIALX}/Materials/{Tf.MakeValidIdentifier(name)}")
        prim = Sdf.CreatePrimInLayer(layer, place)
        for path in place.GetPrefixes():
            layer.GetPrimAtPath(path).specifier = Sdf.SpecifierDef
        prim.typeName = "Material"
        prim.customData = {FILE: str(file), NAME: name}
    return layer


@dataclass
class _DocumentUses(Uses):
    """The uses of a material in a document of MaterialX, beside which its images lie."""

    folder: Path = Path()

    def image(self, asset: object, path: str) -> images.Stored | None:
        named = str(asset or "")
        return super().image(Sdf.AssetPath(named, str(self.folder / named)), path)


def _of_document(
    document: Document, material: UsdShade.Material
) -> tuple[materialx.Node, Uses] | None:
    """Return the shader of a material of a `stand_in`, and its uses; None for others."""
    told = material.GetPrim().GetCustomData()
    if FILE not in told:
        return None
    file = input_files.named("usd", document.file.parent, Path(str(told[FILE])))
    found, _ = document.once(("materialx", str(file)), lambda: materialx.networks(file))
    node = found.get(str(told.get(NAME)))
    return None if node is None else (node, _DocumentUses(document, folder=file.parent))


def _network(document: Document, material: UsdShade.Material) -> tuple[materialx.Node, Uses] | None:
    """Return the shader of MaterialX that a material has, and its uses; None without one."""
    for context in CONTEXTS:
        found = material.ComputeSurfaceSource(context)[0]
        node = arnold.surface_of(document, found) if found else None
        if node is not None and node.kind.startswith("ND_") and "UsdPreview" not in node.kind:
            return node, Uses(document)
    return None


def _told(document: Document, path: str, read: Surface, uses: Uses, both: bool) -> Surface:
    """Return a surface with its primvars. both: what it emits leaves its back too."""
    emission = read.emission and dataclasses.replace(read.emission, two_sided=both)
    if len(uses.uv_sets) > 2:
        document.warn(
            f"textures use over two sets of coordinates; {uses.uv_sets[0]} replaces the others",
            path,
        )
    sets = tuple(uses.uv_sets)
    return dataclasses.replace(read, emission=emission, uv_sets=sets, fallbacks=uses.fallbacks)


def _preview(node: Node, uses: Uses, name: str) -> tuple[Material, Area | None]:
    """Return a UsdPreviewSurface and what it emits."""
    values: dict[str, Any] = {
        "base_color": _limited(textures.colour(node, "diffuseColor", GREY, uses)),
        "roughness": textures.number(node, "roughness", 0.5, uses),
        "clearcoat": textures.number(node, "clearcoat", 0.0, uses),
        "clearcoat_roughness": textures.number(node, "clearcoatRoughness", 0.01, uses),
    }
    index = node.number("ior", 1.5)
    if node.number("useSpecularWorkflow", 0):
        color = textures.colour(node, "specularColor", (0.0,) * 3, uses)
        values |= {"ior": 0.0, "specular_color": _limited(color)}
    else:
        metallic = textures.number(node, "metallic", 0.0, uses)
        values |= {"ior": max(index, 1.0), "metallic": metallic}
    shares = ("roughness", "metallic", "clearcoat", "clearcoat_roughness")
    values |= {
        k: min(max(v, 0.0), 1.0) for k, v in values.items() if k in shares and isinstance(v, float)
    }
    inner: Material = _with_normals(node, GltfSurface(name=name, **values), uses)
    return gltf_material.finished(
        *_opacity(node, inner, index, uses), _emission(node, uses), both=True
    )


def _limited(color: Textured) -> Textured:
    """Return a reflectance with numbers of at most one."""
    return tuple(min(value, 1.0) for value in color) if isinstance(color, tuple) else color


def _emission(node: Node, uses: Uses) -> Area | None:
    color = textures.colour(node, "emissiveColor", (0.0,) * 3, uses)
    dark = isinstance(color, tuple) and not any(color)
    return None if dark else Area(radiance=color)


def _opacity(node: Node, inner: Material, index: float, uses: Uses) -> tuple[Material, Any]:
    """Return a material of which a part lets light through, and the share of it that is there.

    Without a threshold and in the mode "transparent" it is a pane of glass where it is not opaque:
    that reflects. Else it is not there.
    """
    share = textures.number(node, "opacity", 1.0, uses)
    threshold = node.number("opacityThreshold", 0.0)
    if share == 1.0:
        return inner, None
    if threshold > 0.0:
        if isinstance(share, float):
            return inner, None if share >= threshold else 0.0
        return inner, _cut(node, share, threshold)
    if str(node.value("opacityMode", "transparent")) == "presence":
        return inner, share
    pane = ThinDielectric(int_ior=max(index, 1.0), ext_ior=1.0)
    return Blend(first=pane, second=_sheet(inner), weight=share), None


def _sheet(inner: Material) -> Material:
    """Return a surface, perhaps with its normal map, whose sides are alike beside a pane."""
    if isinstance(inner, NormalMap):
        return dataclasses.replace(inner, material=_sheet(inner.material))
    return dataclasses.replace(cast(GltfSurface, inner), thin=True)


def _cut(node: Node, share: Texture, threshold: float) -> Any:
    """Return a texture that is 1 where a share reaches a threshold, else 0."""
    if not isinstance(share, Bitmap):
        node.document.warn("opacityThreshold is compared with images alone", node.path)
        return share
    values = textures.pixels(share)
    channel = "rgba".find(share.channel)
    if channel >= values.shape[2]:
        channel = -1 if share.channel == "a" and values.shape[2] in (2, 4) else 0
    there = (values[..., channel] >= threshold - 1e-6).astype(np.float32)
    return dataclasses.replace(share, image=there, raw=True, channel="luminance")


def _with_normals(node: Node, inner: GltfSurface, uses: Uses) -> Material:
    """Return a surface with its normal map, if it has one."""
    source = node.source("normal")
    if source is None:
        return inner
    if source[0].kind != textures.IMAGE:
        node.document.warn(f"{source[0].kind} is not read as normals", source[0].path)
        return inner
    map_ = textures.bitmap_of(source[0], uses, channel=None)
    if map_ is None:
        return inner
    scale = source[0].numbers("scale", (1.0,) * 4)[:3]
    bias = source[0].numbers("bias", (0.0,) * 4)[:3]
    if (scale, bias) != NORMALS:
        normals = textures.pixels(map_)[..., :3] * np.array(scale) + np.array(bias)
        map_ = dataclasses.replace(map_, image=(0.5 * normals + 0.5).astype(np.float32), raw=True)
    return gltf_material.with_normals(inner, map_)
