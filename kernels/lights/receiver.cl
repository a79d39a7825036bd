/* What a surface does with light that comes to it, as far as the tree over lights asks for that.
 *
 * Its gloss is that of GGX microfacets of one roughness and one share in what is reflected, a guess of the host:
 * clpt/render/materials/encode.py. Lights below a node of the tree count by that lobe, wider by the size of the
 * node. Liu et al. 2019, "Adaptive BRDF-Oriented Multiple Importance Sampling of Many Lights", and Tokuyoshi et al.
 * 2024, "Hierarchical Light Sampling with Accurate Spherical Gaussian Lighting", do so with other lobes. By the half
 * vector it has its shape where light grazes, too, and costs one division. */
#include "core/octahedral.cl"

#define RECEIVER_SPREAD 0.1f /* by which the square of a node's sine adds to that of the roughness */
#define RECEIVER_MOST 0.95f  /* of the share, as it is a guess: other light is to be found, too */

typedef struct {
    vec3 hemisphere;       /* unit normal of the hemisphere to which it sends light, 0 if to the sphere */
    natural toward, gloss; /* words that a path keeps: to where that light goes, and alpha and share */
    vec3 wo;               /* to where it goes, unit length */
    real width, share;     /* alpha^2; 0: no gloss */
    real height;           /* share G1(wo) / (4 |cos|) */
} Receiver;

inline Receiver receiver_of(vec3 hemisphere, natural toward, natural gloss)
{
    Receiver r = {hemisphere, toward, gloss, octahedral_unpack(toward)};
    real cos_o = dot3(r.wo, hemisphere), away = 1.0f - clamp_r(cos_o, (real)(0.0f), (real)(1.0f));
    real straight = to_real(gloss & 0xffffu) * (1.0f / 65535.0f); /* and Schlick's rise to 1 */
    real share = straight + (1.0f - straight) * sqr(sqr(away)) * away;
    r.width = sqr(to_real(gloss >> 16u) * (1.0f / 65535.0f));
    r.share = sel((gloss != 0u) & (cos_o > 0.0f), RECEIVER_MOST * share, (real)(0.0f));
    real c = max_r(cos_o, (real)(0.0f));
    r.height = 0.5f * r.share / (c + sqrt_r(r.width + (1.0f - r.width) * sqr(c)));
    return r;
}

/* Of a surface whose material is at `row`, for light that it sends along `away`. */
inline Receiver receiver_at(Scene scene, integer row, vec3 hemisphere, vec3 away)
{
    natural gloss = as_natural(gather_i(scene.materials, max_i(row - GLOSS_BEFORE, (integer)(0))));
    return receiver_of(hemisphere, octahedral_pack(away), gloss);
}

/* pi f cos of the gloss for light that comes from around wi, within an angle of that sine; without its masking. */
inline real receiver_gloss(Receiver r, vec3 wi, real sine)
{
    vec3 h = add3(r.wo, wi);
    real width = min_r(r.width + RECEIVER_SPREAD * sqr(sine), (real)(1.0f));
    real h2 = dot3(h, h), up = max_r(dot3(h, r.hemisphere), (real)(0.0f));
    return r.height * width * sqr(h2 / max_r(h2 - (1.0f - width) * sqr(up), (real)(1e-20f)));
}

/* The same of all that is reflected, over the albedo; cosine: of the light to the normal. */
inline real receiver_reflects(Receiver r, vec3 wi, real sine, real cosine)
{
    mask glossy = r.share > 0.0f;
    if (any(glossy)) cosine = sel(glossy, cosine * (1.0f - r.share) + receiver_gloss(r, wi, sine), cosine);
    return cosine;
}

/* Twin, where only its `hemisphere` matters. */
typedef struct { vec3 hemisphere; } Receiver;

inline Receiver receiver_at(Scene scene, integer row, vec3 hemisphere, vec3 away)
{
    Receiver r = {hemisphere};
    return r;
}
inline real receiver_reflects(Receiver r, vec3 wi, real sine, real cosine) { return cosine; }
