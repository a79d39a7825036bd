/* Multiple importance sampling: the weight of the first of two densities, both [1/sr], by the power heuristic with
 * exponent 2 (Veach 1997 eq. 9.13). */
inline real mis_weight(real pdf_a, real pdf_b)
{
    /* in the quotient, so that large pdfs do not overflow when squared */
    real r = pdf_b / max_r(pdf_a, (real)(1e-20f));
    return sel(pdf_a > 0.0f, 1.0f / (1.0f + r * r), (real)(0.0f));
}

/* The weight against a third density too, which is relative to the first. pdf_a below 0: delta, which the second
 * technique cannot sample. */
inline real mis_weight_of_three(real pdf_a, real pdf_b, real third)
{
    real r = sel(pdf_a < 0.0f, (real)(0.0f), pdf_b / max_r(pdf_a, (real)(1e-20f)));
    return sel(pdf_a != 0.0f, 1.0f / (1.0f + r * r + third * third), (real)(0.0f));
}
