/* The contract of a boundary between two media, with or without thin films on it: materials/boundary_bare.cl,
 * materials/boundary_film.cl and materials/boundary_table.cl have the same functions; a program has only the file
 * that it needs. */
typedef struct {
    Spectrum r, t; /* shares of unpolarised light that are reflected and let through; the rest is absorbed */
    real p;        /* probability to choose reflection, symmetric in the wavelengths */
} Boundary;

/* By the amplitudes: the little light that a film reflects often shows a bright light. */
inline real reflection_probability(Spectrum r, Spectrum t)
{
    Spectrum p;
#define C(c) p.c = sqrt(r.c) / max_r(sqrt(r.c) + sqrt(t.c), (real)(1e-20f));
    SPECTRUM_EACH(C)
#undef C
    return spectrum_mean(p);
}
