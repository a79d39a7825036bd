/* A lens of surfaces, from the film to the scene (Kolb, Mitchell and Hanrahan 1995). The film lies at z = 0 of camera
 * space, upside down. A ray starts at a place of the film toward a point of the rear plane, which touches the last
 * surface; it goes through an ellipse of that plane, chosen by the place's ring, that holds all rays which get through.
 * Its weight is what it adds to the irradiance, cos^4 / back^2 [sr / m^2] times the ellipse's area, times `exposure`:
 * d omega cos = cos^3 / back^2 dA cos, exactly, as radiance stays the same along a ray. The generated text before this
 * has the struct LensSurface and, where light is lost, materials/film_stack.cl. */
/* A ray on its way; share: of its light that is left at each wavelength. */
typedef struct {
    vec3 o, d;
    Spectrum share;
    mask alive;
} LensRay;

/* Index at the hero's wavelength. */
inline real lens_index(Scene scene, real index, integer glass, Wavelengths lambdas)
{
#if CAMERA_DISPERSES
    mask varies = glass >= 0;
    if (any(varies)) index = sel(varies, spectra_row(scene, max_i(glass, (integer)(0)), lambdas).x, index);
#endif
    return index;
}

/* The sag and its derivative by r, over r; both are the vertex's where a conic has ended. w: r^2. */
inline real lens_sag(LensSurface s, real w, real *slope)
{
    real c = s.curvature, root = sqrt_r(1.0f - (1.0f + s.conic) * c * c * w);
    real inv = 1.0f / (s.radius * s.radius), u = w * inv;
    real sum = s.a0 + u * (s.a1 + u * (s.a2 + u * (s.a3 + u * (s.a4 + u * (s.a5 + u * (s.a6 + u * s.a7))))));
    real rise = 2.0f * s.a0 + u * (3.0f * s.a1 + u * (4.0f * s.a2 + u * (5.0f * s.a3 + u * (6.0f * s.a4 + u *
                (7.0f * s.a5 + u * (8.0f * s.a6 + u * 9.0f * s.a7))))));
    *slope = c / max_r(root, (real)(1e-6f)) + 2.0f * inv * u * rise;
    return c * w / (1.0f + root) + u * u * sum;
}

/* Moves a ray to a surface. n: its normal there, toward the film. Whether it is met within its rim. A sphere or a
 * conic in closed form from the vertex's plane (Welford 1986, 4.4), an asphere by Newton's method from there. */
inline mask lens_meet(LensSurface s, vec3 *o, vec3 d, vec3 *n)
{
    real down = sel(fabs(d.z) < 1e-6f, (real)(1e-6f), d.z), t = (s.z - o->z) / down;
    real x = o->x + d.x * t, y = o->y + d.y * t, c = s.curvature;
    real f = c * (x * x + y * y), g = down - c * (x * d.x + y * d.y);
    real inside = g * g - c * f * (1.0f + s.conic * d.z * d.z), root = sqrt_r(inside);
    real along = g + sel(down < 0.0f, -root, root);
    t = f / sel(fabs(along) < 1e-20f, (real)(1e-20f), along);
    mask met = inside >= 0.0f;
    vec3 p = v3(x + d.x * t, y + d.y * t, d.z * t);
    *n = v3(c * p.x, c * p.y, (1.0f + s.conic) * c * p.z - 1.0f);
    if (any(s.form != 0)) {
        mask aspheric = s.form == 2;
        real slope = 0.0f;
        if (any(aspheric)) {
            for (int i = 0; i < 4; ++i) {
                real sag = lens_sag(s, p.x * p.x + p.y * p.y, &slope);
                real fall = d.z - slope * (p.x * d.x + p.y * d.y);
                real step = (p.z - sag) / sel(fabs(fall) < 1e-6f, (real)(1e-6f), fall);
                p = madd3(d, sel(aspheric, -step, (real)(0.0f)), p);
            }
            real miss = fabs(p.z - lens_sag(s, p.x * p.x + p.y * p.y, &slope));
            met = met & (!aspheric | (miss < 1e-3f * s.radius));
            *n = sel3(aspheric, v3(p.x * slope, p.y * slope, (real)(-1.0f)), *n);
        }
        *n = sel3(s.form != 0, normalize3(*n), *n);
    }
    p.z += s.z;
    *o = p;
    return met & (p.x * p.x + p.y * p.y <= s.radius * s.radius);
}

/* Whether the diaphragm lets a ray through; what is no stop does. Its blades are a regular polygon. */
inline mask lens_passes(Scene scene, global const LensCamera *camera, LensSurface s, vec3 o)
{
    mask passes = mask_of(1);
    for (int i = 0; i < camera->blades; ++i) {
        global const float *normal = scene.camera + camera->blade_normals + 2 * i;
        passes = passes & (o.x * normal[0] + o.y * normal[1] <= camera->blade_distance * s.radius);
    }
    return passes | (s.stop == 0);
}

