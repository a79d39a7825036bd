/* The ray from the camera to a point of the scene, for integrators that start at lights:
 *
 *   CameraPoint <kind>_connect(global const <Kind>Camera *camera, global const Settings *settings, vec3 p, mask away,
 *                              vec2 lens);
 *
 * p: the point, or where `away` the unit direction to a point at infinity; lens: a point of the unit
 * square. A sample of a pixel is the mean of radiance L over the pixel's share of the film; for light
 * that comes from area dA at distance t, under the angle theta to the camera's axis, that is the
 * integral of L importance |cos| dA over the number of pixels: importance = 1 / (film t^2 cos^3 theta), as
 * dA |cos| / t^2 is a solid angle, 1 / cos^3 turns it into an area of the plane at distance 1, and
 * `film` is what the picture covers there (Pharr et al. 2023, 5.4 on We; for a point at infinity t = 1).
 */
#include "core/warp.cl"
#include "film/film.cl"
#include "film/spread.cl"

typedef struct {
    vec3 o;         /* where the camera's ray begins, on the near plane [m] */
    vec3 d;         /* from there to the point, unit length */
    real t;         /* distance to it [m]; FAR at infinity */
    vec2 film;      /* where it is seen, from the corner of the picture [pixels] */
    integer pixel;  /* where the film stores the pixel that gets it; -1: none does, or it is not in view */
    real importance; /* see above [1/m^2] */
} CameraPoint;

inline CameraPoint camera_nowhere(void)
{
    CameraPoint c;
    c.o = v3(0.0f, 0.0f, 0.0f);
    c.d = v3(0.0f, 0.0f, 1.0f);
    c.t = FAR;
    c.film.x = c.film.y = 0.0f;
    c.pixel = -1;
    c.importance = 0.0f;
    return c;
}

/* A pinhole, or a lens on which the light arrives at (a, b): the plane at distance `focus` is sharp. The
 * matrix is rigid, so its transpose leads back to the camera's space. */
inline CameraPoint pinhole_connect(global const Settings *settings, global const float *m, global const float *extent,
                                   global const float *offset, float near, float far, float focus, vec2 lens, vec3 p,
                                   mask away)
{
    vec3 to = sel3(away, p, sub3(p, v3((real)(m[3]), (real)(m[7]), (real)(m[11]))));
    vec3 d = v3(m[0] * to.x + m[4] * to.y + m[8] * to.z, m[1] * to.x + m[5] * to.y + m[9] * to.z,
                m[2] * to.x + m[6] * to.y + m[10] * to.z);
    mask seen = (d.z > 1e-6f) & (away | ((d.z > near) & (d.z <= far)));
    d.x -= sel(away, (real)(0.0f), lens.x);
    d.y -= sel(away, (real)(0.0f), lens.y);
    real z = sel(seen, d.z, (real)(1.0f)), length = sqrt(dot3(d, d)), start = near / z;
    real x = 0.5f - offset[0] - (lens.x / focus + d.x / z) / extent[0];
    real y = 0.5f - offset[1] - (lens.y / focus + d.y / z) / extent[1];
    CameraPoint c;
    c.o = matrix_point(m, lens.x + d.x * start, lens.y + d.y * start, (real)(near));
    c.d = normalize3(matrix_vector(m, d.x, d.y, d.z));
    c.t = sel(away, (real)(FAR), length * (1.0f - start));
    c.film.x = x * (float)settings->film_width - (float)settings->crop_x;
    c.film.y = y * (float)settings->film_height - (float)settings->crop_y;
    c.pixel = sel_i(seen, (integer)(0), (integer)(-1));
    float cropped = ((float)settings->film_width * (float)settings->film_height) /
                    ((float)settings->width * (float)settings->height);
    c.importance = length * cropped / (z * z * z * (extent[0] * extent[1]));
    return c;
}

/* The pixel that gets a point in view, chosen by the pixel filter with the number u. */
inline CameraPoint camera_pixel(Scene scene, CameraPoint c, real u)
{
    global const Settings *settings = scene.settings;
    mask seen = (c.pixel >= 0) & (fabs(c.film.x) < 1e6f) & (fabs(c.film.y) < 1e6f);
    integer x = spread_axis(scene, sel(seen, c.film.x, (real)(0.0f)), &u, &c.importance);
    integer y = spread_axis(scene, sel(seen, c.film.y, (real)(0.0f)), &u, &c.importance);
    seen = seen & (x >= 0) & (x < settings->width) & (y >= 0) & (y < settings->height);
    c.pixel = sel_i(seen, film_pixel_index(settings, x, y), (integer)(-1));
    return c;
}
