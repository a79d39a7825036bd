"""References of the scenes of hard light.

    python -m bench.hard_light.reference SCENE MILLION_PHOTONS SAMPLES -o OUT.npz

Photons go from the lights through any number of sharp and diffuse bounces. Their power is summed in
square texels on every diffuse parallelogram, so that the light which leaves it is known. The camera
follows sharp bounces alone and reads the texels. Nothing is joined and no lamp has to be hit by
chance: light seen through water costs no more than light seen directly. The only error besides
noise is the constant value of a texel; `density` says how fine they are. Mitsuba's Python traces
the rays.

The files beside this one took 12 to 400 million photons. Their noise is a relative MSE of .0005
(ring; .0015 where it is sharp), .0008 (pool), .0007 (bulb; .0015), .002 (lens) and .02 (door, good
for errors of .1 and more). Of `flat_pool` there is a closed form.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import click
import numpy as np
from numpy.typing import NDArray

from bench.hard_light.scenes import SCENES, SIZE, Diffuse, HardScene, flat_pool_floor, write
from bench.workers import find_llvm

BATCH = 4_000_000  # photons at a time
ROULETTE = 6  # bounces of a photon that are free of it
MOST_SAMPLES = 32  # of a pixel at a time
DEEPEST = 24  # sharp bounces that the camera follows
FINEST, COARSEST = 4096, 4  # texels of a side


def flat_pool(samples: int = 4) -> NDArray[np.float64]:
    """Return the picture of `flat_pool` by its closed form: refraction at the water, the floor's
    radiance, and Fresnel's loss (1 - R) / n^2 on the way out."""
    scene = SCENES["flat_pool"]
    eye, at = np.array(scene.eye), np.array(scene.at)
    forward = (at - eye) / np.linalg.norm(at - eye)
    right = np.cross(forward, [0, 1, 0])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    place = (np.arange(SIZE * samples) + 0.5) / (SIZE / 2 * samples) - 1
    t = np.tan(np.radians(scene.fov / 2))
    d = forward + t * place[None, :, None] * right - t * place[:, None, None] * up
    d /= np.linalg.norm(d, axis=2, keepdims=True)
    n, cos1 = 1.33, -d[..., 1]
    sin2 = np.sqrt(1 - cos1**2) / n
    cos2 = np.sqrt(1 - sin2**2)
    s = ((cos1 - n * cos2) / (cos1 + n * cos2)) ** 2
    p = ((n * cos1 - cos2) / (n * cos1 + cos2)) ** 2
    side = d[..., [0, 2]] / np.linalg.norm(d[..., [0, 2]], axis=2, keepdims=True)
    above = eye[[0, 2]] + d[..., [0, 2]] * (eye[1] / cos1)[..., None]
    floor = above + side * (sin2 / cos2)[..., None]
    radiance = np.interp(np.linalg.norm(floor, axis=2), *flat_pool_floor())
    seen = radiance * (1 - (s + p) / 2) / n**2
    grey = seen.reshape(SIZE, samples, SIZE, samples).mean((1, 3))
    return np.repeat(grey[..., None], 3, 2)


class Texels:
    """The power that has come to each texel, three channels, of the diffuse shapes of a scene.

    The two sides of a parallelogram are kept apart.
    """

    def __init__(self, mi: Any, scene: Any, about: HardScene, density: float):
        import drjit

        self.mi, self.dr, self.scene = mi, drjit, scene
        self.first_quad: dict[Any, int] = {}
        sides: list[int] = []
        firsts: list[int] = []
        areas: list[float] = []
        total = 0
        for shape in scene.shapes():
            if not isinstance(about.shapes[shape.id()][1], Diffuse):
                continue
            self.first_quad[shape] = len(sides)
            parameters = mi.traverse(shape)
            points = np.array(parameters["vertex_positions"]).reshape(-1, 3)
            for a, b, c in np.array(parameters["faces"]).reshape(-1, 3)[::2]:
                area = np.linalg.norm(np.cross(points[b] - points[a], points[c] - points[a]))
                n = int(np.clip(np.ceil(np.sqrt(area) * density), COARSEST, FINEST))
                sides.append(n)
                firsts.append(total)
                areas.append(float(area) / n**2)
                total += 2 * n * n
        self.sides, self.firsts = mi.UInt32(np.array(sides)), mi.UInt32(np.array(firsts))
        self.areas = mi.Float(np.array(areas))
        self.power = [drjit.zeros(mi.Float, total) for _ in range(3)]

    def at(self, hit: Any, active: Any) -> tuple[Any, Any, Any]:
        """Return the number of the hit texel, its area, and whether a texel was hit."""
        mi, dr = self.mi, self.dr
        quad, known = mi.UInt32(0), mi.Bool(False)
        for shape, first in self.first_quad.items():
            here = hit.shape == mi.ShapePtr(shape)
            quad = dr.select(here, mi.UInt32(first), quad)
            known |= here
        quad, active = quad + hit.prim_index // 2, active & known
        n = dr.gather(mi.UInt32, self.sides, quad, active)
        even = (hit.prim_index & 1) == 0
        u = dr.select(even, hit.uv.x + hit.uv.y, hit.uv.x)
        v = dr.select(even, hit.uv.y, hit.uv.x + hit.uv.y)
        i, j = dr.minimum(mi.UInt32(u * n), n - 1), dr.minimum(mi.UInt32(v * n), n - 1)
        back = dr.select(hit.wi.z < 0, n * n, mi.UInt32(0))
        first = dr.gather(mi.UInt32, self.firsts, quad, active)
        return first + back + i * n + j, dr.gather(mi.Float, self.areas, quad, active), active


