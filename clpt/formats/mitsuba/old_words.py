"""Words of Mitsuba 0.3 to 0.6 and their names in Mitsuba 3; each row names its source.

Sources are files of the repository mitsuba-renderer/mitsuba (0.6), which read the same files.
"""

from __future__ import annotations

from clpt.formats.mitsuba.xml import Element

# tag, tag of today, source
TAGS = (
    ("luminaire", "emitter", "data/schema/upgrade_0.3.0.xsl"),
    ("camera", "sensor", "data/schema/upgrade_0.3.0.xsl"),
)
# tag, plugin, plugin of today, source
PLUGINS = (
    ("bsdf", "lambertian", "diffuse", "data/schema/upgrade_0.2.1.xsl"),
    ("film", "ldrfilm", "hdrfilm", "src/films/ldrfilm.cpp"),
    ("film", "exrfilm", "hdrfilm", "data/schema/upgrade_0.3.0.xsl"),
    ("film", "pngfilm", "hdrfilm", "data/schema/upgrade_0.3.0.xsl"),
    ("film", "tiledhdrfilm", "hdrfilm", "src/films/tiledhdrfilm.cpp"),
    ("sampler", "sobol", "independent", "src/samplers/sobol.cpp"),
    ("sampler", "halton", "independent", "src/samplers/halton.cpp"),
    ("sampler", "hammersley", "independent", "src/samplers/hammersley.cpp"),
    ("sampler", "faure", "independent", "src/samplers/faure.cpp"),
    ("integrator", "bdpt", "auto", "src/integrators/bdpt/bdpt.cpp"),
    ("integrator", "mlt", "auto", "src/integrators/mlt/mlt.cpp"),
    ("integrator", "pssmlt", "auto", "src/integrators/pssmlt/pssmlt.cpp"),
    ("integrator", "erpt", "auto", "src/integrators/erpt/erpt.cpp"),
    ("integrator", "photonmapper", "auto", "src/integrators/photonmapper/photonmapper.cpp"),
    ("integrator", "ppm", "auto", "src/integrators/photonmapper/ppm.cpp"),
    ("integrator", "vpl", "auto", "src/integrators/vpl/vpl.cpp"),
    ("integrator", "sppm", "vcm", "src/integrators/photonmapper/sppm.cpp"),
    ("integrator", "volpath_simple", "volpath", "src/integrators/path/volpath_simple.cpp"),
    ("texture", "vertexcolors", "mesh_attribute", "src/textures/vertexcolors.cpp"),
)
# tag, plugin or "" for all, parameter, parameter of today, source
PARAMETERS = (
    ("emitter", "area", "intensity", "radiance", "data/schema/upgrade_0.3.0.xsl"),
    ("emitter", "constant", "intensity", "radiance", "data/schema/upgrade_0.3.0.xsl"),
    ("emitter", "envmap", "intensity_scale", "scale", "data/schema/upgrade_0.3.0.xsl"),
    ("medium", "", "density_multiplier", "scale", "data/schema/upgrade_0.3.0.xsl"),
    ("medium", "heterogeneous", "density", "sigma_t", "src/medium/heterogeneous.cpp"),
    ("sensor", "", "focus_depth", "focus_distance", "data/schema/upgrade_0.3.0.xsl"),
)
LOOK_AT = {"origin": ("ox", "oy", "oz"), "target": ("tx", "ty", "tz"), "up": ("ux", "uy", "uz")}

_TAGS = {old: new for old, new, _ in TAGS}
_PLUGINS = {(tag, old): new for tag, old, new, _ in PLUGINS}
_PARAMETERS = {(tag, plugin, old): new for tag, plugin, old, new, _ in PARAMETERS}


def rename(root: Element) -> list[tuple[Element, str, str]]:
    """Give a tree of an old file the words of today; return the plugins: element, old, new."""
    renamed = []
    for element in root.walk():
        element.tag = _TAGS.get(element.tag, element.tag)
        if element.tag == "lookat":
            _join(element)
        plugin = element.type
        for child in element.children:
            for key in ((element.tag, plugin, child.name), (element.tag, "", child.name)):
                if key in _PARAMETERS:
                    child.attributes["name"] = _PARAMETERS[key]
        if (new := _PLUGINS.get((element.tag, plugin))) is not None:
            element.attributes["type"] = new
            renamed.append((element, plugin, new))
        if element.tag == "shape" and plugin == "cylinder":
            _shift_ends(element)
    return renamed


def _join(step: Element) -> None:
    """Join the nine numbers of a lookAt of version 0.3."""
    for name, parts in LOOK_AT.items():
        if name not in step.attributes and all(part in step.attributes for part in parts):
            step.attributes[name] = " ".join(step.attributes[part] for part in parts)


def _shift_ends(cylinder: Element) -> None:
    """0.3 counts the ends of a cylinder from 1: p1 and p2."""
    ends = {child.name: child for child in cylinder.children}
    if "p2" in ends and "p0" not in ends:
        for old, new in (("p1", "p0"), ("p2", "p1")):
            if old in ends:
                ends[old].attributes["name"] = new
