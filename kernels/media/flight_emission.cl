/* Emission of homogeneous media along a flight. */
#include "generated/light_of_flight.cl"
#include "generated/body_weight.cl"

inline Spectrum flight_emission(Scene scene, mask flies, integer name, Medium m, real end, Wavelengths lambdas)
{
    return medium_emission(scene, sel_i(flies, name, (integer)(0)), m, end, lambdas);
}

/* Adds it to the radiance of the path. */
inline void flight_light(Scene scene, Slab path, uint at, mask flies, integer state, Spectrum light FLIGHT_ARGS)
{
    light = spectrum_mul(load_path_beta(path, at), emission_mis_weighted(scene, path, at, flies, light));
    store_path_radiance(path, at, flies, spectrum_add(load_path_radiance(path, at), light));
    flight_light_layers(scene, path, at, flies, state, light FLIGHT_PASSED);
}

/* Twin, where no medium emits. */
inline Spectrum flight_emission(Scene scene, mask flies, integer name, Medium m, real end, Wavelengths lambdas)
{
    return spectrum_of(0.0f);
}
inline void flight_light(Scene scene, Slab path, uint at, mask flies, integer state, Spectrum light FLIGHT_ARGS) {}
