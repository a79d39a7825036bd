/* What a surface does with light that comes to a point, as far as the tree over lights asks for it. */
#include "core/octahedral.cl"

#ifndef RECEIVER_SPREAD
#define RECEIVER_SPREAD 0.1f
#endif
#define RECEIVER_MOST 0.95f /* so that light that is not where the gloss looks is found, too */

typedef struct {
    vec3 hemisphere; /* unit normal of the hemisphere to which it sends light, 0 if to the sphere */
    vec3 wo;         /* to where that light goes, unit length */
    real width;      /* square of the roughness of its gloss */
    real share;      /* of gloss in what it reflects; 0: none */
    real height;     /* of the gloss, see receiver_gloss */
    natural toward, gloss; /* words that a path keeps of wo and the rest */
} Receiver;

#define receiver_hemisphere(r) ((r).hemisphere)

/* wo, gloss: words that a path keeps, see clpt/render/lowering/materials/gloss.py. */
inline Receiver receiver_of(vec3 hemisphere, natural wo, natural gloss)
{
    Receiver r;
    r.hemisphere = hemisphere;
    r.toward = wo;
    r.gloss = gloss;
    r.wo = octahedral_unpack(wo);
    r.width = sqr(to_real(gloss >> 16u) * (1.0f / 65535.0f));
    real straight = to_real(gloss & 0xffffu) * (1.0f / 65535.0f), cos_o = dot3(r.wo, hemisphere);
    real away = clamp_r(1.0f - cos_o, (real)(0.0f), (real)(1.0f));
    mask glossy = (gloss != 0u) & (cos_o > 0.0f);
    r.share = sel(glossy, RECEIVER_MOST * (straight + (1.0f - straight) * sqr(sqr(away)) * away), (real)(0.0f));
    cos_o = max_r(cos_o, (real)(0.0f));
    r.height = 0.5f * r.share / (cos_o + sqrt_r(r.width + (1.0f - r.width) * sqr(cos_o)));
    return r;
}

/* What the gloss sends of light from around wi, over that of a white diffuse surface that faces it: pi f cos, f of GGX
 * microfacets without the masking of wi, by the half vector. Lights within an angle of sine `spread` around wi see
 * these facets as rough as it takes. */
inline real receiver_gloss(Receiver r, vec3 wi, real spread)
{
    vec3 h = add3(r.wo, wi);
    real width = min_r(r.width + RECEIVER_SPREAD * sqr(spread), (real)(1.0f));
    real h2 = dot3(h, h), along = max_r(dot3(h, r.hemisphere), (real)(0.0f));
    real d = h2 - (1.0f - width) * sqr(along);
    return r.height * width * sqr(h2 / max_r(d, (real)(1e-20f)));
}

/* The same of all that is reflected; cosine: of the light to the normal. */
inline real receiver_reflects(Receiver r, vec3 wi, real spread, real cosine)
{
    mask glossy = r.share > 0.0f;
    if (any(glossy)) cosine = sel(glossy, cosine * (1.0f - r.share) + receiver_gloss(r, wi, spread), cosine);
    return cosine;
}
