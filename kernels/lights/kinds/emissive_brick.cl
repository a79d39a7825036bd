/* A brick of a medium that emits: eight cells along each axis of its grid. A sampled point is uniform in the brick. Its
 * emission per metre stands for the whole mean chord c of the brick, four times the volume over the surface. So the
 * radiance of the sample is c times the emission, and its density [1/sr] is c t^2 / V: on average 1 over the solid
 * angle of the brick. A ray through the medium weighs the emission that it gathers against this density (MIS,
 * media/grid_flight.cl). Villemin and Hery 2013 sample flames as lights; the weights are ours. */

real emissive_brick_pdf(EmissiveBrick l, real t) { return l.inverse * l.chord * t * t; }

LightSample emissive_brick_sample(EmissiveBrick l, Scene scene, vec3 p, vec2 u, Wavelengths lambdas)
{
    natural bits = hash_natural(as_natural(u.y) ^ 0x68bc21ebu); /* u.x may be what a choice left, and rounded */
    real third = unit_interval(bits);
    vec3 q = madd3(l.x, u.x, madd3(l.y, u.y, madd3(l.z, third, l.corner)));
    vec3 to = sub3(q, p);
    mask known = l.medium != 0;
    real t = sqrt(max_r(dot3(to, to), (real)(1e-20f)));
    GridWalk w = grid_point(scene, l.medium, l.number, q, known);
    GridBrick b = grid_brick(scene, w, known);
    Medium m = medium_load(scene, sel_i(known, l.medium, (integer)(0)), lambdas);
    Spectrum emits = grid_emission(scene, l.medium, m, w, b, known, hash_natural(bits ^ 0x3c6ef372u), lambdas);
    LightSample s = light_sample_nothing();
    s.wi = scale3(to, 1.0f / t);
    s.t = t;
    s.radiance = spectrum_scale(emits, l.chord);
    s.pdf = sel(known & (spectrum_max(emits) > 0.0f), emissive_brick_pdf(l, t), (real)(0.0f));
    return s;
}

/* Step chosen: the density of next-event estimation from p for a point of a brick at distance t [1/sr]. */
inline real brick_light_pdf(Scene scene, integer row, vec3 p, Receiver receiver, real t)
{
    LightRow l = light_at(scene, row);
    real pdf = emissive_brick_pdf(emissive_brick_row(scene.light_params, l.params), t);
    return pdf * light_pmf(scene, row, l, p, receiver);
}
