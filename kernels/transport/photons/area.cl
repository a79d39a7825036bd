/* The disk in which paths from the camera and photons are merged. A pass is a sample of every pixel, with the light
 * paths beside it; its radius shrinks from pass to pass, so that the picture converges (Hachisuka and Jensen 2009). */
#define PATH_BEGUN (PATH_ALIVE | PATH_SHARP) /* the state in which a path begins at the camera */

/* The pass of a light path. That of a sample of the camera has the sample's number. */
inline integer merging_pass(Scene scene, integer light_path)
{
    return divide(light_path, (int)scene.settings->light_paths);
}

/* The radius in a pass [m]: the first one over the eighth root of the pass's number from 1, so that radius squared
 * falls as the pass to the power of alpha - 1, alpha being 3/4 (Georgiev 2012). */
inline real merging_radius(Scene scene, integer pass)
{
    return scene.settings->radius / sqrt(sqrt(sqrt(to_real(pass + 1))));
}

/* The disk's area times the number of photons' paths that may meet a path from the camera there [m^2]. */
inline real merging_area(Scene scene, integer pass)
{
    return PI * scene.settings->photon_paths * sqr(merging_radius(scene, pass));
}

/* Whether a path from the camera in such a state is merged: where all its surfaces so far were sharp. Where light paths
 * are joined to the camera, what it sees by itself is left to them. */
inline mask merging_here(integer state, integer depth)
{
    mask sharp = (state & PATH_SHARP) != 0;
#if JOINS_CAMERA
    sharp = sharp & (depth > 0);
#endif
    return sharp;
}

/* Paths are merged that have the same wavelengths: each pass has some groups of them, a path's own u chooses one. */
inline integer merging_group(Scene scene, real u)
{
    int groups = scene.settings->wavelength_groups;
    return min_i(to_integer(u * (float)groups), (integer)(groups - 1));
}

/* That of a path by its sampler. */
#if SPECTRUM_SIZE == 4
#define merging_group_of(scene, sampler) \
    merging_group(scene, sampler_pair(sampler, (natural)(DIMENSION_WAVELENGTH)).x)
#else
#define merging_group_of(scene, sampler) ((integer)(0))
#endif

/* What stands for `own`, a random number, where the time is drawn: all paths of a pass and a group are at one time, so
 * that photons are met where and as they were left. From pass to pass it goes in steps of the golden ratio. */
inline real merging_moment(Scene scene, real u, real own, integer pass)
{
    float groups = (float)scene.settings->wavelength_groups;
    natural begin = hash_natural((natural)(scene.settings->seed ^ 0x2545f491u));
    real moment = unit_interval(as_natural(pass) * 0x9e3779b9u + begin) + to_real(merging_group(scene, u)) / groups;
    return moment - floor(moment);
}

/* What stands for u where wavelengths are drawn: the same for all of a group. From pass to pass it goes through the
 * group's part of the unit interval as van der Corput's sequence, whose beginning the seed chooses. */
inline real merging_wavelength(Scene scene, real u, integer pass)
{
    natural bits = reverse_bits(as_natural(pass));
    real inside = unit_interval(bits + hash_natural((natural)(scene.settings->seed)));
    return (to_real(merging_group(scene, u)) + inside) / (float)scene.settings->wavelength_groups;
}

/* Twin, where no photons are merged: each path has a time and wavelengths of its own. */
#define PATH_BEGUN PATH_ALIVE /* the state in which a path begins at the camera */
inline real merging_moment(Scene scene, real u, real own, integer pass) { return own; }
inline real merging_wavelength(Scene scene, real u, integer pass) { return u; }
inline integer merging_pass(Scene scene, integer light_path) { return light_path; }
