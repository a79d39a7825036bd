/* Rays to lights, and what weighing a light that was met needs to know of the path. */

/* Puts a shadow ray into its slab, for the lanes that `shine`; the other active ones have none. It goes
 * from off the surface to the point of the light sample: along ls.wi it would end beside it. */
inline void shadow_toward(Slab shadow, uint at, mask active, mask shine, Surface s, LightSample ls, Spectrum value)
{
    vec3 from = surface_offset(s, ls.wi), to = sub3(madd3(ls.wi, ls.t, s.p), from);
    real t = sqrt(dot3(to, to));
    mask near = ls.t < FAR;
    store_shadow_o(shadow, at, shine, from);
    store_shadow_d(shadow, at, shine, sel3(near, scale3(to, 1.0f / t), ls.wi));
    store_shadow_t(shadow, at, active, sel(shine, sel(near, t, ls.t) * SHADOW_SHORTER, (real)(-1.0f)));
    store_shadow_value(shadow, at, shine, value);
}

/* Where lights are chosen by it, the hemisphere to which the surface sends light where the ray was chosen. */
#if USES_HEMISPHERE
#define path_hemisphere(path, at) load_path_sampled_hemisphere(path, at)
#else
#define path_hemisphere(path, at) v3(0.0f, 0.0f, 0.0f)
#endif

/* To weigh a light that a ray has met, the pdf of the ray's direction counts, and the point where it was chosen: that
 * lies `null_distance` [m] before the ray's origin if the path has crossed null boundaries since. */
#if USES_NULL_SURFACES
#define path_null_distance(path, at) load_path_null_distance(path, at)
#define path_scattered(path, at, m) store_path_null_distance(path, at, m, (real)(0.0f))
#else
#define path_null_distance(path, at) ((real)(0.0f))
#define path_scattered(path, at, m)
#endif
