/* What Path.state holds: depth in bits 0 to 11, flags, and the number of shadow rays in bits 16 to 27; and the
 * dimensions of a sample. */
#include "generated/path_bits.cl"
#define PATH_DEPTH 0x0fff
#define PATH_SHADOW 0x10000
#define PATH_SEEN 0x10000000 /* layers for denoisers have the path, see film/layers_record.cl */
#define PATH_GHOST 0x20000000 /* of a lens's samples, of light that two of its surfaces have reflected */

/* A null surface (a hole of a mask, a boundary that neither bends nor scatters, with FREE_PANES thin glass where light
 * goes straight through it) is no step of a path: it adds nothing to the depth. A path crosses this many of them, and
 * then ends; a shadow ray that meets more is blocked. */
#define MOST_NULL_SURFACES 1024

/* Dimensions of a sample, in pairs: even ones and the next are well spread together. Film and first point on a light,
 * then DIMENSIONS_A_VERTEX per surface that is met, null ones among them, a direction beside the next point on a light;
 * beyond these lens, wavelength and time, and DIMENSION_TEXEL, _FLIGHT and _AIM, one pair per surface each. */
#define DIMENSION_FILM 0
#define DIMENSION_VERTEX 1
#define DIMENSIONS_A_VERTEX 4
#define DIMENSION_LIGHT 0    /* a point on a light */
#define DIMENSION_CHOICE 1   /* which light, which lobe */
#define DIMENSION_ROULETTE 2 /* whether to go on; which part of a mixture */
#define DIMENSION_BSDF 3     /* a direction */
#define DIMENSION_LENS 0x50000
#define DIMENSION_WAVELENGTH 0x50001
#define DIMENSION_LIGHT_TIME (DIMENSION_VERTEX + DIMENSION_BSDF) /* of a light path, whose first vertex has no BSDF */
#define DIMENSION_TEXEL 0x10000 /* which texel stands for those around */
#define DIMENSION_FLIGHT 0x20000 /* how far a ray flies through a medium */
#define DIMENSION_AIM 0x30000 /* near which lamp */

/* To weigh a light that a ray has met, the pdf of the ray's direction counts, and the point where it was chosen: that
 * lies `null_distance` [m] before the ray's origin if the path has crossed null boundaries since. */
#define path_scattered(path, at, m) store_path_null_distance(path, at, m, (real)(0.0f))
