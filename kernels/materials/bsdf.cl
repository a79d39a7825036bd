/* The contract of a material kind, materials/kinds/<kind>.cl, and of a phase function, media/kinds/<kind>.cl:
 *
 *   BsdfSample <kind>_sample(<Kind> m, vec3 wo, vec3 u);     u.z chooses a lobe, u.x and u.y a direction
 *   Spectrum   <kind>_eval  (<Kind> m, vec3 wo, vec3 wi);    f |cos|, of the lobes that are not delta
 *   real       <kind>_pdf   (<Kind> m, vec3 wo, vec3 wi);    [1/sr], likewise
 *   Spectrum   <kind>_albedo(<Kind> m);                      the colour a person would name
 *   Spectrum   <kind>_pdfs  (<Kind> m, vec3 wo, vec3 wi);    of `chromatic` kinds: pdf, were each wavelength the hero
 *   DiffuseLobe <kind>_diffuse_lobe(<Kind> m, vec3 wo);      of kinds with `has_diffuse_lobe`
 *   real       <kind>_across(<Kind> m);                      of kinds that refract and are not delta, or `has_across`:
 *                                                            the hero's index behind the front over that before
 *
 * wo points to the viewer, wi to the light, both away from the surface, in the local frame whose z is
 * the shading normal, on the front's side: wo.z < 0 is a look at the back. The struct <Kind> is
 * generated from the dataclass: Spectrum for spectra, real for numbers, integer for flags and choices
 * (the choice's position). Textures and wavelengths have been resolved by the loader; a kind that
 * `needs_wavelengths` has the path's as `lambdas` [nm].
 * What is sampled may depend on the hero (x) where LOBE_DISPERSE or `pdfs` tell; else a probability
 * must be symmetric in the wavelengths: take it from a spectrum_mean. spectra/hero.cl relies on that.
 * Where a parameter is declared with lobe=True, USES_<KIND>_<PARAMETER> says whether the scene has that lobe: 0 if the
 * parameter is 0 in all of its materials. The first three functions are declared as inline before the file is read.
 * Functions are pure and free of branches but for if (any(mask)); lanes that have nothing to do
 * compute what they like, but their result must not be NaN where pdf > 0.
 */
#include "generated/lobe_bits.cl"

typedef struct {
    vec3 wi;
    Spectrum weight; /* f |cos| / pdf; on transmission it holds the change of solid angle, 1/eta^2 */
    real pdf;        /* 0: nothing was sampled, the path ends */
    real eta;        /* index of the side of wi over that of wo; 1 on reflection */
    integer lobe;    /* LOBE_ bits */
    real p, p_back;  /* those of BsdfPair, of wo and wi: spectra/hero.cl sets them */
} BsdfSample;

/* The values of a material for a pair of directions. */
typedef struct {
    Spectrum f;      /* f |cos| */
    real pdf;        /* of wi, as hero_pdf has it */
    real p, p_back;  /* of wi and of wo, as mis_pdf has them */
} BsdfPair;

/* The diffuse lobe of a material below a coat with transmittance T (materials/coat.cl): f |cos| is
 * value T(wo) T(wi) cos(wi) / pi. A sample is of this lobe if u.z >= other. */
typedef struct {
    Spectrum value;
    real other; /* probability of the other lobe */
    real eta;   /* index of the coat over outside; 0: there is no coat, -1: it varies with wavelength */
    real alpha; /* its roughness; 0: it is smooth, below 0: of Beckmann's facets */
} DiffuseLobe;

inline DiffuseLobe diffuse_lobe_nothing(void)
{
    DiffuseLobe lobe = {spectrum_of(0.0f), (real)(1.0f), (real)(0.0f), (real)(0.0f)};
    return lobe;
}

/* Of two lobes with albedos a and b: the factor 1 / max(1, a + b), per wavelength. */
inline Spectrum two_lobes_scale(Spectrum a, Spectrum b)
{
    Spectrum r;
#define C(c) r.c = 1.0f / max_r(a.c + b.c, (real)(1.0f));
    SPECTRUM_EACH(C)
#undef C
    return r;
}
/* The probability of sampling the second of them. */
inline real two_lobes_probability(Spectrum a, Spectrum b)
{
    real first = spectrum_mean(a), second = spectrum_mean(b);
    return sel(second + first > 0.0f, second / max_r(second + first, (real)(1e-20f)), (real)(0.5f));
}

