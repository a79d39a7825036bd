/* Stands for spectra/hero_weighs.cl where densities of directions are those of all wavelengths. */
#define hero_pdf(m, wo, wi, ratio) bsdf_pdf(m, wo, wi)
#define hero_weighs(m, wo, s, ratio)