#if LENS_LOSSES || LENS_GHOSTS
/* Of the wavelengths that count: where glasses disperse, a ray is the hero's alone. */
#if CAMERA_DISPERSES
#define LENS_EACH(F) F(x)
#else
#define LENS_EACH(F) SPECTRUM_EACH(F)
#endif

/* The share of unpolarised light that comes back, by Fresnel's equations or by the films' waves. cosine: of the angle
 * on the film's side. Without absorption it is the same from either side. */
inline Spectrum lens_reflectance(Scene scene, LensSurface s, real cosine, real near, real far, Wavelengths lambdas)
{
    real c = clamp_r(cosine, (real)(1e-4f), (real)(1.0f));
    real ratio = near / far, inside = 1.0f - ratio * ratio * (1.0f - c * c), beyond = sqrt_r(inside);
    real rs = (near * c - far * beyond) / (near * c + far * beyond);
    real rp = (far * c - near * beyond) / (far * c + near * beyond);
    Spectrum r = spectrum_of(sel(inside > 0.0f, 0.5f * (rs * rs + rp * rp), (real)(1.0f)));
    if (any(s.coats > 0)) {
#if SPECTRUM_SIZE == 3 /* red, green and blue stand for a wavelength each */
        Spectrum at = {(real)(611.0f), (real)(549.0f), (real)(465.0f)};
#else
        Spectrum at = lambdas;
#endif
#define C(c_) Stack CAT(stack_, c_) = stack_on(far, (real)(0.0f), near, c);
        LENS_EACH(C)
#undef C
        for (int i = 0; any(i < s.coats); ++i) {
            mask there = i < s.coats;
            integer word = sel_i(there, s.first_coat + 2 * i, (integer)(0));
            Admittance film = admittance_of(gather(scene.camera, word), (real)(0.0f), near, c);
            real thickness = gather(scene.camera, word + 1);
#define C(c_) CAT(stack_, c_) = stack_sel(there, stack_layer(CAT(stack_, c_), film, thickness, at.c_), CAT(stack_, c_));
            LENS_EACH(C)
#undef C
        }
        Admittance outer = admittance_of(near, (real)(0.0f), near, c);
        mask coated = s.coats > 0;
#define C(c_)                                                                                                 \
        {                                                                                                     \
            Stack whole = stack_cross(CAT(stack_, c_), outer);                                                \
            real back = 0.5f * (complex_norm(whole.s.r) + complex_norm(whole.p.r));                           \
            r.c_ = sel(coated, min_r(back, (real)(1.0f)), r.c_);                                              \
        }
        LENS_EACH(C)
#undef C
    }
    return r;
}
#endif

/* The direction behind a boundary; n: against d; cosine: of d to -n; ratio: index over that beyond. */
inline vec3 lens_refract(vec3 d, vec3 n, real cosine, real ratio, mask *passes)
{
    real inside = 1.0f - ratio * ratio * (1.0f - cosine * cosine);
    *passes = inside > 0.0f;
    return madd3(n, ratio * cosine - sqrt_r(inside), scale3(d, ratio));
}

/* Straight through. */
inline LensRay lens_through(Scene scene, global const LensCamera *camera, LensRay r, Wavelengths lambdas)
{
    real near = 1.0f;
    for (int i = 0; i < camera->count && any(r.alive); ++i) {
        LensSurface s = lens_surface_at(scene.camera, camera->surfaces + i * LENS_SURFACE_WORDS);
        vec3 n;
        r.alive = r.alive & lens_meet(s, &r.o, r.d, &n);
        if (any(s.stop != 0)) r.alive = r.alive & lens_passes(scene, camera, s, r.o);
        real far = lens_index(scene, s.far_index, s.far_glass, lambdas), cosine = -dot3(r.d, n);
#if LENS_LOSSES
        Spectrum lost = lens_reflectance(scene, s, cosine, near, far, lambdas);
        r.share = spectrum_mul(r.share, spectrum_sub(spectrum_of(1.0f), lost));
#endif
        mask passes;
        r.d = lens_refract(r.d, n, cosine, near / far, &passes);
        r.alive = r.alive & passes;
        near = far;
    }
    return r;
}

#if LENS_GHOSTS
/* Through the lens with two reflections: at surface `far_one`, then, on the way back, at `near_one`, which is nearer to
 * the film. What does not reflect at a surface goes through it. inward: the same way from the scene to the film. */
