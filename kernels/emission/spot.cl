/* A spot sends its rays evenly into its cone; their power follows its fall toward the edge, as the light
 * sample sees it from a metre away. */
inline real spot_one_minus_cos(Spot l)
{
    real s, c;
    sincos_2pi(l.cutoff * INV_4PI, &s, &c); /* of half the angle: 1 - cos = 2 sin^2 */
    return 2.0f * s * s;
}

LightRay spot_emit(Spot l, Scene scene, vec2 u, vec2 v, Wavelengths lambdas)
{
    real one_minus_cos = spot_one_minus_cos(l);
    LightRay r = light_ray_nothing();
    r.o = l.position;
    r.d = to_world(frame_of(l.axis), uniform_cone(v, one_minus_cos));
    r.n = r.d;
    LightSample seen = spot_sample(l, scene, add3(l.position, r.d), u, lambdas);
    r.power = spectrum_scale(seen.radiance, 2.0f * PI * one_minus_cos);
    return r;
}

real spot_emit_pdf(Spot l, vec3 d) { return INV_2PI / max_r(spot_one_minus_cos(l), (real)(1e-12f)); }
