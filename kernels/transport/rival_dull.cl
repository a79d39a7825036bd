/* Roulette of light paths whose first surface is dull, where some aim at what is sharp: see transport/rivals.cl.
 *
 * The camera's paths find well what a dull surface sends on, as they choose the light there. So one of eight such light
 * paths goes on (integrator/steps/dull_goes_on.cl), and all that light paths do is an eighth as dense where the last
 * surface before the light is dull. Both sides tell that by p, the density with which a camera's path would go there to
 * the light [1/sr]; below 0 is a delta lobe. */
#define DULL_PDF 1.0f /* an even hemisphere has 0.16, a metal of roughness 0.2 has 2 */
#define DULL_SHARE 0.125f

inline mask is_dull(real p) { return (p >= 0.0f) & (p <= DULL_PDF); }

/* The density of light paths over that of a camera's path, whose last surface before the light has such a p. */
inline real rival_of_dull(real third, real p) { return third * sel(is_dull(p), (real)(DULL_SHARE), (real)(1.0f)); }

/* Twin, where all light paths go on from dull surfaces. */
#define rival_of_dull(third, p) (third)
