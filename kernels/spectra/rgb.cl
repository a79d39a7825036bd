/* A Spectrum in RGB mode: linear Rec. 709. The same functions stand in spectra/spectral.cl. */
#define SPECTRUM_SIZE 3
typedef struct { real x, y, z; } Spectrum;
#define SPECTRUM_EACH(F) F(x) F(y) F(z)
#define FOURTH(value)
#define SPECTRUM_MAX(s) max_r(max_r((s).x, (s).y), (s).z)
#define SPECTRUM_MEAN(s) (((s).x + (s).y + (s).z) * (1.0f / 3.0f))
/* The value by which something is sampled: of one of the three, chosen by their parts of `ratio`; u in [0, 1). */
inline real spectrum_pick(Spectrum s, Spectrum ratio, real u)
{
    return sel(u * 3.0f < ratio.x, s.x, sel(u * 3.0f < ratio.x + ratio.y, s.y, s.z));
}
