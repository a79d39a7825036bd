/* A point that emits evenly: its irradiance falls with the square of the distance, if falloff is 1. */
LightSample point_sample(Point l, Scene scene, vec3 p, vec2 u, Wavelengths lambdas)
{
    vec3 to = sub3(l.position, p);
    real t2 = max_r(dot3(to, to), (real)(1e-20f)), t = sqrt(t2);
    LightSample s;
    s.wi = scale3(to, 1.0f / t);
    s.t = t;
    s.radiance = spectrum_scale(emission_load(scene, l.intensity, texture_point_nowhere(), lambdas),
                                sel(l.falloff != 0, 1.0f / t2, (real)(1.0f)));
    s.pdf = -1.0f;
    return s;
}
