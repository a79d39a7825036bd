/* Step. */
/* Light that a path from the camera meets, on surfaces that shine. */
#include "generated/met_weight.cl"
#include "generated/optical_length.cl"

/* Adds the emission of the surface to the `active` paths. Returns the paths that do not see this light: camera rays, if
 * `hide_lights` is set. They continue behind the light. */
inline mask add_emission(Scene scene, Slab path, uint at, mask active, Vertex v SHADE_ARGS)
{
    mask hidden = active & (v.s.light >= 0) & (v.depth == 0) & mask_of(scene.settings->hide_lights != 0);
    if (any(hidden)) hide_light(path, at, hidden, v);
    mask shows = active & (v.s.light >= 0) & light_shows(scene, v.s.light, v.front);
    mask lit = shows & !hidden & !left_to_flare(v.state, v.depth);
    if (any(lit)) {
        integer light = sel_i(lit, v.s.light, (integer)(0));
        real pdf = load_path_pdf(path, at), null_distance = load_path_null_distance(path, at);
        vec3 from = madd3(v.d, -null_distance, v.o);
        real other = light_pdf(scene, light, from, path_receiver(path, at), v.d, v.t + null_distance, v.s.n);
        real w = met_weight(scene, path, at, v, light, pdf, other);
        LightRow lamp = light_at(scene, light);
        TexturePoint point = area_lookup(lamp, surface_texture_point(v.s), neg3(v.d));
        Spectrum le = emission_load(scene, lamp.radiance, point, v.lambdas);
        le = spectrum_scale(spectrum_mul(v.beta, le), w);
        store_path_radiance(path, at, lit, spectrum_add(load_path_radiance(path, at), le));
        light_layers_add(scene, path, at, lit, v.depth, light, length_after(path, at, v.t), le LIGHT_LAYER_PASSED);
    }
    return hidden;
}

/* Twin, on surfaces that do not shine. */
inline mask add_emission(Scene scene, Slab path, uint at, mask active, Vertex v SHADE_ARGS) { return mask_of(0); }

/* Step weight: the weight of light that a path meets, against next-event estimation and against light paths. */
#include "generated/diffuse_roulette.cl"

inline real met_weight(Scene scene, Slab path, uint at, Vertex v, integer light, real pdf, real other)
{
    real emission = light_path_pdf(scene, light, v.o, v.d, v.t, v.s.n);
    return mis_weight_of_three(pdf, other, after_diffuse_roulette(path_mis_ratio(path, at, v.depth) * emission, pdf));
}

/* Twin, where paths are not weighed against light paths. */
inline real met_weight(Scene scene, Slab path, uint at, Vertex v, integer light, real pdf, real other)
{
    return sel(pdf < 0.0f, (real)(1.0f), mis_weight(pdf, other));
}

/* Step weight_escapes: the same where rays leave sealed media toward lamps, see media/escape.cl. */
inline real met_weight(Scene scene, Slab path, uint at, Vertex v, integer light, real pdf, real other)
{
    real sent = sel(v.depth > 0, max_r(-load_path_escape(path, at), (real)(0.0f)), (real)(0.0f));
    return sel(pdf < 0.0f, 1.0f / (1.0f + sent), mis_weight(pdf, other));
}
