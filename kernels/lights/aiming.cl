/* Light paths that start toward specular shapes, where light paths have MIS weights.
 *
 * Spheres stand around glass and mirrors, see clpt/render/lights/aims.py; `distributions` has centre, radius and share
 * of each, the smallest first. The share s_k of the light paths aims at sphere k, the others start as without aiming,
 * with density p. From a point of a light an aimed direction lies evenly in the cone that the sphere fills, p_k = 1 /
 * (2 pi (1 - cos)) [1/sr]; from infinity a path starts evenly over the sphere's disk across its direction, p_k = 1 /
 * (pi r^2) [1/m^2]. Where a light's surface turns away from a sphere, or contains the light, or a smaller sphere
 * contains it, as a bulb does, p_k = p. The density of a light path is the sum over all these techniques:
 *
 *     p' = (1 - sum s_k) p + sum s_k p_k
 *
 * (balance heuristic of a single sample, Veach 1997, 9.2.4). MIS weights of both sides use gain = p' / p. */

/* Step. */
#define AIM_WORDS 5

typedef struct {
    vec3 center;
    real radius;
    real share;
} Aim;

/* Sphere k, equal in all lanes. */
inline Aim aim_of(Scene scene, int k)
{
    global const float *row = scene.distributions + scene.settings->aims + AIM_WORDS * k;
    Aim a;
    a.center = v3((real)(row[0]), (real)(row[1]), (real)(row[2]));
    a.radius = row[3];
    a.share = row[4];
    return a;
}

/* Whether a point is in a sphere. to: from the point to the centre. */
inline mask aim_inside(vec3 to, real radius) { return dot3(to, to) <= radius * radius; }

/* 1 - cos of the half angle of the cone that a sphere fills. */
inline real aim_cone(vec3 to, real radius)
{
    real sin2 = min_r(radius * radius / max_r(dot3(to, to), (real)(1e-30f)), (real)(1.0f));
    return sin2 / (1.0f + sqrt(1.0f - sin2));
}

/* Chooses the sphere of a light path, -1 for none. *x: uniform in [0, 1), rescaled to a new random number. */
inline integer aim_choose(Scene scene, real *x)
{
    integer chosen = -1;
    real end = 0.0f, first = 0.0f, width = 0.0f;
    for (int k = 0; k < scene.settings->aim_count; k++) {
        real begin = end, share = aim_of(scene, k).share;
        end = begin + share;
        mask here = (*x >= begin) & (*x < end);
        chosen = sel_i(here, (integer)(k), chosen);
        first = sel(here, begin, first);
        width = sel(here, share, width);
    }
    first = sel(chosen < 0, end, first);
    width = sel(chosen < 0, 1.0f - end, width);
    *x = clamp_r((*x - first) / width, (real)(0.0f), (real)(0.99999994f));
    return chosen;
}

/* Turns or moves a ray from a light to the sphere `chosen` where possible. n: normal at the origin, 0 off all surfaces;
 * *turned: lanes whose ray changed. */
inline LightRay aim_turn(Scene scene, integer chosen, LightRay r, vec3 n, vec2 v, mask *turned)
{
    global const Settings *settings = scene.settings;
    integer at = settings->aims + AIM_WORDS * max_i(chosen, (integer)(0));
    vec3 center = gather3(scene.distributions, at), to = sub3(center, r.o);
    real radius = gather(scene.distributions, at + 3);
    *turned = (chosen >= 0) & (r.away | (dot3(to, n) > -radius));
    for (int k = 0; k < settings->aim_count; k++) {
        Aim a = aim_of(scene, k);
        *turned = *turned & (r.away | (chosen < k) | !aim_inside(sub3(a.center, r.o), a.radius));
    }
    mask turns = *turned & !r.away, moves = *turned & r.away, surface = dot3(n, n) > 0.5f;
    if (any(turns)) {
        r.d = sel3(turns, to_world(frame_of(normalize3(to)), uniform_cone(v, aim_cone(to, radius))), r.d);
        r.n = sel3(turns & !surface, r.d, r.n);
        r.power = spectrum_sel(turns & surface & (dot3(n, r.d) <= 0.0f), spectrum_of(0.0f), r.power);
    }
    if (any(moves)) { /* to a point of the sphere's disk, then back to the disk where light from infinity starts */
        vec2 q = concentric_disk(v);
        vec3 o = add3(center, to_world(frame_of(r.d), v3(q.x * radius, q.y * radius, (real)(0.0f))));
        vec3 middle = v3((real)(settings->center[0]), (real)(settings->center[1]), (real)(settings->center[2]));
        real depth = dot3(sub3(o, middle), r.d) + emission_radius(settings);
        r.o = sel3(moves, madd3(r.d, -depth, o), r.o);
    }
    return r;
}

