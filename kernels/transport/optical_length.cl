/* The optical length of paths from the camera: lengths of rays, each times the index of what the ray is in, over the
 * index at the camera, Path.eta until the vertex stores the next one. Where glass disperses it is the index of groups,
 * n (1 - s) with the slope s = d ln n / d ln lambda: pulses are so much slower. */

/* Step. */

/* Begins at the camera's lens; far: length of the ray's range, which begins at the near plane. */
inline void length_begin(Scene scene, Slab path, uint at, mask go, real far)
{
    real slope = scene.settings->camera_slope;
    store_path_slope(path, at, go, slope);
    store_path_length(path, at, go, (1.0f - slope) * far * scene.settings->near_share);
}

/* The length at a distance t along the ray. */
inline real length_after(Slab path, uint at, real t)
{
    return load_path_length(path, at) + load_path_eta(path, at) * (1.0f - load_path_slope(path, at)) * t;
}

/* Ends the ray at a distance t. */
inline void length_add(Slab path, uint at, mask m, real t)
{
    store_path_length(path, at, m, length_after(path, at, t));
}

/* Keeps the length to a light at a distance t from a vertex, beyond an incident ray of length `ray`; index: of the
 * light's side, over that of the ray. */
inline void length_to_light(Slab path, Slab shadow, uint at, mask m, real ray, real t, real index)
{
    store_shadow_length(shadow, at, m, length_after(path, at, ray + index * t));
}

inline real length_of_shadow(Slab shadow, uint at) { return load_shadow_length(shadow, at); }

/* Twin, where a film does not part light by time. */
inline void length_begin(Scene scene, Slab path, uint at, mask go, real far) {}
inline real length_after(Slab path, uint at, real t) { return 0.0f; }
inline void length_add(Slab path, uint at, mask m, real t) {}
inline void length_to_light(Slab path, Slab shadow, uint at, mask m, real ray, real t, real index) {}
inline real length_of_shadow(Slab shadow, uint at) { return 0.0f; }

/* Step crossing: the index of the side of wi over that of wo, at materials that refract into many directions. */
inline real index_across(Bsdf m, vec3 wo, vec3 wi)
{
    real index = bsdf_across(m);
    return sel(wo.z * wi.z < 0.0f, sel(wo.z > 0.0f, index, 1.0f / index), (real)(1.0f));
}

/* Twin, at other materials, and where a film does not part light by time. */
inline real index_across(Bsdf m, vec3 wo, vec3 wi) { return 1.0f; }

/* Step slopes: by how much the slope of the side of wi exceeds that of wo, at materials that refract. */
inline real slope_across(Scene scene, integer row, Wavelengths lambdas, vec3 wo, vec3 wi)
{
    integer word = gather_i(scene.materials, max_i(row - scene.settings->slope_before, (integer)(0)));
    real slope = spectra_row(scene, max_i(word - 1, (integer)(0)), lambdas).x;
    return sel((word > 0) & (wo.z * wi.z < 0.0f), sel(wo.z > 0.0f, slope, -slope), (real)(0.0f));
}

/* Twin, at other materials. */
inline real slope_across(Scene scene, integer row, Wavelengths lambdas, vec3 wo, vec3 wi) { return 0.0f; }
