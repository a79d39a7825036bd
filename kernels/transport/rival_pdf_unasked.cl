/* Stands for transport/rival_pdf.cl where paths are not weighed against light paths. */
#define rival_pdf(m, wo, wi) ((real)(0.0f))
