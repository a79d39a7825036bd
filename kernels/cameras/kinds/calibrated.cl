/* Directions that a model of distortion gives the corners of pixels, bilinear between them. A pixel with a corner of
 * direction 0 is not seen. What lies beyond the film's edges goes on as the last pixel does. */
typedef struct {
    vec3 w, u, v; /* the direction, not of unit length, and what it gains per pixel to the right and down */
    mask seen;
} CalibratedPixel;

/* x, y: a place on the film [pixels]. */
inline CalibratedPixel calibrated_pixel(global const CalibratedCamera *camera, real x, real y)
{
    integer column = clamp_i(to_integer(x), (integer)(camera->columns - 1));
    integer row = clamp_i(to_integer(y), (integer)(camera->rows - 1));
    integer below = 3 * (camera->columns + 1), word = camera->directions + row * below + 3 * column;
    global const float *words = (global const float *)camera;
    vec3 a = gather3(words, word), b = gather3(words, word + 3);
    vec3 c = gather3(words, word + below), d = gather3(words, word + below + 3);
    real u = x - to_real(column), v = y - to_real(row);
    vec3 upper = madd3(b, u, scale3(a, 1.0f - u)), lower = madd3(d, u, scale3(c, 1.0f - u));
    CalibratedPixel p;
    p.seen = min_r(min_r(dot3(a, a), dot3(b, b)), min_r(dot3(c, c), dot3(d, d))) > 0.0f;
    p.w = madd3(lower, v, scale3(upper, 1.0f - v));
    p.u = madd3(sub3(d, c), v, scale3(sub3(b, a), 1.0f - v));
    p.v = sub3(lower, upper);
    return p;
}

/* Brown's distortion of a place on a pinhole's plane, rational and with thin prisms, as OpenCV has it. */
inline vec2 calibrated_distorted(global const float *k, real x, real y)
{
    real r2 = x * x + y * y, both = 2.0f * x * y;
    real above = 1.0f + r2 * (k[0] + r2 * (k[1] + r2 * k[4])), under = 1.0f + r2 * (k[5] + r2 * (k[6] + r2 * k[7]));
    real radial = above / under;
    return (vec2){x * radial + k[2] * both + k[3] * (r2 + 2.0f * x * x) + r2 * (k[8] + k[9] * r2),
                  y * radial + k[3] * both + k[2] * (r2 + 2.0f * y * y) + r2 * (k[10] + k[11] * r2)};
}

/* Where the model sees a unit direction of camera space [pixels of the film], as clpt/lenses/projections.py has it;
 * clears `seen` where it is beyond the widest angle. */
inline vec2 calibrated_film(global const CalibratedCamera *camera, vec3 d, mask *seen)
{
    global const float *k = (global const float *)camera + camera->coefficients;
    real x = -d.x, y = -d.y, square = x * x + y * y, across = max_r(sqrt(square), (real)(1e-9f)), scale;
    vec2 plane;
    *seen = *seen & (d.z >= camera->widest);
    if (camera->form == 0) {
        real z = max_r(d.z, (real)(1e-6f));
        plane = calibrated_distorted(k, x / z, y / z);
    } else {
        if (camera->form == 1) {
            real theta = atan2(across, d.z), t = theta * theta;
            scale = theta * (1.0f + t * (k[0] + t * (k[1] + t * (k[2] + t * k[3])))) / across;
        } else if (camera->form == 2) {
            scale = k[1] * atan2(k[0] * across, d.z) / across;
        } else {
            real z = d.z + k[0], below = k[1] * sqrt(k[2] * square + z * z) + (1.0f - k[1]) * z;
            scale = 1.0f / max_r(below, (real)(1e-6f));
        }
        plane.x = x * scale;
        plane.y = y * scale;
    }
    return (vec2){plane.x * camera->focal[0] + camera->middle[0], plane.y * camera->focal[1] + camera->middle[1]};
}

