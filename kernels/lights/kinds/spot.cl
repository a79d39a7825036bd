/* A point that shines along `axis`: full intensity within the beam, then down to zero at the cutoff, linear
 * in the angle as Mitsuba's spot, or in its cosine, by a cubic as pbrt-v4's or the 4th power as pbrt-v3's.
 * Irradiance falls with the square of the distance. */
inline real spot_cosine_edge(Spot l, real cos_t)
{
    real sin_t, full, end;
    sincos_2pi(l.beam_width * INV_2PI, &sin_t, &full);
    sincos_2pi(l.cutoff * INV_2PI, &sin_t, &end);
    real x = clamp_r((cos_t - end) / max_r(full - end, (real)(1e-7f)), (real)(0.0f), (real)(1.0f));
    real x2 = x * x;
    return sel(l.edge == 2, x2 * x2, x2 * (3.0f - 2.0f * x));
}

/* What arrives of the full intensity, cos_t off the axis. */
inline real spot_edge(Spot l, real cos_t)
{
    real angle = atan2_r(sqrt_r(1.0f - cos_t * cos_t), cos_t);
    real edge = clamp_r((l.cutoff - angle) / max_r(l.cutoff - l.beam_width, (real)(1e-7f)), (real)(0.0f), (real)(1.0f));
    mask by_cosine = l.edge != 0;
    if (any(by_cosine)) edge = sel(by_cosine, spot_cosine_edge(l, cos_t), edge);
    return edge;
}

LightSample spot_sample(Spot l, Scene scene, vec3 p, vec2 u, Wavelengths lambdas)
{
    real t2;
    LightSample s = light_toward(l.position, p, &t2);
    real edge = spot_edge(l, -dot3(s.wi, l.axis));
    s.radiance = spectrum_scale(emission_load(scene, l.radiance, texture_point_nowhere(), lambdas), edge / t2);
    s.pdf = sel(edge > 0.0f, (real)(-1.0f), (real)(0.0f));
    return s;
}

/* Step emission: a spot sends its rays evenly into its cone; their power follows its fall toward the edge. */
inline real spot_one_minus_cos(Spot l)
{
    real s, c;
    sincos_2pi(l.cutoff * INV_4PI, &s, &c); /* of half the angle: 1 - cos = 2 sin^2 */
    return 2.0f * s * s;
}

Spectrum spot_intensity(Spot l, Scene scene, vec3 d, Wavelengths lambdas)
{
    Spectrum full = emission_load(scene, l.radiance, texture_point_nowhere(), lambdas);
    return spectrum_scale(full, spot_edge(l, dot3(d, l.axis)));
}

LightRay spot_emit(Spot l, Scene scene, vec2 u, vec2 v, Wavelengths lambdas)
{
    real one_minus_cos = spot_one_minus_cos(l);
    LightRay r = light_ray_along(l.position, to_world(frame_of(l.axis), uniform_cone(v, one_minus_cos)));
    r.power = spectrum_scale(spot_intensity(l, scene, r.d, lambdas), 2.0f * PI * one_minus_cos);
    return r;
}

real spot_emit_pdf(Spot l, vec3 d) { return INV_2PI / max_r(spot_one_minus_cos(l), (real)(1e-12f)); }
