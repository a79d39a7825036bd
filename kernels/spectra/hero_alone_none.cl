/* Stands for spectra/hero_alone.cl where directions hold for all wavelengths. */
#define hero_goes_alone(s, ratio)
