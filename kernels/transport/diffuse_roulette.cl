/* Russian roulette of light paths at a first diffuse surface, in scenes with aimed light paths: see
 * transport/mis_ratio.cl.
 *
 * Next-event estimation of the camera's paths finds the light of a diffuse surface well. So an eighth of such light
 * paths continues (integrator/steps/dull_goes_on.cl), and the density of light paths is an eighth if the last surface
 * before the light is diffuse. Both sides decide by p, the density of the direction to the light for a camera's path
 * [1/sr]; below 0 is a delta lobe. */
#define DIFFUSE_PDF 1.0f /* an even hemisphere has 0.16, a metal of roughness 0.2 has 2 */
#define DIFFUSE_SHARE 0.125f

inline mask is_diffuse_pdf(real p) { return (p >= 0.0f) & (p <= DIFFUSE_PDF); }

/* The density ratio of light paths with the roulette; p: at the last surface before the light. */
inline real after_diffuse_roulette(real third, real p)
{
    return third * sel(is_diffuse_pdf(p), (real)(DIFFUSE_SHARE), (real)(1.0f));
}

/* Twin, where all light paths continue from diffuse surfaces. */
inline real after_diffuse_roulette(real third, real p) { return third; }