inline LensRay lens_ghost(Scene scene, global const LensCamera *camera, LensRay r, integer near_one, integer far_one,
                          int inward, Wavelengths lambdas)
{
    integer at = inward ? camera->count - 1 : 0, turns = 0;
    integer first = inward ? near_one : far_one, second = inward ? far_one : near_one;
    global const uint *rows = (global const uint *)(scene.camera);
    for (int step = 0; step < 3 * camera->count; ++step) {
        mask going = r.alive & (at >= 0) & (at < camera->count);
        if (!any(going)) break;
        integer row = sel_i(going, at, (integer)(0)) * LENS_SURFACE_WORDS + camera->surfaces;
        LensSurface s = lens_surface_row(rows, row);
        vec3 o = r.o, n;
        mask ahead = inward ? turns == 1 : turns != 1;
        mask met = lens_meet(s, &o, r.d, &n) & lens_passes(scene, camera, s, o);
        r.o = sel3(going, o, r.o);
        real near = lens_index(scene, s.near_index, s.near_glass, lambdas);
        real far = lens_index(scene, s.far_index, s.far_glass, lambdas);
        n = sel3(ahead, n, neg3(n));
        real cosine = -dot3(r.d, n), ratio = sel(ahead, near / far, far / near);
        real other = sqrt_r(1.0f - ratio * ratio * (1.0f - cosine * cosine)); /* cosine on the other side */
        Spectrum back = lens_reflectance(scene, s, sel(ahead, cosine, other), near, far, lambdas);
        mask passes, mirror = at == sel_i(turns == 0, first, sel_i(turns == 1, second, (integer)(-1)));
        vec3 on = lens_refract(r.d, n, cosine, ratio, &passes);
        on = sel3(mirror, madd3(n, 2.0f * cosine, r.d), on);
        Spectrum share = spectrum_sel(mirror, back, spectrum_sub(spectrum_of(1.0f), back));
        r.share = spectrum_sel(going, spectrum_mul(r.share, share), r.share);
        r.d = sel3(going, on, r.d);
        r.alive = r.alive & (!going | (met & (passes | mirror) & (cosine > 0.0f)));
        turns = turns + sel_i(going & mirror, (integer)(1), (integer)(0));
        at = at + sel_i(going, sel_i(inward ? turns == 1 : turns != 1, (integer)(1), (integer)(-1)), (integer)(0));
    }
    r.alive = r.alive & (turns == 2) & (inward ? at < 0 : at >= camera->count);
    return r;
}

/* Two surfaces by a random number, and 1 / their probability; *u: uniform in [0, 1), and so again the rest of it. */
inline vec3 lens_ghost_pair(Scene scene, global const LensCamera *camera, real *u)
{
    real cell = min_r(*u * (real)(LENS_GHOST_CELLS), (real)(LENS_GHOST_CELLS - 1)), whole = floor(cell);
    *u = min_r(cell - whole, (real)(1.0f));
    return gather3(scene.camera, camera->ghost_cells + 3 * to_integer(whole));
}
#endif

CameraRay lens_ray(Scene scene, global const LensCamera *camera, vec2 film, vec2 lens, Wavelengths lambdas,
                   Spectrum *weight)
{
    real x = (film.x - 0.5f) * camera->extent[0], y = (film.y - 0.5f) * camera->extent[1];
    real radius = sqrt(x * x + y * y), inv = 1.0f / max_r(radius, (real)(1e-12f));
    mask off = radius > 1e-12f;
    real towards_x = sel(off, x * inv, (real)(1.0f)), towards_y = sel(off, y * inv, (real)(0.0f));
    integer zone = clamp_i(to_integer(min_r(radius * camera->zones_per_metre, (real)(1e6f))), camera->last_zone);
    vec4 ellipse = gather4(scene.camera, camera->zones + 4 * zone);
    real share = 1.0f;
#if LENS_GHOSTS
    mask ghost = lens.x < camera->ghosts;
    lens.x = sel(ghost, lens.x / camera->ghosts, (lens.x - camera->ghosts) / (1.0f - camera->ghosts));
    real rest = lens.x;
    vec3 pair = lens_ghost_pair(scene, camera, &rest);
    lens.x = sel(ghost, rest, lens.x);
    share = sel(ghost, pair.z / camera->ghosts, (real)(1.0f / (1.0f - camera->ghosts)));
    ellipse.x = sel(ghost, (real)(0.0f), ellipse.x);
    ellipse.y = sel(ghost, (real)(camera->rear_radius), ellipse.y);
    ellipse.z = sel(ghost, (real)(camera->rear_radius), ellipse.z);
#endif
    vec2 q = concentric_disk(lens);
    real u = ellipse.x + q.x * ellipse.y, v = q.y * ellipse.z;
    LensRay r;
    r.o = v3(x, y, (real)(0.0f));
    r.d = normalize3(v3(u * towards_x - v * towards_y - x, u * towards_y + v * towards_x - y, (real)(camera->back)));
    r.share = spectrum_of(1.0f);
    real area = PI * ellipse.y * ellipse.z, cosine2 = sqr(r.d.z);
    real part = share * camera->exposure * area * sqr(cosine2) / sqr(camera->back);
    r.alive = part > 0.0f;
#if LENS_GHOSTS
    LensRay straight = r, twice = r;
    straight.alive = r.alive & !ghost;
    twice.alive = r.alive & ghost;
    r = lens_through(scene, camera, straight, lambdas);
    if (any(twice.alive)) {
        twice = lens_ghost(scene, camera, twice, to_integer(pair.x), to_integer(pair.y), 0, lambdas);
        r.o = sel3(ghost, twice.o, r.o);
        r.d = sel3(ghost, twice.d, r.d);
        r.share = spectrum_sel(ghost, twice.share, r.share);
        r.alive = (r.alive & !ghost) | (twice.alive & ghost);
    }
#else
    r = lens_through(scene, camera, r, lambdas);
#endif
    vec3 o = sel3(r.alive, r.o, v3(0.0f, 0.0f, 0.0f)), d = sel3(r.alive, r.d, v3(0.0f, 0.0f, 1.0f));
    CameraRay ray;
    ray.o = matrix_point(camera->to_world, o.x, o.y, o.z);
    ray.d = normalize3(matrix_vector(camera->to_world, d.x, d.y, d.z));
    ray.far = sel(r.alive, (real)(FAR), (real)(1e-30f)); /* what was stopped meets nothing */
    *weight = spectrum_sel(r.alive, spectrum_scale(r.share, part), spectrum_of(0.0f));
    return ray;
}

