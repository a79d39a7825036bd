"""Lights that only tests have: a wire and a tube, with their kernels. Text, for a copy of clpt."""

from __future__ import annotations

PYTHON = '''
@dataclass(frozen=True, kw_only=True, eq=False)
class Wire(PoweredLamp):
    """A straight wire along x of `to_world`, about its position, that emits evenly."""

    to_world: Matrix4 = host(np.eye(4), "placement, (4, 4); the wire lies along its x")
    intensity: SpectrumLike = emission(1.0, "radiant intensity of all of it", "W sr^-1 nm^-1")
    length: float = real(4.0, "of the wire", "m", low=0.0)

    def extent(self, area: float) -> float:
        """Return the solid angle of all directions [sr]."""
        return 4.0 * math.pi


@dataclass(frozen=True, kw_only=True, eq=False)
class Tube(PoweredLamp):
    """A glowing gas in a tube along x of `to_world`; it knows its bounds."""

    to_world: Matrix4 = host(np.eye(4), "placement, (4, 4); the tube lies along its x")
    intensity: SpectrumLike = emission(1.0, "radiant intensity of all of it", "W sr^-1 nm^-1")
    length: float = real(4.0, "of the tube", "m", low=0.0)
    width: float = real(0.2, "of the tube, which is square", "m", low=0.0)

    def extent(self, area: float) -> float:
        """Return the solid angle of all directions [sr]."""
        return 4.0 * math.pi

    def bounds(self) -> LightBounds:
        """Return the box around the tube."""
        matrix = np.asarray(self.to_world, np.float64)
        axes = matrix[:3, :3] / np.linalg.norm(matrix[:3, :3], axis=0)
        half = np.abs(axes) @ (0.5 * np.array([self.length, self.width, self.width]))
        return LightBounds(matrix[:3, 3] - half, matrix[:3, 3] + half)

'''
POINTS = {
    "Wire": "add3(l.position, scale3(l.x, (u.x - 0.5f) * l.length))",
    "Tube": "add3(add3(l.position, scale3(l.x, (u.x - 0.5f) * l.length)), "
    "scale3(l.y, (u.y - 0.5f) * l.width))",
}


def sampling(name: str) -> str:
    """The functions of next-event estimation."""
    kind = name.lower()
    return f"""
LightSample {kind}_sample({name} l, Scene scene, vec3 p, vec2 u, Wavelengths lambdas)
{{
    vec3 to = sub3({POINTS[name]}, p);
    real t2 = max_r(dot3(to, to), (real)(1e-20f)), t = sqrt(t2);
    LightSample s;
    s.wi = scale3(to, 1.0f / t);
    s.t = t;
    Spectrum value = emission_load(scene, l.intensity, texture_point_nowhere(), lambdas);
    s.radiance = spectrum_scale(value, 1.0f / t2);
    s.pdf = -1.0f;
    return s;
}}
"""


def emitting(name: str) -> str:
    """The functions of light paths."""
    kind = name.lower()
    return f"""
/* Step emission: evenly in all directions. */
Spectrum {kind}_intensity({name} l, Scene scene, vec3 d, Wavelengths lambdas)
{{
    return emission_load(scene, l.intensity, texture_point_nowhere(), lambdas);
}}
LightRay {kind}_emit({name} l, Scene scene, vec2 u, vec2 v, Wavelengths lambdas)
{{
    LightRay r = light_ray_nothing();
    r.o = {POINTS[name]};
    r.d = uniform_sphere(v);
    r.n = r.d;
    r.power = spectrum_scale({kind}_intensity(l, scene, r.d, lambdas), 4.0f * PI);
    return r;
}}
real {kind}_emit_pdf({name} l, vec3 d) {{ return (real)(INV_4PI); }}
"""
