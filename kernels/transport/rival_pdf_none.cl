/* Stands for transport/rival_pdf.cl where it is the same for all wavelengths. */
#define rival_pdf(m, wo, wi) bsdf_pdf(m, wo, wi)
