/* Stores a shadow ray for the lanes that `shine`, and none for other active lanes. It runs from off the surface to the
 * light's point: along ls.wi it would miss that. On a GPU all active lanes store: a condition would cost registers. */
inline void shadow_toward(Slab shadow, uint at, mask active, mask shine, Surface s, LightSample ls, Spectrum value)
{
    vec3 from = surface_offset(s, ls.wi), to = sub3(madd3(ls.wi, ls.t, s.p), from);
    real t = sqrt(dot3(to, to));
    mask near = ls.t < FAR, kept = LANES == 1 ? active : shine;
    store_shadow_o(shadow, at, kept, from);
    store_shadow_d(shadow, at, kept, sel3(near, scale3(to, 1.0f / t), ls.wi));
    store_shadow_t(shadow, at, active, sel(shine, sel(near, t, ls.t) * SHADOW_SHORTER, (real)(-1.0f)));
    store_shadow_value(shadow, at, kept, value);
}
