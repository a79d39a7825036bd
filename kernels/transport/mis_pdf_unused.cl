/* In place of transport/mis_pdf.cl, without light paths. */
#define mis_pdf(m, wo, wi) ((real)(0.0f))
