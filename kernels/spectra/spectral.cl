/* A Spectrum in spectral mode: values at the path's four wavelengths, x at the hero's (Wilkie 2014). */
#define SPECTRUM_SIZE 4
typedef struct { real x, y, z, w; } Spectrum;
#define SPECTRUM_EACH(F) F(x) F(y) F(z) F(w)
#define FOURTH(value) , value
#define SPECTRUM_MAX(s) max_r(max_r(max_r((s).x, (s).y), (s).z), (s).w)
#define SPECTRUM_MEAN(s) (((s).x + (s).y + (s).z + (s).w) * 0.25f)
/* The value by which something is sampled: the hero's. */
inline real spectrum_pick(Spectrum s, Spectrum ratio, real u) { return s.x; }
