/* The disk where camera paths and photons are merged. A pass is a sample of every pixel, with the light paths beside
 * it; its radius shrinks from pass to pass, so that the picture converges (Hachisuka and Jensen 2009). */
#define PATH_BEGUN (PATH_ALIVE | PATH_SHARP) /* initial state of a camera path */

/* The pass of a light path. A camera path's pass is the number of its sample. */
inline integer merging_pass(Scene scene, integer light_path)
{
    return divide(light_path, (int)scene.settings->light_paths);
}

/* The radius in a pass [m]: the first radius over the eighth root of the pass's number from 1, so that the squared
 * radius falls as the pass to the power of alpha - 1 with alpha = 3/4 (Georgiev 2012). */
inline real merging_radius(Scene scene, integer pass)
{
    return scene.settings->radius / sqrt(sqrt(sqrt(to_real(pass + 1))));
}

/* The disk's area times the number of light paths whose photons may be merged with a camera path [m^2]. */
inline real merging_area(Scene scene, integer pass)
{
    return PI * scene.settings->photon_paths * sqr(merging_radius(scene, pass));
}

/* Whether a camera path is merged at a vertex: all its vertices before must be specular. With light paths that are
 * connected to the camera, its first vertex is left to them. */
inline mask merging_here(integer state, integer depth)
{
    mask sharp = (state & PATH_SHARP) != 0;
#if JOINS_CAMERA
    sharp = sharp & (depth > 0);
#endif
    return sharp;
}

/* The group of a path: only paths with equal wavelengths are merged. Each pass has several groups; a path's own u
 * selects a group. */
inline integer merging_group(Scene scene, real u)
{
    int groups = scene.settings->wavelength_groups;
    return min_i(to_integer(u * (float)groups), (integer)(groups - 1));
}

/* The group of a path by its sampler. */
#if SPECTRUM_SIZE == 4
#define merging_group_of(scene, sampler) \
    merging_group(scene, sampler_pair(sampler, (natural)(DIMENSION_WAVELENGTH)).x)
#else
#define merging_group_of(scene, sampler) ((integer)(0))
#endif

/* Replaces the random number `own` of the time: all paths of a pass and a group have the same time, so that camera
 * paths find photons where they were stored. From pass to pass it advances by the golden ratio. */
inline real merging_moment(Scene scene, real u, real own, integer pass)
{
    float groups = (float)scene.settings->wavelength_groups;
    natural begin = hash_natural((natural)(scene.settings->seed ^ 0x2545f491u));
    real moment = unit_interval(as_natural(pass) * 0x9e3779b9u + begin) + to_real(merging_group(scene, u)) / groups;
    return moment - floor(moment);
}

/* Replaces the random number u of the wavelengths: equal for all paths of a group. From pass to pass it is van der
 * Corput's sequence over the group's part of the unit interval, with an offset by the seed. */
inline real merging_wavelength(Scene scene, real u, integer pass)
{
    natural bits = reverse_bits(as_natural(pass));
    real inside = unit_interval(bits + hash_natural((natural)(scene.settings->seed)));
    return (to_real(merging_group(scene, u)) + inside) / (float)scene.settings->wavelength_groups;
}

/* Twin, without photon merging: each path has a time and wavelengths of its own. */
#define PATH_BEGUN PATH_ALIVE /* initial state of a camera path */
inline real merging_moment(Scene scene, real u, real own, integer pass) { return own; }
inline real merging_wavelength(Scene scene, real u, integer pass) { return u; }
inline integer merging_pass(Scene scene, integer light_path) { return light_path; }
