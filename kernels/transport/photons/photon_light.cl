/* What a photon brings to a path from the camera. */
#include "transport/photons/weight.cl"

/* In each lane that is `near`, without what the path carries. scale: weight, over the area of merging. */
inline Spectrum photon_light(Photon photon, mask near, BsdfPair pair, Spectrum ratio, real scale)
{
#if USES_DISPERSION /* the pdfs of both parts for each wavelength as the hero, over their mean */
    scale /= max_r(spectrum_mean(spectrum_mul(ratio, photon.ratio)), (real)(1e-20f));
#endif
    Spectrum light = spectrum_scale(spectrum_mul(pair.f, photon.power), scale);
    near = near & !rival_sharp(mask_of(0), pair.p, pair.p_back);
    return spectrum_sel(near & (spectrum_max(pair.f) > 0.0f), light, spectrum_of(0.0f));
}
