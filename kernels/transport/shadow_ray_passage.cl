/* What passes of light along a shadow ray where each wavelength is dimmed by itself. */
#include "shapes/shape.cl"
#include "generated/trace.cl"
#include "generated/transmittance.cl"
#include "generated/escape_light.cl"
#define ShadowPassage Spectrum
#define shadow_most(passes) spectrum_max(passes)
#define shadow_dims(light, passes) spectrum_mul(light, passes)
#define shadow_adds(light, passes, sum) spectrum_add(spectrum_mul(light, passes), sum)