/* A step of Newton's method leads from the bilinear direction to that which the model sees in this place. */
CameraRay calibrated_ray(Scene scene, global const CalibratedCamera *camera, vec2 film, vec2 lens, Wavelengths lambdas,
                         Spectrum *weight)
{
    real x = film.x * (float)camera->columns, y = film.y * (float)camera->rows, zero = 0.0f;
    CalibratedPixel p = calibrated_pixel(camera, x, y);
    vec3 w = sel3(p.seen, p.w, v3(zero, zero, zero + 1.0f));
    mask within = p.seen;
    vec2 there = calibrated_film(camera, normalize3(w), &within);
    real right = x - there.x, down = y - there.y;
    within = within & (max_r(fabs(right), fabs(down)) < 0.5f); /* not where the picture folds */
    w = sel3(within, madd3(p.u, right, madd3(p.v, down, w)), w);
    CameraRay ray;
    ray.d = normalize3(matrix_vector(camera->to_world, w.x, w.y, w.z));
    ray.o = matrix_point(camera->to_world, zero, zero, zero);
    ray.far = sel(p.seen, (real)(FAR), (real)(1e-30f)); /* an unseen ray meets nothing */
    *weight = spectrum_sel(p.seen, spectrum_of(1.0f), spectrum_of(0.0f));
    return ray;
}

/* Step connect: a point as the camera sees it: see film/connect.cl. */

/* How the film's place changes by a step from a direction [pixels]. */
inline vec2 calibrated_change(global const CalibratedCamera *camera, vec3 d, vec3 step)
{
    mask any_way = mask_of(1);
    vec2 after = calibrated_film(camera, normalize3(madd3(step, (real)(0.25f), d)), &any_way);
    vec2 before = calibrated_film(camera, normalize3(madd3(step, (real)(-0.25f), d)), &any_way);
    return (vec2){2.0f * (after.x - before.x), 2.0f * (after.y - before.y)};
}

/* Steps u and v of about a pixel, right and down, have the solid angle |u x v . d|; the model says where they lead. */
CameraPoint calibrated_connect(global const CalibratedCamera *camera, global const Settings *settings, vec3 p,
                               mask away, vec2 lens)
{
    global const float *m = camera->to_world;
    vec3 o = v3((real)(m[3]), (real)(m[7]), (real)(m[11])), to = sel3(away, p, sub3(p, o));
    real t = sqrt(max_r(dot3(to, to), (real)(1e-30f)));
    CameraPoint c;
    c.seen = t > 1e-12f;
    c.o = o;
    c.d = scale3(to, 1.0f / t);
    c.t = sel(away, (real)(FAR), t);
    vec3 d = screen_back(m, c.d);
    vec2 film = calibrated_film(camera, d, &c.seen);
    CalibratedPixel at = calibrated_pixel(camera, film.x, film.y);
    c.seen = c.seen & at.seen;
    vec2 u = calibrated_change(camera, d, at.u), v = calibrated_change(camera, d, at.v);
    real angle = fabs(dot3(d, cross3(at.u, at.v))) / max_r(fabs(u.x * v.y - u.y * v.x), (real)(1e-30f));
    c.film.x = film.x - (float)settings->crop_x;
    c.film.y = film.y - (float)settings->crop_y;
    angle *= (float)settings->width * (float)settings->height;
    c.importance = 1.0f / (max_r(angle, (real)(1e-30f)) * sel(away, (real)(1.0f), t * t));
    return c;
}

/* Step screen: where the model sees a point. */
vec2 calibrated_screen(global const CalibratedCamera *camera, vec3 p, mask away, mask *seen)
{
    vec3 d = normalize3(sel3(away, screen_back(camera->to_world, p), screen_point_back(camera->to_world, p)));
    vec2 film = calibrated_film(camera, d, seen);
    return (vec2){film.x / (float)camera->columns, film.y / (float)camera->rows};
}