/* Step ghosts: ghosts by light paths: light that comes straight from a light to a point of the lens's front, is
 * reflected twice, and lands on the film. It is what a ray from the film finds that goes the other way: a lens keeps
 * the product of area, cosine and solid angle. The points lie evenly over the disk of the front's rim, z along the
 * surface.
 *
 * A pixel is the mean of `exposure` times irradiance. So light of flux F counts as exposure F / (area of the film), for
 * each pixel of the picture (film/connect.cl). */
#include "film/connect.cl"

typedef struct {
    vec3 p, n; /* on the front, and its normal toward the scene; of camera space */
    real area; /* that the point stands for [m^2] */
} LensFront;

inline LensFront lens_front(Scene scene, global const LensCamera *camera, vec2 u)
{
    LensSurface s = lens_surface_at(scene.camera, camera->surfaces + (camera->count - 1) * LENS_SURFACE_WORDS);
    vec2 q = concentric_disk(u);
    real slope, x = q.x * s.radius, y = q.y * s.radius, sag = lens_sag(s, x * x + y * y, &slope);
    LensFront f;
    f.p = v3(x, y, s.z + sag);
    f.n = normalize3(v3(-slope * x, -slope * y, (real)(1.0f)));
    f.area = PI * s.radius * s.radius / f.n.z;
    return f;
}

/* Where light lands that comes along d, of camera space, and how much of its radiance counts; it is not seen where it
 * does not land. pick: which surfaces reflect. */
inline CameraPoint lens_ghost_land(Scene scene, global const LensCamera *camera, LensFront f, vec3 d, real pick,
                                   Wavelengths lambdas, Spectrum *share)
{
    global const Settings *settings = scene.settings;
    vec3 pair = lens_ghost_pair(scene, camera, &pick);
    LensRay r;
    r.o = f.p;
    r.d = d;
    r.share = spectrum_of(1.0f);
    r.alive = (dot3(d, f.n) < 0.0f) & mask_of(camera->ghosts > 0.0f);
    r = lens_ghost(scene, camera, r, to_integer(pair.x), to_integer(pair.y), 1, lambdas);
    r.alive = r.alive & (r.d.z < -1e-6f);
    real t = -r.o.z / sel(r.alive, r.d.z, (real)(-1.0f));
    float width = (float)settings->film_width, height = (float)settings->film_height;
    CameraPoint c = camera_nowhere();
    c.seen = r.alive;
    c.film.x = ((r.o.x + t * r.d.x) / camera->extent[0] + 0.5f) * width - (float)settings->crop_x;
    c.film.y = ((r.o.y + t * r.d.y) / camera->extent[1] + 0.5f) * height - (float)settings->crop_y;
    float cropped = width * height / ((float)settings->width * (float)settings->height);
    float whole = camera->extent[0] * camera->extent[1];
    c.importance = pair.z * f.area * fabs(dot3(d, f.n)) * camera->exposure * cropped / whole;
    *share = r.share;
    return camera_near(scene, c);
}
