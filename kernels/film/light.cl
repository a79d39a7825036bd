/* What a film takes: the light of a sample, or of a path from a light. How it comes to pixels is in film/exposure.cl,
 * where a sample serves its own pixel, and in film/splatting.cl, where it serves all whose filters hold it. */
#include "film/film.cl"
#include "generated/bands.cl"

typedef struct {
    vec3 value;          /* of the film's three channels, times `scale` */
    int small;           /* whether all values are as fixed_of_small takes them */
    real covers;         /* how much of what is behind the picture the sample covers */
    Spectrum radiance;   /* for a film of bands, which takes `scale` times this */
    Wavelengths lambdas;
    real scale;
} Light;
