/* A point that emits evenly: intensity times 4 pi [W/nm]. */
Spectrum point_intensity(Point l, Scene scene, vec3 d, Wavelengths lambdas)
{
    return emission_load(scene, l.intensity, texture_point_nowhere(), lambdas);
}

LightRay point_emit(Point l, Scene scene, vec2 u, vec2 v, Wavelengths lambdas)
{
    LightRay r = light_ray_nothing();
    r.o = l.position;
    r.d = uniform_sphere(v);
    r.n = r.d;
    r.power = spectrum_scale(point_intensity(l, scene, r.d, lambdas), 4.0f * PI);
    return r;
}

/* A light without falloff sends no rays: no number of them would give what it is seen to do. */
real point_emit_pdf(Point l, vec3 d) { return sel(l.falloff != 0, (real)(INV_4PI), (real)(0.0f)); }
