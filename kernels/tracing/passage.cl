/* The transmittance of a surface: a number or, with FREE_PANES, a number for each wavelength. */
#if FREE_PANES
#define Passage Spectrum
#define passage_of(x) spectrum_of(x)
#define passage_sel(m, a, b) spectrum_sel(m, a, b)
#define passage_mul(a, b) spectrum_mul(a, b)
#define passage_scale(a, x) spectrum_scale(a, x)
#define passage_most(a) spectrum_max(a)
#define passage_dims(light, a) spectrum_mul(light, a)
#define passage_adds(light, a, sum) spectrum_add(spectrum_mul(light, a), sum)
#else
#define Passage real
#define passage_of(x) ((real)(x))
#define passage_sel(m, a, b) sel(m, a, b)
#define passage_mul(a, b) ((a) * (b))
#define passage_scale(a, x) ((a) * (x))
#define passage_most(a) (a)
#define passage_dims(light, a) spectrum_scale(light, a)
#define passage_adds(light, a, sum) spectrum_madd(light, a, sum)
#endif
