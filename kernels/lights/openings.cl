/* Openings of a room: rectangles through which the light of infinite lights comes in, see
 * clpt/render/lights/openings.py. Next-event estimation sends a share of its samples of infinite lights to points of
 * the openings, and the others by the light's own density: a mixture of both densities, so that no light is lost where
 * an opening was overlooked. */

/* Step. */
#define OPENING_GRAZING 0.05f /* the least cosine at an opening, for the choice of one */
#define OPENING_LOW 0.02f     /* likewise at the receiver */

inline Opening opening_at(Scene scene, integer number)
{
    return opening_row(scene.light_params, scene.settings->openings + number * OPENING_WORDS);
}

/* The chance of an opening as seen from p, unnormalized: about its solid angle times the cosine at the receiver. */
inline real opening_weight(Opening o, vec3 p, vec3 hemisphere)
{
    vec3 to = sub3(o.center, p);
    real d2 = dot3(to, to) + 0.25f * o.area, d = sqrt(d2);
    real solid = o.area * (fabs(dot3(o.n, to)) + OPENING_GRAZING * d) / (d2 * d);
    real cosine = max_r((dot3(hemisphere, to) + o.reach) / (d + o.reach), (real)(OPENING_LOW));
    return solid * sel(hemisphere_given(hemisphere), cosine, (real)(1.0f));
}

/* The density of a direction d to a point of the openings [1/sr]. */
inline real openings_pdf(Scene scene, vec3 p, vec3 hemisphere, vec3 d)
{
    real sum = 0.0f, through = 0.0f;
    for (int i = 0; i < scene.settings->opening_count; i++) {
        Opening o = opening_at(scene, (integer)(i));
        real weight = opening_weight(o, p, hemisphere), along = dot3(o.n, d);
        real t = dot3(o.n, sub3(o.center, p)) / sel(along == 0.0f, (real)(1e-20f), along);
        vec3 q = sub3(madd3(d, t, p), o.center);
        mask met = (t > 0.0f) & (fabs(dot3(q, o.x)) <= 1.0f) & (fabs(dot3(q, o.y)) <= 1.0f);
        through += sel(met, weight * solid_angle_pdf(1.0f / o.area, t, fabs(along)), (real)(0.0f));
        sum += weight;
    }
    return through / max_r(sum, (real)(1e-30f));
}

/* A direction to a point of the openings. u: uniform in the unit square. */
inline vec3 openings_direction(Scene scene, vec3 p, vec3 hemisphere, vec2 u)
{
    int count = scene.settings->opening_count;
    real sum = 0.0f, before = 0.0f, left = 0.0f;
    integer chosen = 0;
    for (int i = 0; i < count; i++) sum += opening_weight(opening_at(scene, (integer)(i)), p, hemisphere);
    for (int i = 0; i < count; i++) {
        real weight = opening_weight(opening_at(scene, (integer)(i)), p, hemisphere), over = u.x * sum - before;
        mask here = over >= 0.0f;
        chosen = sel_i(here, (integer)(i), chosen);
        left = sel(here, over / max_r(weight, (real)(1e-30f)), left);
        before += weight;
    }
    Opening o = opening_at(scene, chosen);
    real a = (2.0f * min_r(left, (real)(1.0f)) - 1.0f) / dot3(o.x, o.x), b = (2.0f * u.y - 1.0f) / dot3(o.y, o.y);
    return normalize3(add3(sub3(o.center, p), madd3(o.x, a, scale3(o.y, b))));
}

/* The density of next-event estimation for a light, whose own density is pdf [1/sr]. */
inline real with_openings(Scene scene, LightRow l, vec3 p, vec3 hemisphere, vec3 d, real pdf)
{
    mask infinite = light_is_infinite(l);
    if (!any(infinite)) return pdf;
    float share = scene.settings->opening_share;
    return sel(infinite, (1.0f - share) * pdf + share * openings_pdf(scene, p, hemisphere, d), pdf);
}

/* A sample of a light off all shapes, of an infinite light by both techniques. u: uniform in the unit square. */
inline LightSample lamp_in_room(Scene scene, LightRow l, LightView view, vec3 p, vec3 hemisphere, vec2 u,
                                Wavelengths lambdas)
{
    float share = scene.settings->opening_share;
    mask infinite = light_is_infinite(l), through = infinite & (u.x < share);
    real left = sel(through, u.x / share, (u.x - share) / (1.0f - share));
    u.x = sel(infinite, clamp_r(left, (real)(0.0f), (real)(0.99999994f)), u.x);
    LightSample s = light_moved(view, lamp_sample(scene, l, view, u, lambdas));
    if (any(through)) {
        vec3 d = openings_direction(scene, p, hemisphere, u);
        Spectrum radiance;
        real pdf;
        l.params = sel_i(through, l.params, (integer)(0)); /* other lights' parameters are no sky's */
        infinite_case(scene, l, view.hemisphere, light_view_direction(view, d), lambdas, &radiance, &pdf);
        s.wi = sel3(through, d, s.wi);
        s.t = sel(through, (real)(FAR), s.t);
        s.radiance = spectrum_sel(through, radiance, s.radiance);
        s.pdf = sel(through, pdf, s.pdf);
    }
    s.pdf = with_openings(scene, l, p, hemisphere, s.wi, s.pdf);
    return s;
}

/* Twin, where no openings are known. */
#define with_openings(scene, l, p, hemisphere, d, pdf) (pdf)
#define lamp_in_room(scene, l, v, p, hemisphere, u, lambdas) light_moved(v, lamp_sample(scene, l, v, u, lambdas))
