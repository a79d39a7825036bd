/* How photons are weighed against all other ways to find their paths: the numbers of transport/rivals.cl where a path
 * from the camera and a light path nearly meet. */
#define SHARP_PDF 8.0f /* [1/sr]; an even hemisphere has 0.16 */

inline mask rival_sharp(mask delta, real p, real p_back) { return delta | (max_r(p, p_back) > SHARP_PDF); }

/* The rival of a light path that leaves a photon, without the density of the material there. rival: what arrives;
 * cosine: to where the light comes from. */
inline real photon_rival(real rival, real cosine) { return rival / max_r(fabs(cosine), (real)(1e-7f)); }

/* The weight of merging. of_light: of the photon; of_camera: what arrives by the path from the camera, where the
 * material has densities p and p_back; number: light paths a sample; area: `merging_area` in
 * units of `settings->rival_area`. */
inline real photon_weight(real of_light, real of_camera, real number, real area, real p, real p_back)
{
    real light = of_light * number * p, camera = of_camera * p_back;
    return 1.0f / (1.0f + sqr(light / area) + sqr(camera / area));
}
