/* The contract of a camera kind: kernels/cameras/kinds/<kind>.cl has
 *
 *   CameraRay <kind>_ray(global const <Kind>Camera *camera, vec2 film, vec2 lens);
 *
 * and of a kind that can be of glass which disperses
 *
 *   CameraRay <kind>_glass_ray(global const <Kind>Camera *camera, vec2 film, vec2 lens, real index);
 *
 * A kind whose rays have weights has instead
 *
 *   CameraRay <kind>_ray(Scene scene, global const <Kind>Camera *camera, vec2 film, vec2 lens, Wavelengths lambdas,
 *                        Spectrum *weight);
 *
 * with directions for the hero's wavelength, if its glasses disperse. A ray that does not get to the scene has a weight
 * of 0 and ends at once.
 *
 * A kind that has an axis also has a step `screen` with
 *
 *   vec2 <kind>_screen(global const <Kind>Camera *camera, vec3 p, mask away, mask *seen);
 *
 * where on the film the point p is, or where `away` what is infinitely far along the unit vector p. `seen` becomes 0
 * where it is nowhere, as behind the camera; a lens counts as its middle. A kind that paths from lights are joined to
 * has a step `connect`, see film/connect.cl.
 *
 * film: position on the film, x and y in [0, 1], y down; lens: a point of the unit square;
 * index: of the glass at the hero's wavelength; the ray then holds for this wavelength alone.
 * The struct is a uniform Record in clpt/render/records/camera.py.
 */
typedef struct {
    vec3 o, d; /* [m]; unit length. The origin lies on the near plane. */
    real far;  /* distance from there to the far plane [m]; FAR: none */
} CameraRay;

/* Throughput as a path begins, and what spectra/hero.cl keeps of it. */
inline Spectrum camera_start(void)
{
    Spectrum r = spectrum_of(1.0f);
#if CAMERA_DISPERSES
    r = spectrum_of(0.0f);
    r.x = 4.0f;
#endif
    return r;
}

inline vec3 matrix_point(global const float *m, real x, real y, real z) /* row-major, affine */
{
    return v3(m[0] * x + m[1] * y + m[2] * z + m[3], m[4] * x + m[5] * y + m[6] * z + m[7],
              m[8] * x + m[9] * y + m[10] * z + m[11]);
}
inline vec3 matrix_vector(global const float *m, real x, real y, real z)
{
    return v3(m[0] * x + m[1] * y + m[2] * z, m[4] * x + m[5] * y + m[6] * z,
              m[8] * x + m[9] * y + m[10] * z);
}

/* A vector of the world in the camera's space: by the inverse of the first three columns of a matrix. */
inline vec3 screen_back(global const float *m, vec3 v)
{
    vec3 x = v3((real)(m[0]), (real)(m[4]), (real)(m[8])), y = v3((real)(m[1]), (real)(m[5]), (real)(m[9]));
    vec3 z = v3((real)(m[2]), (real)(m[6]), (real)(m[10])), yz = cross3(y, z);
    vec3 back = v3(dot3(yz, v), dot3(cross3(z, x), v), dot3(cross3(x, y), v));
    return scale3(back, 1.0f / dot3(x, yz));
}

inline vec3 screen_point_back(global const float *m, vec3 p)
{
    return screen_back(m, sub3(p, v3((real)(m[3]), (real)(m[7]), (real)(m[11]))));
}

/* Where a pinhole sees a point, for functions <kind>_screen. */
inline vec2 pinhole_screen(global const float *m, global const float *extent, global const float *offset, vec3 p,
                           mask away, mask *seen)
{
    vec3 d = sel3(away, screen_back(m, p), screen_point_back(m, p));
    *seen = *seen & (d.z > 1e-6f);
    real z = sel(d.z > 1e-6f, d.z, (real)(1.0f));
    return (vec2){0.5f - offset[0] - d.x / (z * extent[0]), 0.5f - offset[1] - d.y / (z * extent[1])};
}