/* Sets the power of a turned ray of a light at a point. intensity: along the ray [W sr^-1 nm^-1]; p: density of its
 * direction without aiming [1/sr]. */
inline LightRay aim_power(LightRay r, mask turned, Spectrum intensity, real p)
{
    mask shines = p > 0.0f;
    Spectrum power = spectrum_scale(intensity, 1.0f / sel(shines, p, (real)(1.0f)));
    r.power = spectrum_sel(turned, spectrum_sel(shines, power, spectrum_of(0.0f)), r.power);
    return r;
}

/* What aiming changes in the density of a ray along d: at a light the direction's [1/sr], n the normal on a shape;
 * from infinity the density of the origin across it [1/m^2]; 0 where nothing aims. start_case is generated. */
inline real light_start_pdf(Scene scene, integer row, LightRow l, vec3 n, vec3 d)
{
    LightView view = light_view(scene, row, l, v3(0.0f, 0.0f, 0.0f), v3(0.0f, 0.0f, 0.0f));
    return start_case(scene, l, view, n, d, light_view_direction(view, d));
}

/* The density of light paths along d with aiming over the density without it; 1 where p is 0, as nothing aims there.
 * chosen: the sphere of the ray, -1: none or unknown; o: origin, from infinity any point of the ray; n: normal of a
 * light on a shape, toward d. */
inline real light_gain(Scene scene, integer row, LightRow l, integer chosen, vec3 o, vec3 n, vec3 d, mask away)
{
    real p = light_start_pdf(scene, row, l, n, d), kept = 1.0f, aimed = 0.0f;
    mask outside = mask_of(1);
    n = sel3(l.shape >= 0, n, v3(0.0f, 0.0f, 0.0f));
    for (int k = 0; k < scene.settings->aim_count; k++) {
        Aim a = aim_of(scene, k);
        vec3 to = sub3(a.center, o);
        real along = dot3(to, d), r2 = a.radius * a.radius;
        vec3 across = madd3(d, -along, to);
        outside = outside & !aim_inside(to, a.radius);
        mask serves = away | (outside & (dot3(to, n) > -a.radius));
        mask meets = (dot3(across, across) <= r2) & (away | (along > 0.0f));
        meets = meets | (chosen == k); /* whatever rounding says */
        real density = a.share / sel(away, PI * r2, 2.0f * PI * aim_cone(to, a.radius));
        kept -= sel(serves, a.share, (real)(0.0f));
        aimed += sel(serves & meets, density, (real)(0.0f));
    }
    return sel(p > 0.0f, kept + aimed / max_r(p, (real)(1e-30f)), (real)(1.0f));
}

/* light_emit_pdf times the gain of aiming, for light that travels along -wi to p; n: the normal at the light. */
inline real light_path_pdf(Scene scene, integer row, vec3 p, vec3 wi, real t, vec3 n)
{
    mask away = t >= FAR;
    vec3 o = sel3(away, p, madd3(wi, t, p)), front = sel3(dot3(n, wi) > 0.0f, neg3(n), n);
    real gain = light_gain(scene, row, light_at(scene, row), (integer)(-1), o, front, neg3(wi), away);
    return light_emit_pdf(scene, row, wi, t) * gain;
}

/* Twin, where no light path aims. */
#define light_path_pdf(scene, row, p, wi, t, n) light_emit_pdf(scene, row, wi, t)
inline integer aim_choose(Scene scene, real *x) { return (integer)(-1); }

/* Step ray: a ray `r` of light_emit aims at the sphere `chosen`, and carries light over the density of all techniques.
 * lamp_aimed is generated: aim_power of the kinds at a point. */
inline LightRay aim_ray(Scene scene, integer row, LightRow l, LightView view, integer chosen, vec2 v,
                        Wavelengths lambdas, LightRay r)
{
    mask turned;
    vec3 n = sel3(l.shape >= 0, r.n, v3(0.0f, 0.0f, 0.0f));
    chosen = sel_i(light_mode(l, EMISSION_ALONG), (integer)(-1), chosen);
    r = aim_turn(scene, chosen, r, n, v, &turned);
    r = lamp_aimed(scene, l, light_view_direction(view, r.d), turned, lambdas, r);
    r.gain = light_gain(scene, row, l, chosen, r.o, n, r.d, r.away);
    r.power = spectrum_scale(r.power, 1.0f / r.gain);
    return r;
}

/* Twin, where no light path aims. */
inline LightRay aim_ray(Scene scene, integer row, LightRow l, LightView view, integer chosen, vec2 v,
                        Wavelengths lambdas, LightRay r) { return r; }
