/* Hero wavelength sampling (Wilkie et al. 2014). Where a sample depends on the wavelength, it is drawn
 * for the hero; but any of a path's four wavelengths might have been the hero, so the pdf that counts is
 * the mean of the four pdfs: the balance heuristic between them, their eq. 8.
 * Vertex by vertex: `ratio` holds the pdf of the path so far at each wavelength over the mean of the
 * four, so the pdf of a direction is the mean of ratio p, and ratio becomes ratio p over that mean. A
 * direction that holds for the hero alone leaves (4, 0, 0, 0), and the path goes on with a single wavelength.
 */

/* Step weighs: densities of directions that differ between the wavelengths of a path. */
/* pdf of the directions that are not delta [1/sr]. */
inline real hero_pdf(Bsdf m, vec3 wo, vec3 wi, Spectrum ratio)
{
    return spectrum_mean(spectrum_mul(ratio, bsdf_pdfs(m, wo, wi)));
}

/* Weighs a sample over all wavelengths. */
inline void hero_weighs(Bsdf m, vec3 wo, BsdfSample *s, Spectrum *ratio)
{
    Spectrum pdfs = spectrum_mul(*ratio, bsdf_pdfs(m, wo, s->wi));
    real pdf = spectrum_mean(pdfs);
    mask usable = (s->pdf > 0.0f) & (pdf > 0.0f);
    real inv = 1.0f / sel(usable, pdf, (real)(1.0f));
    *ratio = spectrum_sel(usable, spectrum_scale(pdfs, inv), *ratio);
    s->weight = spectrum_scale(s->weight, sel(usable, s->pdf * inv, (real)(1.0f)));
    s->pdf = sel(usable, pdf, (real)(0.0f));
}

/* Twin, where densities of directions are those of all wavelengths. */
inline real hero_pdf(Bsdf m, vec3 wo, vec3 wi, Spectrum ratio) { return bsdf_pdf(m, wo, wi); }
inline void hero_weighs(Bsdf m, vec3 wo, BsdfSample *s, Spectrum *ratio) {}

/* Step alone: a path whose direction holds for its hero alone goes on with a single wavelength. */
inline void hero_goes_alone(BsdfSample *s, Spectrum *ratio)
{
    mask alone = (s->lobe & LOBE_DISPERSE) != 0;
    if (any(alone)) {
        Spectrum hero = {(real)(4.0f), (real)(0.0f), (real)(0.0f), (real)(0.0f)};
        s->weight = spectrum_sel(alone, spectrum_scale(spectrum_mul(s->weight, hero), 1.0f / ratio->x), s->weight);
        *ratio = spectrum_sel(alone, hero, *ratio);
    }
}

/* Twin, where directions hold for all wavelengths. */
inline void hero_goes_alone(BsdfSample *s, Spectrum *ratio) {}

/* Step sample: bsdf_sample, its pdf and weight those of the four together. A direction that is not finite has a pdf of
 * 0, so that the path ends: it would leave the scene, and no sky knows where. */
#include "generated/hero_steps.cl"
#include "generated/pair.cl"

inline BsdfSample hero_sample(Bsdf m, vec3 wo, vec3 u, Spectrum *ratio)
{
    BsdfSample s = bsdf_sample(m, wo, u);
    s.pdf = sel(dot3(s.wi, s.wi) < 4.0f, s.pdf, (real)(0.0f)); /* NaN fails the comparison */
    hero_weighs(m, wo, &s, ratio);
    hero_goes_alone(&s, ratio);
    pair_of_sample(m, wo, &s);
    return s;
}
