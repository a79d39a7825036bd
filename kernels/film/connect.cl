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

typedef struct {
    vec3 o;         /* where the camera's ray begins, on the near plane [m] */
    vec3 d;         /* from there to the point, unit length */
    real t;         /* distance to it [m]; FAR at infinity */
    vec2 film;      /* where it is seen, from the corner of the picture [pixels] */
    mask seen;      /* it is in view, and a filter of the picture's pixels may hold it */
    real importance; /* see above [1/m^2] */
} CameraPoint;

inline CameraPoint camera_nowhere(void)
{
    CameraPoint c;
    c.o = v3(0.0f, 0.0f, 0.0f);
    c.d = v3(0.0f, 0.0f, 1.0f);
    c.t = FAR;
    c.film.x = c.film.y = 0.0f;
    c.seen = mask_of(0);
    c.importance = 0.0f;
    return c;
}

/* A pinhole, or a lens, where the light arrives at (a, b): the plane at distance `focus` is sharp. The
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
    c.seen = seen;
    float cropped = ((float)settings->film_width * (float)settings->film_height) /
                    ((float)settings->width * (float)settings->height);
    c.importance = length * cropped / (z * z * z * (extent[0] * extent[1]));
    return c;
}

/* The point, which is not seen where no filter of the picture's pixels holds it. */
inline CameraPoint camera_near(Scene scene, CameraPoint c)
{
    float radius = scene.distributions[FILTER_PROFILE];
    float width = (float)scene.settings->width, height = (float)scene.settings->height;
    mask near_x = fabs(c.film.x - 0.5f * width) < 0.5f * width + radius;
    mask near_y = fabs(c.film.y - 0.5f * height) < 0.5f * height + radius;
    c.seen = c.seen & near_x & near_y;
    return c;
}
