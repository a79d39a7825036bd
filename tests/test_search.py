"""Words that people type into the search of the site lead to the page that answers them."""

from __future__ import annotations

import re
from pathlib import Path

DOCS = Path(__file__).resolve().parents[1] / "docs"
WORDS = {
    "animations": "animation, frames, turntable, video",
    "choosing": "bidirectional, blue noise, path guiding, photon mapping, sampler, SPPM, VCM",
    "colour": "ACES, AgX, exposure, OpenColorIO, tone mapping, view transform",
    "coming_from": "Blender, exporter, FBX, Mitsuba, pbrt, USD",
    "custom_materials": "shader",
    "denoising": "denoise, denoiser, OIDN, Open Image Denoise",
    "device_data": "interactive, vertex buffer",
    "devices": "GPU",
    "distributed": "cluster, render farm, SSH",
    "embedding": "PyOpenCL, queue",
    "gpus": "AMD, CUDA, Intel, macOS, NVIDIA, OptiX",
    "install": "conda, container, licence, macOS, pipx, uv, virtual environment, Windows",
    "image_tools": "compare, convert, false colour",
    "images": "EXR, HDR, JPEG, PNG, WebP",
    "interop": "Jupyter, numpy, trimesh",
    "large_scenes": "instancing, out of memory",
    "layers": "albedo, AOV, Cryptomatte, depth pass, light groups, render passes",
    "lenses": "bokeh, fisheye, lens flare",
    "light_transport": "caustics",
    "lighting": "area light, environment map, HDRI, IES, kelvin, lumens, point light, sky, skybox, "
    "softbox, spot light, sun, watts",
    "limits": "differentiable, polarisation, polarization",
    "materials": "fur, hair, metal, plastic",
    "media": "cloud, fog, god rays, mist, OpenVDB, participating media, smoke, subsurface, volume",
    "meshes": "OBJ, PLY, STL",
    "motion": "motion blur, shutter",
    "noise": "noise, samples",
    "recipes": "Blender, bokeh, cloud, copper, depth of field, glass, gold, HDRI, product shot, "
    "silver, spectrum of a pixel, turntable",
    "rendering": "alpha, list of scenes, crop, panorama, resolution, transparent background",
    "resume": "checkpoint",
    "safety": "untrusted",
    "scene_format": "bump, displacement, normal map, texture",
    "sky": "atmosphere, sunset",
    "spectral": "diamond, dispersion, fluorescence, interference, prism, rainbow, soap bubble, "
    "thin film, wavelength",
    "stability": "license, version",
    "troubleshooting": "black picture, cache, crash, Docker, fireflies, no device, slow, "
    "white balance",
    "viewing": "browser, live preview, viewport",
}


def test_words_that_people_look_for_stand_on_the_page_that_answers() -> None:
    lost = []
    for name, words in WORDS.items():
        page = " ".join((DOCS / f"{name}.md").read_text("utf-8").split())
        lost += [
            f"{name}: {word}"
            for word in words.split(", ")
            if not re.search(rf"\b{re.escape(word)}", page, re.I)
        ]
    assert lost == []
