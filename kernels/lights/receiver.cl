/* What the tree over lights asks of a surface: the hemisphere that it scatters into, and its gloss.
 *
 * The gloss is a GGX lobe with a single roughness and a share of the reflectance, both estimated by the host:
 * clpt/render/materials/encode.py. The lobe, widened by the size of a node, weighs the importance of the node. Liu et
 * al. 2019, "Adaptive BRDF-Oriented Multiple Importance Sampling of Many Lights", and Tokuyoshi et al. 2024,
 * "Hierarchical Light Sampling with Accurate Spherical Gaussian Lighting", use other lobes. The half vector keeps the
 * shape of the lobe at grazing angles, and costs a single division. */
#include "core/warp.cl"

#define RECEIVER_SPREAD 0.1f /* share of a node's squared sine that is added to the squared roughness */
#define RECEIVER_MOST 0.95f  /* of the share, as it is an estimate: other light must be sampled, too */

typedef struct {
    vec3 hemisphere;       /* unit normal of the hemisphere that it scatters into, 0 for the sphere */
    natural toward, gloss; /* words in the path: packed wo; alpha and share */
    vec3 wo;               /* direction of the scattered light, unit length */
    real width, share;     /* alpha^2; 0: no gloss */
    real height;           /* share G1(wo) / (4 |cos|) */
} Receiver;

inline Receiver receiver_of(vec3 hemisphere, natural toward, natural gloss)
{
    Receiver r = {hemisphere, toward, gloss, octahedral_unpack(toward)};
    real cos_o = dot3(r.wo, hemisphere), away = 1.0f - clamp_r(cos_o, (real)(0.0f), (real)(1.0f));
    real straight = to_real(gloss & 0xffffu) * (1.0f / 65535.0f); /* Schlick's approximation raises it to 1 */
    real share = straight + (1.0f - straight) * sqr(sqr(away)) * away;
    r.width = sqr(to_real(gloss >> 16u) * (1.0f / 65535.0f));
    r.share = sel((gloss != 0u) & (cos_o > 0.0f), RECEIVER_MOST * share, (real)(0.0f));
    real c = max_r(cos_o, (real)(0.0f));
    r.height = 0.5f * r.share / (c + sqrt_r(r.width + (1.0f - r.width) * sqr(c)));
    return r;
}

/* The receiver of a surface without gloss. */
inline Receiver receiver_dull(vec3 hemisphere) { return receiver_of(hemisphere, (natural)(0), (natural)(0)); }

/* The receiver of a surface with the material at `row`, for light that it scatters along `away`. */
inline Receiver receiver_at(Scene scene, integer row, vec3 hemisphere, vec3 away)
{
    natural gloss = as_natural(gather_i(scene.materials, max_i(row - GLOSS_BEFORE, (integer)(0))));
    return receiver_of(hemisphere, octahedral_pack(away), gloss);
}

/* pi f cos of the gloss for light from a cone around wi; sine: of the cone's half angle. Masking of wi is left out. */
inline real receiver_gloss(Receiver r, vec3 wi, real sine)
{
    vec3 h = add3(r.wo, wi);
    real width = min_r(r.width + RECEIVER_SPREAD * sqr(sine), (real)(1.0f));
    real h2 = dot3(h, h), up = max_r(dot3(h, r.hemisphere), (real)(0.0f));
    return r.height * width * sqr(h2 / max_r(h2 - (1.0f - width) * sqr(up), (real)(1e-20f)));
}

/* pi f cos of all reflection over the albedo; cosine: between light and normal. */
inline real receiver_reflects(Receiver r, vec3 wi, real sine, real cosine)
{
    mask glossy = r.share > 0.0f;
    if (any(glossy)) cosine = sel(glossy, cosine * (1.0f - r.share) + receiver_gloss(r, wi, sine), cosine);
    return cosine;
}

/* Twin, where no light is sampled by gloss. */
typedef struct { vec3 hemisphere; } Receiver;

inline Receiver receiver_dull(vec3 hemisphere) { return (Receiver){hemisphere}; }
inline Receiver receiver_at(Scene scene, integer row, vec3 hemisphere, vec3 away) { return (Receiver){hemisphere}; }
inline real receiver_reflects(Receiver r, vec3 wi, real sine, real cosine) { return cosine; }

/* Step kept: the receiver where a ray was sampled: next-event estimation chose lights by it. */
inline Receiver path_receiver(Slab path, uint at)
{
    natural wo = load_path_sampled_wo(path, at), gloss = load_path_sampled_gloss(path, at);
    return receiver_of(load_path_sampled_hemisphere(path, at), wo, gloss);
}

inline void path_receiver_keep(Slab path, uint at, mask m, Receiver r)
{
    store_path_sampled_hemisphere(path, at, m, r.hemisphere);
    store_path_sampled_wo(path, at, m, r.toward);
    store_path_sampled_gloss(path, at, m, r.gloss);
}

/* Step kept_hemisphere: the receiver's hemisphere where a ray was sampled: next-event estimation chose lights by it. */
inline Receiver path_receiver(Slab path, uint at) { Receiver r = {load_path_sampled_hemisphere(path, at)}; return r; }

inline void path_receiver_keep(Slab path, uint at, mask m, Receiver r)
{
    store_path_sampled_hemisphere(path, at, m, r.hemisphere);
}

/* Twin, where no light is chosen by the receiver. */
inline Receiver path_receiver(Slab path, uint at) { Receiver r = {v3(0.0f, 0.0f, 0.0f)}; return r; }
inline void path_receiver_keep(Slab path, uint at, mask m, Receiver r) {}
