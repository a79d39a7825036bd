/* A Spectrum in RGB mode: linear Rec. 709. The same functions stand in spectrum/spectral.cl. */
#define SPECTRUM_SIZE 3
typedef struct { real x, y, z; } Spectrum;
#define SPECTRUM_EACH(F) F(x) F(y) F(z)
#define SPECTRUM_MEAN(s) (((s).x + (s).y + (s).z) * (1.0f / 3.0f))