def shoot(texels: Texels, about: HardScene, count: int, seed: int, sky: bool) -> None:
    """Trace photons of the lamp, or of an even sky, and add their power to the texels."""
    mi, dr, scene = texels.mi, texels.dr, texels.scene
    rng = mi.PCG32(size=count, initstate=seed * 1000003)
    ray, weight = _begin(texels, about, rng, count, sky)
    weight = mi.Color3f(weight) / count
    context = mi.BSDFContext(mi.TransportMode.Importance)
    limit, brightest = mi.UInt32(about.depth - 1), mi.Float(dr.max(weight))

    def bounce(ray: Any, weight: Any, active: Any, depth: Any, rng: Any) -> tuple[Any, ...]:
        hit = scene.ray_intersect(ray, active)
        active &= hit.is_valid()
        at, _, diffuse = texels.at(hit, active)
        for channel in range(3):
            dr.scatter_add(texels.power[channel], weight[channel], at, diffuse)
        lobe, pair = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
        sample, value = hit.bsdf().sample(context, hit, lobe, pair, active)
        weight, depth = weight * value, depth + 1
        chance = dr.select(depth > ROULETTE, dr.minimum(dr.max(weight) / brightest, 0.95), 1)
        active &= (dr.max(weight) > 0) & (depth < limit) & (rng.next_float32() < chance)
        return hit.spawn_ray(hit.to_world(sample.wo)), weight / chance, active, depth, rng

    state = (mi.Ray3f(ray), weight, dr.any(weight > 0), mi.UInt32(0), rng)
    last = dr.while_loop(state, lambda ray, weight, active, depth, rng: active, bounce)
    dr.eval(texels.power, last[1])
    dr.sync_thread()


def _begin(texels: Texels, about: HardScene, rng: Any, count: int, sky: bool) -> tuple[Any, Any]:
    """Photons as they leave a light; where a scene has an `aim`, those that go through it."""
    mi, dr, scene = texels.mi, texels.dr, texels.scene

    def pair() -> Any:
        return mi.Point2f(rng.next_float32(), rng.next_float32())

    if about.aim is None:
        ray, weight, _ = scene.sample_emitter_ray(
            0.0, rng.next_float32(), pair(), pair(), mi.Bool(True)
        )
        return ray, weight
    y, x0, x1, z0, z1 = about.aim
    u, area = pair(), (x1 - x0) * (z1 - z0)
    place = mi.Point3f(x0 + (x1 - x0) * u.x, y, z0 + (z1 - z0) * u.y)
    if sky:
        d = mi.warp.square_to_cosine_hemisphere(pair())
        return mi.Ray3f(place, mi.Vector3f(d.x, -d.z, d.y)), mi.Color3f(about.sky * np.pi * area)
    (lamp,) = (light for light in scene.emitters() if not light.is_environment())
    start = lamp.sample_position(0.0, pair())[0]
    d = place - start.p
    squared = dr.squared_norm(d)
    d /= dr.sqrt(squared)
    front = dr.zeros(mi.SurfaceInteraction3f, count)
    front.wi = mi.Vector3f(0, 0, 1)
    geometry = dr.maximum(dr.dot(start.n, d), 0) * -d.y / squared * area / start.pdf
    return mi.Ray3f(place, d), lamp.eval(front) * geometry


