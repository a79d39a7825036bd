/* Light of infinite lights for paths that have left the scene. */
#include "lights/light.cl#met"
#include "generated/light_layers.cl"
#include "lights/sky.cl#dimmed"

typedef struct {
    vec3 from, d; /* the origin where d was sampled */
    Receiver receiver; /* the receiver there */
    real pdf, mis_ratio;
    Wavelengths lambdas;
} SkyView;

inline mask sky_seen(Scene scene, PathEnd end)
{
    mask seen = end.missed & ((end.depth > 0) | mask_of(scene.settings->hide_lights + scene.settings->alpha == 0));
    return seen & !left_to_flare(end.state, end.depth);
}

inline SkyView sky_view(Scene scene, Slab path, uint at, mask seen, PathEnd end)
{
    SkyView v;
    v.pdf = load_path_pdf(path, at);
    v.d = sel3(seen, load_path_d(path, at), v3(0.0f, 0.0f, 1.0f)); /* a slot without a pixel has no direction */
    v.from = madd3(v.d, -load_path_null_distance(path, at), load_path_o(path, at));
    v.receiver = path_receiver(path, at);
    v.mis_ratio = path_mis_ratio(path, at, end.depth);
    v.lambdas = load_path_lambdas(path, at);
    return v;
}

/* The radiance of paths, plus the light of infinite lights for paths that left the scene. A GPU reads a path again for
 * each light: its compilers keep what they know to be the same for all lights, and what follows from it, in registers.
 * They do not know that every row is below light_count. */
inline Spectrum sky_gather(Scene scene, Slab path, uint at, PathEnd end)
{
    mask seen = sky_seen(scene, end);
    Spectrum arrives = spectrum_of((real)(0.0f));
    if (any(seen)) {
        for (int row = 0; row < scene.settings->infinite_count; row++) {
            uint again = LANES > 1 || row < scene.settings->light_count ? at : 0u;
            SkyView v = sky_view(scene, path, again, seen, end);
            real w;
            Spectrum radiance = infinite_met(scene, row, v.from, v.receiver, v.d, v.pdf, v.mis_ratio, v.lambdas, &w);
            arrives = spectrum_madd(radiance, w, arrives);
        }
        arrives = sky_dimmed(scene, path, at, seen, load_path_lambdas(path, at), arrives);
        arrives = spectrum_mul(load_path_beta(path, at), arrives);
    }
    Spectrum radiance = load_path_radiance(path, at);
    return spectrum_sel(seen, spectrum_add(radiance, arrives), radiance);
}

/* Beginning paths takes longer, as they gather light: lanes wait for others. */
inline int sky_due(PathEnd end) { return path_end_of_half(end); }

/* Twin, in a scene without infinite lights. */
inline Spectrum sky_gather(Scene scene, Slab path, uint at, PathEnd end) { return load_path_radiance(path, at); }
inline int sky_due(PathEnd end) { return any(end.ended); }

/* Step dimmed: the transmittance of the medium around the scene for infinite lights. */

/* `light` of infinity at the origin of the paths' last rays. */
inline Spectrum sky_dimmed(Scene scene, Slab path, uint at, mask seen, Wavelengths lambdas, Spectrum light)
{
#if USES_ABSORPTION
    integer medium = sel_i(seen, medium_left(load_path_medium(path, at)), (integer)(0));
    light = spectrum_mul(light, medium_transmittance(scene, medium, (real)(FAR), lambdas));
#endif
    return light;
}

/* Step layers: adds the light of each infinite light to its light layer, for paths that left the scene. */
#include "generated/light_layer_args.cl"

inline void sky_layers(Scene scene, Slab path, uint at, PathEnd end, Wavelengths lambdas LIGHT_LAYER_ARGS)
{
    mask seen = sky_seen(scene, end);
    if (!any(seen)) return;
    SkyView v = sky_view(scene, path, at, seen, end);
    Spectrum beta = sky_dimmed(scene, path, at, seen, lambdas, load_path_beta(path, at));
    for (int row = 0; row < scene.settings->infinite_count; row++) {
        real w;
        Spectrum radiance = infinite_met(scene, row, v.from, v.receiver, v.d, v.pdf, v.mis_ratio, lambdas, &w);
        Spectrum light = spectrum_mul(beta, spectrum_scale(radiance, w));
        light_layers_add(scene, path, at, seen, end.depth, (integer)(row), (real)(FAR), light LIGHT_LAYER_PASSED);
    }
}

/* Twin, where the film has no light layers or the scene no infinite lights. */
#include "generated/light_layer_args.cl"

inline void sky_layers(Scene scene, Slab path, uint at, PathEnd end, Wavelengths lambdas LIGHT_LAYER_ARGS) {}
