/* A spot sends its rays evenly into its cone; their power follows its fall toward the edge. */
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
    LightRay r = light_ray_nothing();
    r.o = l.position;
    r.d = to_world(frame_of(l.axis), uniform_cone(v, one_minus_cos));
    r.n = r.d;
    r.power = spectrum_scale(spot_intensity(l, scene, r.d, lambdas), 2.0f * PI * one_minus_cos);
    return r;
}

real spot_emit_pdf(Spot l, vec3 d) { return INV_2PI / max_r(spot_one_minus_cos(l), (real)(1e-12f)); }
