/* Rays to lights. */

/* Puts a shadow ray into its slab, for the lanes that `shine`; the other active ones have none. It goes from off the
 * surface to the point of the light sample: along ls.wi it would end beside it. On a GPU all active ones store: what
 * hangs on a condition is computed behind it, and registers keep what that needs. */
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
