/* Adds what paths gather that left the scene to layers of light, light by light. */
#include "generated/light_layer_args.cl"

/* Step. */
inline void sky_layers(Scene scene, Slab path, uint at, PathEnd end, Wavelengths lambdas LIGHT_LAYER_ARGS)
{
    SkyView v = sky_view(scene, path, at, end);
    if (!any(v.seen)) return;
    Spectrum beta = sky_dimmed(scene, path, at, v.seen, lambdas, load_path_beta(path, at));
    for (int row = 0; row < scene.settings->infinite_count; row++) {
        real w;
        Spectrum radiance = infinite_met(scene, row, v.from, v.receiver, v.d, v.pdf, v.mis_ratio, lambdas, &w);
        Spectrum light = spectrum_mul(beta, spectrum_scale(radiance, w));
        light_layers_add(scene, path, at, v.seen, end.depth, (integer)(row), light LIGHT_LAYER_PASSED);
    }
}

/* Twin, where there are no layers of light, or none comes from all around. */
inline void sky_layers(Scene scene, Slab path, uint at, PathEnd end, Wavelengths lambdas LIGHT_LAYER_ARGS) {}
