/* What a path from a light needs besides a path from the camera. */

#include "transport/light_path_sampler.cl"

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
