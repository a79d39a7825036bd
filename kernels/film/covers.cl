/* The share of the background that a sample covers: 1, less the share of light that comes through from there, as a mean
 * over the wavelengths. Black smoke covers too. */
#include "lights/sky.cl#dimmed"

/* start: the throughput at the beginning of the path, which a lens weighs. */
inline real path_covers(Scene scene, Slab path, uint at, PathEnd end, Wavelengths lambdas, Spectrum start)
{
    mask through = end.missed & (end.depth == 0);
    Spectrum passes = sky_dimmed(scene, path, at, through, lambdas, load_path_beta(path, at));
    real whole = spectrum_mean(start), share = spectrum_mean(passes) / sel(whole > 0.0f, whole, (real)(1.0f));
    share = sel(whole > 0.0f, share, (real)(1.0f));
    return 1.0f - sel(through & (fabs(share) < FIXED_LARGEST), share, (real)(0.0f));
}

/* Twin, where the film has no alpha. */
inline real path_covers(Scene scene, Slab path, uint at, PathEnd end, Wavelengths lambdas, Spectrum start)
{
    return (real)(1.0f);
}
