/* What a path from a light needs besides a path from the camera. */

#define LIGHT_PATH_SEED 0x5bd1e995u /* keeps their numbers apart from those of paths from the camera */

/* The random numbers of a path from a light. Its "pixel" only counts paths: those of one sample number are the points
 * of one sequence, so that they spread evenly over the lights. */
inline Sampler light_path_sampler(global const Settings *settings, integer pixel_index, integer sample)
{
    return sampler_start(settings->seed ^ LIGHT_PATH_SEED, as_natural(sample), as_natural(pixel_index));
}

/* Puts a ray between the camera and a point of a surface, or of infinity, into the shadow slab. */
inline void connect_camera(Slab shadow, uint at, mask active, mask shine, Surface s, CameraPoint c, Spectrum value)
{
    LightSample ls;
    ls.wi = neg3(c.d);
    ls.t = c.t;
    shadow_toward(shadow, at, active, shine, s, ls, value);
    mask away = shine & (c.t >= FAR);
    if (any(away)) {
        store_shadow_o(shadow, at, away, c.o);
        store_shadow_d(shadow, at, away, c.d);
    }
    store_shadow_film(shadow, at, shine, c.film);
}
