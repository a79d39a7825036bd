/* Hero wavelength sampling (Wilkie et al. 2014). Where what is sampled depends on the wavelength, it is
 * sampled for the hero; but any of a path's four wavelengths might have been the hero, so the pdf that
 * counts is the mean of what the four would have: the balance heuristic between them, their eq. 8.
 * Vertex by vertex: `ratio` holds the pdf of the path so far at each wavelength over the mean of the
 * four, so the pdf of a direction is the mean of ratio p, and ratio becomes ratio p over that mean. A
 * direction that holds for the hero alone leaves (4, 0, 0, 0), and the path goes on with one wavelength.
 */


/* bsdf_sample, its pdf and weight those of the four together. A direction that is not finite has a pdf of 0, so that
 * the path ends: it would leave the scene, and no sky knows where. */
#include "generated/hero_steps.cl"
#include "generated/pair.cl"

inline BsdfSample hero_sample(Bsdf m, vec3 wo, vec3 u, Spectrum *ratio)
{
    BsdfSample s = bsdf_sample(m, wo, u);
    s.pdf = sel(dot3(s.wi, s.wi) < 4.0f, s.pdf, (real)(0.0f)); /* NaN fails the comparison */
    hero_weighs(m, wo, &s, ratio);
    hero_goes_alone(&s, ratio);
    pair_of_sample(m, wo, &s);
    return s;
}
