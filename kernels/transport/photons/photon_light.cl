/* The light of a photon for a camera's path. */
#include "transport/photons/weight.cl"

/* In the lanes of `near`, without the path's throughput. scale: MIS weight over the area of merging. */
inline Spectrum photon_light(Photon photon, mask near, BsdfPair pair, Spectrum ratio, real scale)
{
#if USES_DISPERSION /* the pdfs of both parts for each wavelength as the hero, over their mean */
    scale /= max_r(spectrum_mean(spectrum_mul(ratio, photon.ratio)), (real)(1e-20f));
#endif
    Spectrum light = spectrum_scale(spectrum_mul(pair.f, photon.power), scale);
    near = near & !mis_specular(mask_of(0), pair.p, pair.p_back);
    return spectrum_sel(near & (spectrum_max(pair.f) > 0.0f), light, spectrum_of(0.0f));
}
