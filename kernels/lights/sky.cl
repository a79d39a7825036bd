/* Light from all around, which paths find that have left the scene. */
#include "lights/met_light.cl"
#include "generated/light_layers.cl"
#include "lights/sky_dimmed.cl"

typedef struct {
    mask seen;
    vec3 from, d; /* where d was chosen */
    Receiver receiver; /* by what of it */
    real pdf, mis_ratio;
} SkyView;

inline SkyView sky_view(Scene scene, Slab path, uint at, PathEnd end)
{
    SkyView v;
    v.seen = end.missed & ((end.depth > 0) | mask_of(scene.settings->hide_lights + scene.settings->alpha == 0));
    v.seen = v.seen & !left_to_flare(end.state, end.depth);
    v.pdf = load_path_pdf(path, at);
    v.d = sel3(v.seen, load_path_d(path, at), v3(0.0f, 0.0f, 1.0f)); /* a slot without a pixel has none */
    v.from = madd3(v.d, -load_path_null_distance(path, at), load_path_o(path, at));
    v.receiver = path_receiver(path, at);
    v.mis_ratio = path_mis_ratio(path, at, end.depth);
    return v;
}

/* `radiance` of paths, with what those that left the scene find there. */
inline Spectrum sky_gather(Scene scene, Slab path, uint at, PathEnd end, Wavelengths lambdas, Spectrum radiance)
{
    SkyView v = sky_view(scene, path, at, end);
    if (any(v.seen)) {
        Spectrum arrives = infinite_gather(scene, v.from, v.receiver, v.d, v.pdf, v.mis_ratio, lambdas);
        arrives = sky_dimmed(scene, path, at, v.seen, lambdas, arrives);
        Spectrum sum = spectrum_add(radiance, spectrum_mul(load_path_beta(path, at), arrives));
        radiance = spectrum_sel(v.seen, sum, radiance);
    }
    return radiance;
}

/* To begin paths takes longer, as light is gathered there: lanes wait for others. */
inline int sky_due(PathEnd end) { return path_end_of_half(end); }

/* Twin, in a scene without light from all around. */
inline Spectrum sky_gather(Scene scene, Slab path, uint at, PathEnd end, Wavelengths lambdas, Spectrum radiance)
{
    return radiance;
}
inline int sky_due(PathEnd end) { return any(end.ended); }
