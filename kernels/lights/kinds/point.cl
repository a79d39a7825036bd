/* A point that emits evenly: its irradiance falls with the square of the distance, if falloff is 1. */
LightSample point_sample(Point l, Scene scene, vec3 p, vec2 u, Wavelengths lambdas)
{
    real t2;
    LightSample s = light_toward(l.position, p, &t2);
    s.radiance = spectrum_scale(emission_load(scene, l.intensity, texture_point_nowhere(), lambdas),
                                sel(l.falloff != 0, 1.0f / t2, (real)(1.0f)));
    s.pdf = -1.0f;
    return s;
}

/* Step emission: a point that emits evenly: intensity times 4 pi [W/nm]. */
Spectrum point_intensity(Point l, Scene scene, vec3 d, Wavelengths lambdas)
{
    return emission_load(scene, l.intensity, texture_point_nowhere(), lambdas);
}

LightRay point_emit(Point l, Scene scene, vec2 u, vec2 v, Wavelengths lambdas)
{
    LightRay r = light_ray_along(l.position, uniform_sphere(v));
    r.power = spectrum_scale(point_intensity(l, scene, r.d, lambdas), 4.0f * PI);
    return r;
}

/* A light without falloff sends no rays: no number of them would give what it is seen to do. */
real point_emit_pdf(Point l, vec3 d) { return sel(l.falloff != 0, (real)(INV_4PI), (real)(0.0f)); }
