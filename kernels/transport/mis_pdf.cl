/* The density of a direction, averaged over the hero wavelengths: equal for camera and light paths. */
inline real mis_pdf(Bsdf m, vec3 wo, vec3 wi) { return spectrum_mean(bsdf_pdfs(m, wo, wi)); }

/* Twin, where all wavelengths have the same density. */
inline real mis_pdf(Bsdf m, vec3 wo, vec3 wi) { return bsdf_pdf(m, wo, wi); }
