"""Images and other files that a stage names: beside it, or in a .usdz package."""

from __future__ import annotations

import tempfile
from pathlib import Path

from pxr import Ar, Sdf

from clpt import images
from clpt.errors import SceneError
from clpt.files import budget, input_files
from clpt.formats.usd.document import Document


def image(document: Document, asset: Sdf.AssetPath) -> images.Stored:
    """Return the image that an asset names. Raises SceneError."""
    if not Ar.IsPackageRelativePath(asset.resolvedPath):
        return images.read_stored(file_of(document, asset))
    name = Path(Ar.SplitPackageRelativePathInner(asset.resolvedPath)[1])
    # Readers of images take files: OpenEXR has no other way in.
    with tempfile.TemporaryDirectory(prefix="clpt-usdz-") as folder:
        copy = Path(folder) / f"image{name.suffix.lower()}"
        copy.write_bytes(packed(document, asset))
        try:
            return images.read_stored(copy)
        except SceneError as error:
            raise SceneError(error.message) from None


def file_of(document: Document, asset: Sdf.AssetPath) -> Path:
    """Return the file that an asset names. Raises SceneError where there is none to be read."""
    if not asset.resolvedPath:
        raise SceneError(f"there is no file {asset.path!r}")
    return input_files.named("usd", document.file.parent, Path(asset.resolvedPath))


def packed(document: Document, asset: Sdf.AssetPath) -> bytes:
    """Return the bytes of a file in a package. Raises SceneError."""
    outer = Path(Ar.SplitPackageRelativePathOuter(asset.resolvedPath)[0])
    input_files.named("usd", document.file.parent, outer)
    opened = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(asset.resolvedPath))
    if opened is None:
        raise SceneError(f"there is no file {asset.path!r}")
    budget.take(opened.GetSize(), "files of the package", document.file)
    return bytes(opened.GetBuffer())