def see(texels: Texels, samples: int, seed: int) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return the picture (h, w, 3), and which pixels see nothing sharp first (h, w)."""
    mi, dr, scene = texels.mi, texels.dr, texels.scene
    sensor, total, direct, done = scene.sensors()[0], np.zeros((SIZE, SIZE, 3)), None, 0
    context = mi.BSDFContext()
    while done < samples:
        some = min(MOST_SAMPLES, samples - done)
        count = SIZE * SIZE * some
        rng = mi.PCG32(size=count, initstate=seed * 77777 + done)
        pixel = dr.arange(mi.UInt32, count) // some
        x, y = mi.Float(pixel % SIZE), mi.Float(pixel // SIZE)
        place = mi.Point2f(x + rng.next_float32(), y + rng.next_float32()) / SIZE
        ray = mi.Ray3f(sensor.sample_ray(0.0, 0.5, place, mi.Point2f(0.5))[0])
        if direct is None:
            first = scene.ray_intersect(ray)
            sharp = first.is_valid() & ~texels.at(first, mi.Bool(True))[2]
            met = dr.block_sum(dr.select(sharp, mi.Float(1), 0), some)
            direct = np.array(met).reshape(SIZE, SIZE) == 0

        def bounce(
            ray: Any, weight: Any, active: Any, depth: Any, rng: Any, seen: Any
        ) -> tuple[Any, ...]:
            hit = scene.ray_intersect(ray, active)
            shines = weight * hit.emitter(scene).eval(hit, active)
            seen = seen + dr.select(active, shines, 0)
            active &= hit.is_valid()
            at, area, diffuse = texels.at(hit, active)
            power = mi.Color3f(*[dr.gather(mi.Float, flux, at, diffuse) for flux in texels.power])
            albedo = hit.bsdf().eval_diffuse_reflectance(hit, diffuse)
            seen = seen + dr.select(diffuse, weight * power * albedo / (dr.pi * area), 0)
            active &= ~diffuse
            lobe = rng.next_float32()
            sample, value = hit.bsdf().sample(context, hit, lobe, mi.Point2f(0.5), active)
            weight, depth = weight * value, depth + 1
            active &= (depth < DEEPEST) & (dr.max(weight) > 0)
            return hit.spawn_ray(hit.to_world(sample.wo)), weight, active, depth, rng, seen

        state = (ray, mi.Color3f(1), mi.Bool(True), mi.UInt32(0), rng, mi.Color3f(0))
        seen = dr.while_loop(state, lambda ray, weight, active, *_: active, bounce)[-1]
        sums = [np.array(dr.block_sum(seen[channel], some)) for channel in range(3)]
        total += np.stack(sums, 1).reshape(SIZE, SIZE, 3)
        done += some
    assert direct is not None
    return total / samples, direct


def render(
    name: str, photons: float, samples: int, seed: int, density: float
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return the picture (h, w, 3), and which pixels see nothing sharp first (h, w).

    photons: in millions; samples: of a pixel; density: texels a metre.
    """
    if name == "flat_pool":
        return flat_pool(), np.zeros((SIZE, SIZE), bool)
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    about = SCENES[name]
    with tempfile.TemporaryDirectory() as folder:
        scene = mi.load_file(str(write(name, Path(folder))))
    texels = Texels(mi, scene, about, density)
    rounds = max(1, round(photons * 1e6 / BATCH))
    for number in range(rounds):
        shoot(texels, about, BATCH, 7919 * seed + 2 * number, False)
        if about.sky:  # it is even: few will do
            shoot(texels, about, BATCH // 8, 7919 * seed + 2 * number + 1, True)
    texels.power = [power / rounds for power in texels.power]
    return see(texels, samples, seed)


@click.command(help=__doc__)
@click.argument("name", type=click.Choice(list(SCENES)))
@click.argument("photons", type=float)
@click.argument("samples", type=int)
@click.option("--seed", default=1, show_default=True)
@click.option("--density", default=96.0, show_default=True, help="texels a metre")
@click.option("-o", "--out", required=True, type=click.Path(path_type=Path))
def main(name: str, photons: float, samples: int, seed: int, density: float, out: Path) -> None:
    find_llvm()
    image, direct = render(name, photons, samples, seed, density)
    np.savez_compressed(out, image=image.astype(np.float16), direct=direct)
    print(name, image.mean((0, 1)))


if __name__ == "__main__":
    main()
