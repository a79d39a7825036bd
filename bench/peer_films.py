"""Copies of Mitsuba scenes with another film, for two renderers that read them."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

NUMBERS = (  # numbers that may be images in a file
    "alpha", "alpha_u", "alpha_v", "anisotropic", "clearcoat", "clearcoat_gloss", "flatness",
    "metallic", "opacity", "roughness", "sheen", "sheen_tint", "spec_tint", "spec_trans", "weight",
)  # fmt: skip
METAL = (610, 550, 460)  # wavelengths for the red, green and blue of a metal's index [nm]
SHARED = ("path", "direct", "volpath", "volpathmis")  # integrators that both renderers have
DEPTH = 65  # of paths where a file names no integrator


def with_film(
    scene: Path,
    folder: Path,
    width: int,
    mode: str,
    *,
    as_file: bool = False,
    sampler: str | None = None,
) -> tuple[Path, tuple[int, int]]:
    """Write a copy of a scene with a film of a width to a folder; return it and the film's size.

    The filter is a box unless `as_file`. sampler: a kind to put in the place of the file's. What
    lies beside the scene is linked. An integrator that Mitsuba 3 does not have becomes `path`, with
    the same greatest depth.
    """
    tree = ET.parse(scene)
    root = tree.getroot()
    values = {e.get("name", ""): e.get("value", "") for e in root.iter("default")}

    def value(element: ET.Element) -> str:
        text = element.get("value", "")
        return values.get(text[1:], text) if text.startswith("$") else text

    (film, *_) = root.iter("film")
    old = {e.get("name"): int(value(e)) for e in film if e.get("name") in ("width", "height")}
    height = max(1, round(width * old.get("height", 512) / old.get("width", 512)))
    for film in root.iter("film"):
        for element in list(film):
            filtered = element.tag == "rfilter" and not as_file
            if element.get("name") in ("width", "height") or filtered:
                film.remove(element)
        ET.SubElement(film, "integer", name="width", value=str(width))
        ET.SubElement(film, "integer", name="height", value=str(height))
        if not as_file:
            ET.SubElement(film, "rfilter", type="box")
    if sampler is not None:
        for element in root.iter("sampler"):
            element.set("type", sampler)
    if mode == "spectral":
        _for_spectra(root)
    _with_integrator(root, values)
    _without_outside(root)
    folder.mkdir()
    for beside in scene.resolve().parent.iterdir():
        (folder / beside.name).symlink_to(beside)
    copy = folder / f"film-{scene.name}"
    tree.write(copy)
    return copy, (width, height)


def _with_integrator(root: ET.Element, values: dict[str, str]) -> None:
    """Put `path` in the place of integrators that only one of the renderers has."""
    old_names = root.get("version", "").startswith("0")
    depth_name = "maxDepth" if old_names else "max_depth"
    if root.find("integrator") is None:
        root.insert(0, ET.Element("integrator", type="path"))
        ET.SubElement(root[0], "integer", name=depth_name, value=str(DEPTH))
    for integrator in root.iter("integrator"):
        kind = integrator.get("type", "")
        kind = values.get(kind[1:], "path") if kind.startswith("$") else kind
        if kind not in SHARED:
            depths = [e for e in integrator.iter("integer") if e.get("name") == depth_name]
            integrator[:] = depths[:1]
            kind = "path"
        integrator.set("type", kind)


def _without_outside(root: ET.Element) -> None:
    """Leave out the index around metals where it is 1: Mitsuba 3 refuses the parameter."""
    for parent in list(root.iter("bsdf")):
        for element in parent.findall("float[@name='extEta']"):
            if "conductor" in parent.get("type", "") and float(element.get("value", "1")) == 1.0:
                parent.remove(element)


def _for_spectra(root: ET.Element) -> None:
    """Say in a scene what Mitsuba's spectral mode needs: see `bench.peers`."""
    for element in root.iter("rgb"):
        if element.get("name") in ("eta", "k"):
            values = element.get("value", "").replace(",", " ").split()
            pairs = sorted(zip(METAL, values, strict=True))
            element.tag = "spectrum"
            element.set("value", ", ".join(f"{nm}:{value}" for nm, value in pairs))
    for texture in root.iter("texture"):
        if texture.get("name") in NUMBERS:
            for old in texture.findall("boolean[@name='raw']"):
                texture.remove(old)
            ET.SubElement(texture, "boolean", name="raw", value="true")
