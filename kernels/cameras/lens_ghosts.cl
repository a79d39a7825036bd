/* Ghosts by light paths: light that comes straight from a light to a point of the lens's front, is reflected twice, and
 * lands on the film. It is what a ray of cameras/kinds/lens.cl finds that goes the other way: a lens keeps the product
 * of area, cosine and solid angle. The points lie evenly over the disk of the front's rim, z along the surface.
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
