"""Words of PBRT versions 2 and 3 and their names in version 4; each row names its source.

Sources are files of the repository mmp/pbrt-v3, unless another repository is named.
"""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from clpt.formats.pbrt.params import Parameter
from clpt.spectra import cie

# What only files of versions 2 and 3 say.
OLD = re.compile(
    rb"^[ \t]*(?:WorldEnd|SurfaceIntegrator|VolumeIntegrator|Renderer|PixelSampler)\b"
    rb'|Film\s+"image"|"(?:color|xyz)\s+\w+"|Texture\s+"[^"\n]*"\s+"color"|(?:(?<![a-zA-Z])Material|"string\s+type"\s*\[?)\s*'
    rb'"(?:matte|plastic|uber|substrate|translucent|kdsubsurface|disney|mirror|glass|metal)"',
    re.MULTILINE,
)
# directive, directive of version 4, source
DIRECTIVES = (
    ("SurfaceIntegrator", "Integrator", "pbrt-v2, src/core/pbrtparse.yy"),
    ("PixelSampler", "Sampler", "pbrt-v2, src/core/pbrtparse.yy"),
)
# directives that change no expected picture, source
LEFT_OUT = (
    ("VolumeIntegrator", "pbrt-v2, src/core/api.cpp"),
    ("Renderer", "pbrt-v2, src/core/api.cpp"),
    ("Volume", "pbrt-v2, src/core/api.cpp"),
)
# directive, kind, kind of version 4, source
KINDS = (
    ("Film", "image", "rgb", "src/core/film.cpp"),
    ("Camera", "environment", "spherical", "src/cameras/environment.cpp"),
    ("Sampler", "02sequence", "paddedsobol", "src/samplers/zerotwosequence.cpp"),
    ("Sampler", "lowdiscrepancy", "paddedsobol", "src/samplers/zerotwosequence.cpp"),
    ("Sampler", "maxmindist", "paddedsobol", "src/samplers/maxmin.cpp"),
    ("Sampler", "random", "independent", "src/samplers/random.cpp"),
    ("Sampler", "adaptive", "halton", "pbrt-v2, src/samplers/adaptive.cpp"),
    ("Sampler", "bestcandidate", "halton", "pbrt-v2, src/samplers/bestcandidate.cpp"),
    ("LightSource", "exinfinite", "infinite", "src/core/api.cpp"),
    ("LightSource", "goniophotometric", "goniometric", "src/lights/goniometric.cpp"),
    ("AreaLightSource", "area", "diffuse", "src/lights/diffuse.cpp"),
    ("MakeNamedMedium", "heterogeneous", "uniformgrid", "src/media/grid.cpp"),
    ("Material", "kdsubsurface", "subsurface", "src/materials/kdsubsurface.cpp"),
    ("MakeNamedMaterial", "kdsubsurface", "subsurface", "src/materials/kdsubsurface.cpp"),
)
# directive, parameter, parameter of version 4, source
PARAMETERS = (
    ("Film", "maxsampleluminance", "maxcomponentvalue", "src/core/film.cpp"),
    ("PixelFilter", "xwidth", "xradius", "src/filters/gaussian.cpp"),
    ("PixelFilter", "ywidth", "yradius", "src/filters/gaussian.cpp"),
    ("LightSource", "mapname", "filename", "src/lights/infinite.cpp"),
    ("Material", "bumpmap", "displacement", "src/materials/matte.cpp"),
    ("MakeNamedMaterial", "bumpmap", "displacement", "src/materials/matte.cpp"),
    ("Shape", "nlevels", "levels", "src/shapes/loopsubdiv.cpp"),
    ("Shape", "st", "uv", "src/shapes/triangle.cpp"),
)
# directive, parameter that changes no expected picture, source
IGNORED = (
    ("LightSource", "samples", "src/lights/infinite.cpp"),
    ("LightSource", "nsamples", "src/lights/infinite.cpp"),
    ("AreaLightSource", "samples", "src/lights/diffuse.cpp"),
    ("AreaLightSource", "nsamples", "src/lights/diffuse.cpp"),
    ("Shape", "discarddegenerateUVs", "src/shapes/triangle.cpp"),
    ("Shape", "shadowalpha", "src/shapes/triangle.cpp"),
    ("Shape", "faceIndices", "src/shapes/triangle.cpp"),
    ("Sampler", "dimensions", "src/samplers/stratified.cpp"),
    ("Sampler", "samplesperpixel", "src/samplers/random.cpp"),
    ("Integrator", "strategy", "src/integrators/directlighting.cpp"),
    ("Integrator", "lightsamplestrategy", "src/integrators/path.cpp"),
    ("Texture", "maxanisotropy", "src/textures/imagemap.cpp"),
    ("Texture", "aamode", "src/textures/checkerboard.cpp"),
)

_DIRECTIVES = {old: new for old, new, _ in DIRECTIVES}
_LEFT_OUT = {name for name, _ in LEFT_OUT}
_KINDS = {(directive, old): new for directive, old, new, _ in KINDS}
_PARAMETERS = {(directive, old): new for directive, old, new, _ in PARAMETERS}
_IGNORED = {(directive, name) for directive, name, _ in IGNORED}


def is_old(data: bytes) -> bool:
    """Return whether the text of a file is of version 2 or 3."""
    for match in OLD.finditer(data):
        line = data.rfind(b"\n", 0, match.start()) + 1
        if b"#" not in data[line : match.start()]:
            return True
    return False


def directive(name: str) -> str:
    """Return the directive of version 4; "" for a directive that changes no expected picture."""
    return "" if name in _LEFT_OUT else _DIRECTIVES.get(name, name)


def definition(name: str, kind: str, values: list[Parameter]) -> tuple[str, list[Parameter]]:
    """Return the kind and the parameters of a directive in the words of version 4."""
    kept = []
    for parameter in values:
        if (name, parameter.name) not in _IGNORED:
            new = _PARAMETERS.get((name, parameter.name), parameter.name)
            kept.append(_retyped(replace(parameter, name=new)))
    kinds = [kind]
    if name in ("MakeNamedMedium", "MakeNamedMaterial"):
        for parameter in kept:
            if parameter.name == "type" and parameter.is_text:
                kinds = parameter.texts()
                parameter.values = [_KINDS.get((name, text), text) for text in kinds]
    if kinds[:1] == ["kdsubsurface"]:
        for parameter in kept:
            parameter.name = "reflectance" if parameter.name == "Kd" else parameter.name
    return _KINDS.get((name, kind), kind), kept


def _retyped(parameter: Parameter) -> Parameter:
    """Return a parameter with version 4's type of its values."""
    if parameter.type == "color":
        return replace(parameter, type="spectrum" if parameter.is_text else "rgb")
    if parameter.type == "xyz":
        rgb = np.array(parameter.numbers(3)) @ cie.XYZ_TO_REC709.T
        return replace(parameter, type="rgb", values=np.maximum(rgb, 0.0))
    if parameter.type == "float" and parameter.name == "uv":
        return replace(parameter, type="point2")
    return parameter