inline BsdfSample bsdf_nothing(void)
{
    BsdfSample s;
    s.wi = v3(0.0f, 0.0f, 1.0f);
    s.weight = spectrum_of(0.0f);
    s.pdf = 0.0f;
    s.eta = 1.0f;
    s.lobe = LOBE_REFLECT;
    return s;
}

/* Step answer: what a vertex asks of its material, where paths share vertices below coats. */
typedef struct {
    BsdfPair pair;
    BsdfSample sample;
    DiffuseLobe lobe;
} BsdfAnswer;
#define answer_diffuse_lobe(a, m, wo) (a).lobe = bsdf_diffuse_lobe(m, wo)

/* Twin, where they do not. */
typedef struct {
    BsdfPair pair;
    BsdfSample sample;
} BsdfAnswer;
#define answer_diffuse_lobe(a, m, wo)

/* Step pair: what a vertex asks of its material for a pair of directions. */
inline BsdfPair bsdf_pair(Bsdf m, vec3 wo, vec3 wi, Spectrum ratio)
{
    BsdfPair pair;
    pair.f = bsdf_eval(m, wo, wi);
    pair.pdf = hero_pdf(m, wo, wi, ratio);
    pair.p = mis_pdf(m, wo, wi);
    pair.p_back = mis_pdf(m, wi, wo);
    return pair;
}

/* Sets the densities for MIS weights against paths from the other end. */
inline void pair_of_sample(Bsdf m, vec3 wo, BsdfSample *s)
{
    s->p = mis_pdf(m, wo, s->wi);
    s->p_back = mis_pdf(m, s->wi, wo);
}

/* Before a vertex takes the pair of wo and `wi`, or of wi and wo where light is carried (`adjoint`), and a sample. */
#define bsdf_ask(scene, scatter, wi, adjoint)

/* Step pair_apart: in place of `pair`, where a material's functions are a part of their own, see `apart`. */
#define bsdf_pair(m, wo, wi, ratio) ((m).answer.pair)
#define bsdf_sample(m, wo, u) ((m).answer.sample)
#define bsdf_diffuse_lobe(m, wo) ((m).answer.lobe)
#define pair_of_sample(m, wo, s)
#define bsdf_ask(scene, scatter, wi, adjoint) (scatter).bsdf.answer = apart_asked(scene, scatter, wi, adjoint)

inline BsdfAnswer apart_asked(Scene scene, Scattering scatter, vec3 wi, uint adjoint)
{
    vec2 uv = sampler_pair(scatter.sampler, scatter.dimension + DIMENSION_BSDF);
    vec3 u = v3(uv.x, uv.y, scatter.choice.y);
    Bsdf m = scatter.bsdf;
    return apart_answer(scene, m.row, m.point, m.lambdas, scatter.wo, wi, u, adjoint);
}

/* Step apart: a material whose functions are a part of their own in the loop of a CPU, as several kinds share a vertex.
 * It is of the kind `scene.kind` in all LANES paths. A vertex asks it once (`bsdf_ask`), so that its parameters are
 * loaded once, and what a pair of directions and a sample have in common is computed once. */
typedef struct {
    integer row;
    TexturePoint point;
    Wavelengths lambdas;
    BsdfAnswer answer;
} Bsdf;

inline Bsdf bsdf_load(Scene scene, integer row, TexturePoint point, Wavelengths lambdas)
{
    Bsdf m;
    m.row = row;
    m.point = point;
    m.lambdas = lambdas;
    return m;
}
#define bsdf_albedo_in(scene, m) apart_albedo(scene, (m).row, (m).point, (m).lambdas)

/* Step mis_pdf: the density of a direction, averaged over the hero wavelengths: equal for camera and light paths. */
inline real mis_pdf(Bsdf m, vec3 wo, vec3 wi) { return spectrum_mean(bsdf_pdfs(m, wo, wi)); }

/* Twin, where all wavelengths have the same density. */
inline real mis_pdf(Bsdf m, vec3 wo, vec3 wi) { return bsdf_pdf(m, wo, wi); }

/* Step no_mis_pdf: in place of `mis_pdf`, without light paths. */
#define mis_pdf(m, wo, wi) ((real)(0.0f))
