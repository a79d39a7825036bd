/* Next-event estimation for all kinds of lights in a scene. clpt/render/lights/cases.py generates, for the kinds off
 * all shapes, `lamp_sample`, for lights on shapes `area_point`, a point as seen from a LightView with its texture
 * point, and `area_pdf` [1/sr], and for infinite lights `infinite_case`. */

/* Step. */
/* Samples a light and a direction to it. pick: chooses the light, u: the point. */
inline LightSample light_sample(Scene scene, vec3 p, Receiver receiver, real pick, vec2 u, Wavelengths lambdas)
{
    real pmf;
    integer row = light_choose(scene, p, receiver, FEW_LIGHTS ? &u.x : &pick, u.y, &pmf);
    LightRow l = light_at(scene, row);
    LightView view = light_view(scene, row, l, p, receiver.hemisphere);
    LightSample s = lamp_in_room(scene, l, view, p, receiver.hemisphere, u, lambdas);
    s = area_light_sample(scene, row, l, view, p, u, lambdas, s);
    return area_unseen(light_chosen(s, row, pmf), l);
}

/* The density of a direction wi to a light that a ray met at distance t, with the normal n there [1/sr]. */
inline real light_pdf(Scene scene, integer row, vec3 p, Receiver receiver, vec3 wi, real t, vec3 n)
{
    LightRow l = light_at(scene, row);
    LightView view = light_view_along(light_view(scene, row, l, p, receiver.hemisphere), wi, t, n);
    return area_pdf(scene, l, view) * light_pmf(scene, row, l, p, receiver);
}

/* Twin, in a scene without lights. */
inline LightSample light_sample(Scene scene, vec3 p, Receiver receiver, real pick, vec2 u, Wavelengths lambdas)
{
    return light_sample_nothing();
}

/* Step areas: sampling a light on a shape; `s`: the sample of any other light. */
inline LightSample area_light_sample(Scene scene, integer row, LightRow l, LightView view, vec3 p, vec2 u,
                                     Wavelengths lambdas, LightSample s)
{
    TexturePoint point = texture_point_nowhere();
    ShapeSample q = area_turned(area_moved(view, area_point(scene, row, l, view, u, &point)), l);
    point.p = madd3(q.wi, q.t, p);
    Spectrum radiance = emission_load(scene, l.radiance, area_lookup(l, point, neg3(q.wi)), lambdas);
    return light_sample_sel(l.shape >= 0, area_sample(q, point.p, radiance), s);
}

/* Twin, where no shape emits. */
inline LightSample area_light_sample(Scene scene, integer row, LightRow l, LightView view, vec3 p, vec2 u,
                                     Wavelengths lambdas, LightSample s) { return s; }
