/* A homogeneous medium that emits, inside a boundary. A sampled direction leads to a uniform point of a ball or box
 * around the medium. If the ray is inside from t0 to t1, its density is (t1^3 - t0^3) / (3 V) [1/sr]: large for a long
 * way inside, as the light of a thin medium is. A ray through the medium weighs all emission that it gathers against
 * this density (MIS, media/flight.cl).
 *
 * The distance of the emission along the ray is sampled by the extinction. A shadow ray to that point applies the
 * transmittance, and finds whether the point is in the medium. So the estimate of a direction has no noise if the
 * medium is grey, fills the ball or box, and holds no shapes. */
#define BODY_THIN 1e-3f /* optical depth below which the distance is uniform */

typedef struct {
    mask meets;
    real near, length; /* the way of a ray in the body [m] */
} BodyWay;

inline BodyWay emissive_body_way(EmissiveBody l, vec3 p, vec3 d)
{
    vec3 o = v3(dot3(l.x, p) + l.at.x, dot3(l.y, p) + l.at.y, dot3(l.z, p) + l.at.z);
    vec3 w = v3(dot3(l.x, d), dot3(l.y, d), dot3(l.z, d));
    real speed2 = max_r(dot3(w, w), (real)(1e-30f)), middle = -dot3(o, w) / speed2;
    vec3 across = madd3(w, middle, o);
    real half_way = sqrt_r(max_r(1.0f - dot3(across, across), (real)(0.0f)) / speed2);
    real in = middle - half_way, out = middle + half_way;
    if (any(l.box != 0)) {
        real first = -(real)(FAR), last = FAR;
#define AXIS(a)                                                                                  \
    real step_##a = 1.0f / sel(fabs(w.a) > 1e-20f, w.a, (real)(1e-20f));                         \
    real one_##a = (-1.0f - o.a) * step_##a, two_##a = (1.0f - o.a) * step_##a;                  \
    first = max_r(first, min_r(one_##a, two_##a));                                               \
    last = min_r(last, max_r(one_##a, two_##a));
        AXIS(x)
        AXIS(y)
        AXIS(z)
#undef AXIS
        in = sel(l.box != 0, first, in);
        out = sel(l.box != 0, last, out);
    }
    BodyWay way;
    way.near = max_r(in, (real)(0.0f));
    way.length = sel(in > 0.0f, out - in, out);
    way.meets = way.length > 0.0f;
    return way;
}

/* [1/sr] */
inline real emissive_body_way_pdf(EmissiveBody l, BodyWay way)
{
    real far = way.near + way.length;
    real cubes = way.length * (far * far + far * way.near + way.near * way.near);
    return sel(way.meets, cubes * l.inverse * (1.0f / 3.0f), (real)(0.0f));
}

real emissive_body_pdf(EmissiveBody l, vec3 p, vec3 d)
{
    return emissive_body_way_pdf(l, emissive_body_way(l, p, d));
}

/* A uniform point of the ball or box, in the world. */
inline vec3 emissive_body_point(EmissiveBody l, vec2 u, real third)
{
    vec3 unit = v3(2.0f * u.x - 1.0f, 2.0f * u.y - 1.0f, 2.0f * third - 1.0f);
    vec3 ball = scale3(uniform_sphere(u), exp_r(log_r(max_r(third, (real)(1e-12f))) * (1.0f / 3.0f)));
    unit = sel3(l.box != 0, unit, ball);
    return madd3(l.edge_x, unit.x, madd3(l.edge_y, unit.y, madd3(l.edge_z, unit.z, l.center)));
}

/* Distance of the emission along the ray inside [m], by the extinction at a random wavelength, which `choice` selects:
 * not at the hero wavelength, as the extinction at others may be far smaller. */
inline real body_depth(Spectrum sigma_t, real length, real u, real choice)
{
    real place = 0.0f, sigma = 0.0f;
#define C(c)                                                        \
    sigma = sel(choice * SPECTRUM_SIZE >= place, sigma_t.c, sigma); \
    place += 1.0f;
    SPECTRUM_EACH(C)
#undef C
    sigma = max_r(sigma, (real)(1e-30f));
    real depth = sigma * length;
    real lost = 1.0f - exp_r(-min_r(depth, (real)(80.0f)));
    real inside = -log_r(max_r(1.0f - u * lost, (real)(1e-9f))) / sigma;
    return min_r(sel(depth < BODY_THIN, u * length, inside), length);
}

/* Its density [1/m], over all wavelengths. */
inline real body_depth_pdf(Spectrum sigma_t, real length, real inside)
{
    Spectrum r;
#define C(c)                                                                                                  \
    real depth_##c = sigma_t.c * length, lost_##c = 1.0f - exp_r(-min_r(depth_##c, (real)(80.0f)));           \
    r.c = sel(depth_##c < BODY_THIN, 1.0f / length,                                                           \
              sigma_t.c * exp_r(-min_r(sigma_t.c * inside, (real)(80.0f))) / max_r(lost_##c, (real)(1e-30f)));
    SPECTRUM_EACH(C)
#undef C
    return spectrum_mean(r);
}

LightSample emissive_body_sample(EmissiveBody l, Scene scene, vec3 p, vec2 u, Wavelengths lambdas)
{
    natural bits = hash_natural(as_natural(u.y) ^ 0x68bc21ebu); /* u.x may be what a choice left, and rounded */
    real more = unit_interval(hash_natural(bits ^ 0x3c6ef372u));
    vec3 to = sub3(emissive_body_point(l, u, unit_interval(bits)), p);
    LightSample s = light_sample_nothing();
    s.wi = scale3(to, 1.0f / sqrt_r(max_r(dot3(to, to), (real)(1e-20f))));
    BodyWay way = emissive_body_way(l, p, s.wi);
    mask known = (l.medium != 0) & way.meets;
    Medium m = medium_load(scene, sel_i(known, l.medium, (integer)(0)), lambdas);
    real inside = body_depth(m.sigma_t, way.length, more, unit_interval(hash_natural(bits ^ 0xdaa66d2bu)));
    real chance = body_depth_pdf(m.sigma_t, way.length, inside);
    s.t = way.near + inside;
    Spectrum emits = medium_metre(scene, sel_i(known, l.medium, (integer)(0)), m, lambdas);
    s.radiance = spectrum_scale(emits, 1.0f / sel(known, chance, (real)(1.0f)));
    s.pdf = sel(known & (spectrum_max(emits) > 0.0f), emissive_body_way_pdf(l, way), (real)(0.0f));
    return s;
}

/* Step chosen: the density of next-event estimation from p for a direction d to a body [1/sr]. */
inline real body_light_pdf(Scene scene, integer row, vec3 p, Receiver receiver, vec3 d)
{
    LightRow l = light_at(scene, row);
    real pdf = emissive_body_pdf(emissive_body_row(scene.light_params, l.params), p, d);
    return pdf * light_pmf(scene, row, l, p, receiver);
}
