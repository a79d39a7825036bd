/* The cone around a path's ray, whose width chooses among the levels of images (Akenine-Moller et al. 2019, "Texture
 * Level of Detail Strategies for Real-Time Ray Tracing"). It begins as wide as a pixel. Scattering
 * widens it, the more the lower the density of the sampled direction; a mirror keeps it, curved or not. A cone without
 * width asks for the finest level: light paths have such a cone. */
typedef struct {
    real width;  /* [m] */
    real spread; /* what it grows by, per metre */
} Cone;

/* Step. */

#define CONE_SHARE 0.25f  /* of the width of a lobe: what differs within it is averaged by samples */
#define CONE_WIDEST 0.4f  /* the most that a lobe adds, as a diffuse lobe does */
#define CONE_UPPER ((int)0xffff0000) /* bits of a float that are kept */

/* The word of Path.cone: 16 bits each, which keep 8 bits of the mantissa. */
inline integer cone_word(Cone c)
{
    integer width = as_integer(min_r(c.width, (real)(1e30f))) + 0x8000, spread = as_integer(c.spread) + 0x8000;
    return (width & CONE_UPPER) | ((spread >> 16) & 0xffff);
}

/* The cone t metres along its ray. */
inline Cone cone_after(integer word, real t)
{
    Cone c;
    c.spread = as_real(word << 16);
    c.width = as_real(word & CONE_UPPER) + c.spread * t;
    return c;
}

/* A camera's ray, and the rays a pixel's side farther along x and along y of the film. */
inline Cone cone_of_pixel(vec3 o, vec3 d, vec3 beside_o, vec3 beside_d)
{
    vec3 from = sub3(beside_o, o), turned = sub3(beside_d, d);
    Cone c = {sqrt(0.5f * dot3(from, from)), sqrt(0.5f * dot3(turned, turned))};
    c.spread = clamp_r(c.spread, (real)(0.0f), (real)(CONE_WIDEST));
    return c;
}

/* The cone behind a surface or in a medium that scatters it: word for Path.cone. */
inline integer cone_scattered(Cone c, real pdf, mask delta)
{
    real wider = min_r(CONE_SHARE / sqrt(max_r(pdf, (real)(1e-6f))), (real)(CONE_WIDEST));
    c.spread = min_r(c.spread + sel(delta, (real)(0.0f), wider), (real)(1.0f));
    return cone_word(c);
}

/* The longer axis of its section with a surface, in units of the surface's uv; 0 where that has none. */
inline real cone_footprint(Cone c, vec3 d, vec3 n, vec3 dpdu, vec3 dpdv)
{
    real area = wide_length3(cross3(dpdu, dpdv)), cosine = max_r(fabs(dot3(n, d)), (real)(1e-3f));
    return sel(area > 1e-36f, c.width / (cosine * sqrt(area)), (real)(0.0f));
}

/* Twin, where no image has levels to choose among. */
inline integer cone_word(Cone c) { return (integer)(0); }
inline integer cone_scattered(Cone c, real pdf, mask delta) { return (integer)(0); }
inline Cone cone_after(integer word, real t) { Cone c = {(real)(0.0f), (real)(0.0f)}; return c; }
inline real cone_footprint(Cone c, vec3 d, vec3 n, vec3 dpdu, vec3 dpdv) { return (real)(0.0f); }

/* Step first: the first Path.cone of a camera path, from its ray and a ray a pixel farther. */
#include "textures/cone.cl"

inline integer first_cone(Scene scene, CameraRay ray, vec2 position, vec2 lens, Wavelengths lambdas)
{
    vec2 beside = {position.x + 1.0f / to_real((integer)(scene.settings->film_width)),
                   position.y + 1.0f / to_real((integer)(scene.settings->film_height))};
    Spectrum unused;
    CameraRay other = first_ray(scene, beside, lens, lambdas, &unused);
    return cone_word(cone_of_pixel(ray.o, ray.d, other.o, other.d));
}

/* Step unrelated: where rays of neighbouring pixels have nothing in common, images show their finest level. */
inline integer first_cone(Scene scene, CameraRay ray, vec2 position, vec2 lens, Wavelengths lambdas)
{
    return (integer)(0);
}
