/* The density of a direction, for any of the four wavelengths as the hero: the same number from either end. */
inline real rival_pdf(Bsdf m, vec3 wo, vec3 wi) { return spectrum_mean(bsdf_pdfs(m, wo, wi)); }

/* Twin, where it is the same for all wavelengths. */
#define rival_pdf(m, wo, wi) bsdf_pdf(m, wo, wi)
