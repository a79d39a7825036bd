"""Requirements of denoisers on a scene, and remarks on scenes that they render badly."""

from __future__ import annotations

import dataclasses

from clpt.choices import DENOISERS
from clpt.errors import UnknownKindError
from clpt.scene import Scene
from clpt.scene.integrators import (
    HAVE_LAYERS,
    PIXELWISE,
    Integrator,
    ParticleTracer,
    Sampler,
    Vcm,
)

LAYERS = ("denoising_albedo", "denoising_normal")


def check_method(method: str) -> str:
    """Return the name of a denoiser. Raises UnknownKindError."""
    if method not in DENOISERS:
        raise UnknownKindError("denoiser", str(method), DENOISERS, where="denoise")
    return method


def prepared(scene: Scene, method: str | None) -> Scene:
    """Return the scene with the layers that denoisers read, and pixels that share no samples.

    method: of denoising; None: the scene stays as it is.

    Where the film splats, neighbours share samples, and denoisers take what noise they have in
    common for detail. So `film.filtering` becomes importance, where the scene does not ask for
    splatting. Photons are shared too: the integrator `auto` chooses without them. Integrators
    without layers are left without.
    """
    if method is None:
        return scene
    film = scene.film
    layers = LAYERS if isinstance(scene.integrator, HAVE_LAYERS) else ()
    wanted = (*film.layers, *(name for name in layers if name not in film.layers))
    filtering = "importance" if film.filtering == "auto" else film.filtering
    film = dataclasses.replace(film, layers=wanted, filtering=filtering)
    return dataclasses.replace(scene, film=film, integrator=scene.integrator.for_denoiser())


def halves(method: str | None, noise: float | None) -> bool:
    """Whether even and odd samples are kept apart: they tell the error of a denoised picture.

    noise: the scene's limit of noise.
    """
    return method == "statistical" or (method is not None and noise is not None)


def remarks(
    integrator: Integrator, sampler: Sampler, splats: bool, noise_before: bool = False
) -> list[str]:
    """Return why a denoised picture may keep noise, for people.

    integrator: that renders it; splats: whether samples serve several pixels; noise_before: whether
    a limit of noise is for the picture before it is denoised.
    """
    advice = "denoisers keep noise that neighbouring pixels share"
    causes = []
    if splats:
        causes.append(
            f"the film splats, so neighbouring pixels share samples; {advice}: set "
            "film.filtering to importance"
        )
    if isinstance(integrator, Vcm) and integrator.merging:
        causes.append("the noise of vcm is blotchy, and may stay; try the integrator path")
    if not isinstance(sampler, PIXELWISE):
        causes.append(
            f"with the sampler {sampler.kind} neighbouring pixels err together; {advice}: "
            "choose sobol"
        )
    if noise_before:
        causes.append(
            "with light paths the limit of noise is for the picture before it is denoised; with "
            "light_paths 0 (--light-paths 0) it is for the denoised picture"
        )
    if isinstance(integrator, ParticleTracer):
        causes.append("particle_tracer has no layers, so edges in the picture are less sharp")
    return causes
