/* MIS weights of photons: the ratios of transport/mis_ratio.cl where a camera's path and a light path nearly meet. */
#define SPECULAR_PDF 8.0f /* [1/sr]; an even hemisphere has 0.16 */

inline mask mis_specular(mask delta, real p, real p_back) { return delta | (max_r(p, p_back) > SPECULAR_PDF); }

/* The mis_ratio of a photon, without the density of the material. mis_ratio: of its incident light path; cosine: to
 * the incident direction. */
inline real photon_mis_ratio(real mis_ratio, real cosine) { return mis_ratio / max_r(fabs(cosine), (real)(1e-7f)); }

/* The MIS weight of merging. of_light: mis_ratio of the photon; of_camera: incident mis_ratio of the camera's path; p,
 * p_back: densities of the material; number: light paths a sample; area: `merging_area` in units of
 * `settings->mis_area_unit`. */
inline real photon_weight(real of_light, real of_camera, real number, real area, real p, real p_back)
{
    real light = of_light * number * p, camera = of_camera * p_back;
    return 1.0f / (1.0f + sqr(light / area) + sqr(camera / area));
}

/* Step light: the light of a photon for a camera path in the lanes of `near`, without the path's throughput. scale: MIS
 * weight over the area of merging. */
inline Spectrum photon_light(Photon photon, mask near, BsdfPair pair, Spectrum ratio, real scale)
{
#if USES_DISPERSION /* the pdfs of both parts for each wavelength as the hero, over their mean */
    scale /= max_r(spectrum_mean(spectrum_mul(ratio, photon.ratio)), (real)(1e-20f));
#endif
    Spectrum light = spectrum_scale(spectrum_mul(pair.f, photon.power), scale);
    near = near & !mis_specular(mask_of(0), pair.p, pair.p_back);
    return spectrum_sel(near & (spectrum_max(pair.f) > 0.0f), light, spectrum_of(0.0f));
}
