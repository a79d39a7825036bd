/* The contract of a light kind: kernels/lights/kinds/<kind>.cl has, for the kinds that are not on a shape,
 *
 *   LightSample <kind>_sample(<Kind> l, Scene scene, vec3 p, vec2 u, Wavelengths lambdas);
 *
 * which samples a direction toward the light as seen from p. Infinite lights, which a ray can meet, have
 *
 *   LightSample <kind>_sample(<Kind> l, Scene scene, vec3 hemisphere, vec2 u, Wavelengths lambdas);
 *   Spectrum <kind>_radiance(<Kind> l, Scene scene, vec3 d, Wavelengths lambdas);   along a ray that leaves the scene
 *   real     <kind>_pdf(<Kind> l, Scene scene, vec3 hemisphere, vec3 d);                  of sample, [1/sr]
 *
 * where `hemisphere` is the unit normal of the hemisphere that the surface scatters into, 0 for the whole sphere. The
 * struct <Kind> is generated from the dataclass (clpt/render/records/lights.py, where lights with images have
 * Records of their own, and LightSample too); its rows lie in `light_params`. `emission_load` reads an emission;
 * `texture_point_nowhere` stands for the point of a light that has no texture. */
#include "generated/light_sample.cl"

/* Whether only light from a single hemisphere matters. */
inline mask hemisphere_given(vec3 hemisphere) { return dot3(hemisphere, hemisphere) > 0.5f; }

/* LightRow.emission_mode of a light on a shape: 0 diffuse from the front, or bits: EMISSION_ALONG the normal alone
 * (particle_tracer), EMISSION_BOTH sides, EMISSION_UNSEEN by rays, EMISSION_DIRECTED: its textures see directions. */
#define light_mode(l, bit) (((l).emission_mode & (bit)) != 0)

/* The direction from p to a light at a point, and its distance; *t2: the square of that [m^2]. */
inline LightSample light_toward(vec3 position, vec3 p, real *t2)
{
    vec3 to = sub3(position, p);
    LightSample s;
    *t2 = max_r(dot3(to, to), (real)(1e-20f));
    s.t = sqrt(*t2);
    s.wi = scale3(to, 1.0f / s.t);
    return s;
}

/* Step choice: choice of a row of `lights` by the alias method (Walker 1977). */
inline LightRow light_at(Scene scene, integer row)
{
    return light_row_row(scene.lights, row * LIGHT_ROW_WORDS);
}

/* With few lights, the random number that chooses a light is reused for the point on it, so that both come from a
 * single well-distributed pair. With many lights it would have no bits left. */
#ifndef FEW_LIGHTS
#define FEW_LIGHTS 0
#endif

/* A random number has 23 bits, and each choice uses up some of them. This replaces the lower bits: uniform in [0,
 * grain). other: a random number of the same sample; choice: a different word for each choice. Neither may depend on a
 * rounded number, as a device with other rounding would choose other lights everywhere. */
inline real light_bits(natural choice, real other, real grain)
{
    return unit_interval(hash_natural(choice ^ hash_natural(as_natural(other)))) * grain;
}

/* Samples a row of `lights`; *u: chooses the row, or its alias by the fraction; it is rescaled to a new random number.
 * other: see light_bits. */
inline integer light_pick(Scene scene, real *u, real other)
{
    int count = scene.settings->light_count;
    if (count == 1) return (integer)(0);
    real position = *u * (float)count, whole = floor(position), remainder = position - whole;
#if !FEW_LIGHTS
    remainder += light_bits(as_natural(*u), other, (real)((float)count * UNIT_GRAIN));
    whole += floor(remainder);
    remainder -= floor(remainder);
#endif
    integer row = min_i(to_integer(whole), (integer)(count - 1));
    LightRow l = light_at(scene, row);
    mask stay = remainder < l.keep;
    real left = sel(stay, remainder, remainder - l.keep), share = sel(stay, l.keep, 1.0f - l.keep);
    *u = clamp_r(left / max_r(share, (real)(1e-20f)), (real)(0.0f), (real)(0.99999994f));
    return sel_i(stay, row, l.alias);
}

/* A sample with its row, and the probability of that in the pdf; a delta light has it in the radiance. */
inline LightSample light_chosen(LightSample s, integer row, real pmf)
{
    s.row = row;
    s.chance = pmf;
    mask delta = s.pdf < 0.0f;
    s.radiance = spectrum_scale(s.radiance, sel(delta, 1.0f / max_r(pmf, (real)(1e-30f)), (real)(1.0f)));
    s.pdf = sel(delta & (pmf > 0.0f), s.pdf, max_r(s.pdf, (real)(0.0f)) * pmf);
    return s;
}

/* Step by_power: lights are chosen by their power. */
#define light_pmf(scene, row, l, p, receiver) ((l).pmf)

inline integer light_choose(Scene scene, vec3 p, Receiver receiver, real *u, real other, real *pmf)
{
    integer row = light_pick(scene, u, other);
    *pmf = light_at(scene, row).pmf;
    return row;
}

/* Step begins: the density of emission toward p of a light that the ray from p along wi meets at distance t:
 * light_emit_pdf. n: the normal at the light; *nee_pdf: the density of next-event estimation at p for that point,
 * light_nee_pdf. */
inline real light_begins_pdf(Scene scene, integer row, vec3 p, Receiver receiver, vec3 wi, real t, vec3 n,
                             real *nee_pdf)
{
    *nee_pdf = light_nee_pdf(scene, row, p, receiver, wi, t, n);
    return light_emit_pdf(scene, row, wi, t);
}

/* Step next_event: stores where a shadow ray runs, in the lanes `kept`; returns its length. It runs from the offset
 * point to the light's point, because a ray along wi would miss that point. */
inline real shadow_aim(Slab shadow, uint at, mask kept, Surface s, vec3 wi, real far)
{
    vec3 from = surface_offset(s, wi), to = sub3(madd3(wi, far, s.p), from);
    real t = sqrt(dot3(to, to));
    store_shadow_o(shadow, at, kept, from);
    store_shadow_d(shadow, at, kept, sel3(far < FAR, scale3(to, 1.0f / t), wi));
    return sel(far < FAR, t, far) * SHADOW_SHORTER;
}

/* Step met: the mis_ratio of a camera path that meets a light. */

#include "generated/kept_hemisphere.cl"

/* 0 where the camera or its first surface sees the light: light paths are not connected there
 * (transport/mis_ratio.cl). */
#define path_mis_ratio(path, at, depth) sel((depth) > 1, load_path_mis_ratio(path, at), (real)(0.0f))

/* Step volumes: lights that are media, or bricks of media. */

/* The medium of a row of `lights` that is a medium or a brick; 0 for any other light. */
inline integer volume_medium(Scene scene, integer row)
{
    LightRow l = light_at(scene, row);
    mask part = l.kind >= LIGHT_VOLUMES;
    integer medium = gather_i(scene.light_params, sel_i(part, l.params, (integer)(0)));
    return sel_i(part, medium, (integer)(0));
}
