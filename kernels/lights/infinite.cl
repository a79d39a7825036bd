/* Light of infinite lights, for paths that leave the scene. */
#include "generated/infinite_weight.cl"

/* Radiance along d of the infinite light in `row`, the same in all lanes, and the density of next-event estimation. */
inline void infinite_light(Scene scene, int row, vec3 p, Receiver receiver, vec3 d, Wavelengths lambdas,
                           Spectrum *radiance, real *pdf)
{
    LightRow l = light_at(scene, (integer)(row));
    LightView view = light_view(scene, (integer)(row), l, p, receiver.hemisphere);
    real pmf = light_pmf(scene, (integer)(row), l, p, receiver);
    infinite_case(scene, l, view.hemisphere, light_view_direction(view, d), lambdas, radiance, pdf);
    *pdf = with_openings(scene, l, p, receiver.hemisphere, d, *pdf) * pmf;
}

/* Radiance of a single infinite light for a path that leaves the scene along d [W m^-2 sr^-1 nm^-1], and its MIS weight
 * `w`. The direction was sampled with density `pdf` [1/sr] (below 0: delta) at a point p of a surface with `receiver`,
 * see lights/receiver.cl. The power heuristic weighs it against next-event estimation (Veach 1997, 9.2.4) and, by the
 * path's `mis_ratio`, against light paths (transport/mis_ratio.cl). */
inline Spectrum infinite_met(Scene scene, int row, vec3 p, Receiver receiver, vec3 d, real pdf, real mis_ratio,
                             Wavelengths lambdas, real *w)
{
    Spectrum radiance;
    real other;
    infinite_light(scene, row, p, receiver, d, lambdas, &radiance, &other);
    *w = infinite_weight(scene, row, p, d, pdf, other, mis_ratio);
    return radiance;
}

/* Step weight: the MIS weight of an infinite light, against next-event estimation and light paths. */
#include "generated/diffuse_roulette.cl"

inline real infinite_weight(Scene scene, int row, vec3 p, vec3 d, real pdf, real other, real mis_ratio)
{
    real emission = light_path_pdf(scene, (integer)(row), p, d, (real)(FAR), neg3(d));
    return mis_weight_of_three(pdf, other, after_diffuse_roulette(mis_ratio * emission, pdf));
}

/* Twin, where no light paths have MIS weights. */
inline real infinite_weight(Scene scene, int row, vec3 p, vec3 d, real pdf, real other, real mis_ratio)
{
    return sel(pdf < 0.0f, (real)(1.0f), mis_weight(pdf, other));
}
