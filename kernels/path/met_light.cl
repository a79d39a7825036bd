/* What a path from the camera tells of a light that it meets. */

/* Where lights are chosen by it, the hemisphere to which the surface sends light where the ray was chosen. */
#if USES_HEMISPHERE
#define path_hemisphere(path, at) load_path_sampled_hemisphere(path, at)
#define path_hemisphere_keep(path, at, m, hemisphere) store_path_sampled_hemisphere(path, at, m, hemisphere)
#else
#define path_hemisphere(path, at) v3(0.0f, 0.0f, 0.0f)
#define path_hemisphere_keep(path, at, m, hemisphere) ((void)0)
#endif

/* What light paths do, over the path's own density (lighting/rivals.cl): nothing where the camera or its first surface
 * sees the light, which is left to paths from the camera. */
#define path_rival(path, at, depth) sel((depth) > 1, load_path_rival(path, at), (real)(0.0f))
