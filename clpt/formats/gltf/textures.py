"""Textures: images of any source, samplers and KHR_texture_transform, as bitmaps."""

from __future__ import annotations

import math
import os
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import images
from clpt.errors import SceneError
from clpt.files import budget
from clpt.formats.gltf import accessors
from clpt.formats.gltf.document import Document, Element
from clpt.formats.reading import EVEN, GREY, grey_for
from clpt.scene.textures import Bitmap

FORMATS = ("PNG", "JPEG", "WEBP")
WRAPS = {33071: "clamp", 33648: "mirror", 10497: "repeat"}
NEAREST, FILTERS = 9728, (9728, 9729)
# glTF counts v from the top of an image, clpt from its bottom, and so do the meshes it makes.
FLIP = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 1.0], [0.0, 0.0, 1.0]])


def texture(info: Element, *, raw: bool = False, channel: str | None = None) -> Bitmap:
    """Return the texture that a textureInfo names; `raw`: numbers, not sRGB colours.

    channel: "r", "g", "b" or "a", for a real parameter. The texture's set of coordinates is added
    to `info.document.uv_sets`: the first two sets there are a mesh's uvs and its second uvs.
    """
    element = info.entry("index", "textures")
    if element is None:
        raise info.error("'index' is missing")
    transform = info.extension("KHR_texture_transform")
    uv_set = info.integer("texCoord", 0)
    if transform is not None:
        uv_set = transform.integer("texCoord", uv_set)
    sets = info.document.uv_sets
    if uv_set not in sets:
        sets.append(uv_set)
    image = _stand_in(info, element)
    image = _image(element, raw) if image is None else image
    values: dict[str, Any] = {"raw": raw or image.dtype != np.uint8, **_sampling(element)}
    if transform is not None:
        values["to_uv"] = FLIP @ _transform(transform) @ FLIP
    if channel is not None:
        values["channel"] = channel
    if sets.index(uv_set) == 1:
        values["mapping"] = "uv1"
    return Bitmap(image=image, **values)


def _source(texture: Element) -> Element | None:
    """The image of a texture, WebP before its fallback."""
    webp = texture.extension("EXT_texture_webp")
    source = None if webp is None else webp.entry("source", "images")
    return source or texture.entry("source", "images")


def _stand_in(info: Element, texture: Element) -> NDArray[np.float32] | None:
    """Return grey if a texture's image file is missing and missing images are grey; else None."""
    source, document = _source(texture), info.document
    if source is None or document.missing == "error" or "uri" not in source:
        return None
    uri = source.text("uri")
    if uri[:5].lower() == "data:" or document.path_of(source).is_file():
        return None
    document.warn(grey_for(uri))
    return EVEN if info.path.endswith("ormalTexture") else GREY


def _image(texture: Element, raw: bool) -> NDArray[Any]:
    """Return the pixels (h, w, 1, 3 or 4) of a texture; a white pixel if it has no image."""
    source = _source(texture)
    if source is None:
        reason = "its image is of a kind that is not supported" if "extensions" in texture else None
        texture.warn(f"{reason or 'it has no image'}; white stands for it")
        return np.full((1, 1, 3), 255, np.uint8)
    document = texture.document
    stored = document.once("images", lambda: _all(document))[source.path].result()
    return stored.values if stored.values.dtype == np.uint8 else stored.decoded(not raw)


def _all(document: Document) -> dict[str, Future[images.Stored]]:
    """Decode the images of all textures in parallel; a broken image raises where it is used."""
    sources = [_source(texture) for texture in document.root.children("textures")]
    distinct = {source.path: source for source in sources if source is not None}
    decode = budget.carried(_decoded)
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        return {path: pool.submit(decode, shared) for path, shared in distinct.items()}


def _decoded(source: Element) -> images.Stored:
    """The image of a source; glTF has what the image says of its colours passed over."""
    inside = "uri" not in source
    data = bytes(accessors.view(source)[0]) if inside else source.document.resource(source)
    try:
        image = images.decoded(data, FORMATS, profiled=False)
        budget.take(image.values.nbytes, "the images", source.document.file)
        return image
    except SceneError as error:
        raise error if error.where else source.error(error.message) from None
    except Exception as error:  # Pillow raises its own, from struct.error to SyntaxError
        reason = str(error).splitlines()[0][:80] if str(error) else type(error).__name__
        raise source.error(f"is a broken image: {reason}") from None


def _sampling(texture: Element) -> dict[str, str]:
    """Filter and wraps of a texture's sampler; mipmaps do without, see docs/gltf.md."""
    sampler = texture.entry("sampler", "samplers")
    if sampler is None:
        return {"wrap": "repeat"}
    wraps = {}
    for key in ("wrapS", "wrapT"):
        number = sampler.integer(key, 10497)
        if number not in WRAPS:
            raise sampler.error(f"{number} is no way to wrap", key)
        wraps[key] = WRAPS[number]
    settings: dict[str, str] = {"wrap": wraps["wrapS"]}
    if wraps["wrapT"] != wraps["wrapS"]:
        settings["wrap_v"] = wraps["wrapT"]
    if sampler.integer("magFilter", 9729) == NEAREST:
        settings["filter"] = "nearest"
    return settings


def _transform(element: Element) -> NDArray[np.float64]:
    """KHR_texture_transform as a 3x3 matrix on glTF's texture coordinates: T R S.

    A positive rotation is counter-clockwise seen with v downward, as all viewers agree to read the
    specification (its own listing has the sign turned round).
    """
    angle = element.number("rotation", 0.0)
    c, s = math.cos(angle), math.sin(angle)
    offset, scale = (element.numbers(k, 2, (d, d)) for k, d in (("offset", 0.0), ("scale", 1.0)))
    turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    move = np.array([[1.0, 0.0, offset[0]], [0.0, 1.0, offset[1]], [0.0, 0.0, 1.0]])
    return move @ turn @ np.diag([*scale, 1.0])
