/* One vertex of a path from the camera: the light that is met, next-event estimation, and the direction to go on.
 * Light is found both by meeting it and by choosing it; the two are weighted by the power heuristic (Veach 1997,
 * 9.2.4), and against paths from lights where there are some (lighting/rivals.cl). */
#include "path/met_light.cl"
#include "generated/rivals.cl"
#include "generated/gather.cl"
#include "generated/guide.cl"
#include "generated/layers.cl"
#include "generated/light_layers.cl"

inline void path_vertex(Scene scene, Slab path, Slab shadow, uint at, mask active, Vertex v SHADE_ARGS)
{
    global const Settings *settings = scene.settings;
    Surface s = v.s;
    Spectrum beta = v.beta, ratio = load_path_ratio(path, at);
    integer state = v.state, depth = v.depth;

    /* The light that this ray has met; the camera's ray goes on behind one that is to be hidden. */
    mask hidden = mask_of(0);
#if BSDF_SHINES
    hidden = active & (s.light >= 0) & (depth == 0) & mask_of(settings->hide_lights != 0);
    if (any(hidden)) {
        store_path_o(path, at, hidden, surface_offset(s, v.d));
        store_path_pdf(path, at, hidden, load_path_pdf(path, at) + v.t);
        store_path_cone(path, at, hidden, cone_word(v.cone));
#if WEIGHS_LIGHT_PATHS /* the light is in the way of what light paths bring to the camera */
        store_path_rival(path, at, hidden, (real)(0.0f));
#endif
    }
    mask lit = active & (s.light >= 0) & light_shows(scene, s.light, v.front) & !hidden;
#if LIT_GHOSTS /* which light paths bring, see stage/flare.cl */
    lit = lit & !((depth == 0) & ((state & PATH_GHOST) != 0));
#endif
    if (any(lit)) {
        integer light = sel_i(lit, s.light, (integer)(0));
        real pdf = load_path_pdf(path, at), null_distance = load_path_null_distance(path, at);
        vec3 from = madd3(v.d, -null_distance, v.o), side = path_hemisphere(path, at);
        real other = light_pdf(scene, light, from, side, v.d, v.t + null_distance, s.n);
        real w = sel(pdf < 0.0f, (real)(1.0f), mis_weight(pdf, other));
#if WEIGHS_LIGHT_PATHS
        real emission = light_path_pdf(scene, light, v.o, v.d, v.t, s.n);
        w = mis_weight_of_three(pdf, other, path_rival(path, at, depth) * emission);
#endif
        Spectrum le = emission_load(scene, light_at(scene, light).radiance, surface_texture_point(s), v.lambdas);
        le = spectrum_scale(spectrum_mul(beta, le), w);
        store_path_radiance(path, at, lit, spectrum_add(load_path_radiance(path, at), le));
#if LIGHT_LAYERS
        light_layers_add(scene, path, at, lit, depth, light, le, light_layers);
#endif
    }
#endif
    mask met = active & !hidden, next = met;
#if !BSDF_IS_PANE /* of which the lobe tells */
    next = next & vertex_continues(scene, v, vertex_is_null((integer)(0)));
#endif

    Sampler sampler = pixel_sampler(settings, load_path_pixel_key(path, at), load_path_sample(path, at));
    Scattering scatter = vertex_scattering(scene, path, at, met, v, sampler);
    Bsdf m = scatter.bsdf;
    Frame frame = scatter.shading.frame;
    vec3 wo = scatter.wo;
#if USES_LAYERS && !BSDF_IS_NULL && !BSDF_IS_PANE
    state = layers_record(scene, path, at, LAYER_PASSED, met, v, scatter, state);
#endif
#if BSDF_ABSORBS /* as the surfaces of lights mostly do */
    next = next & (spectrum_max(bsdf_albedo(m)) > 0.0f);
#endif
#if WEIGHS_LIGHT_PATHS && !BSDF_IS_NULL
    Rival rival = rival_of_camera(scene, path, at, v, sampler);
#endif
#if BSDF_MERGES
    mask merges = met & merging_here(state, depth);
    if (any(merges)) {
        integer sample = load_path_sample(path, at);
        Spectrum merged = merge_photons(scene, merges, v, scatter, rival, ratio, sample MERGE_PASSED);
#if LIGHT_LAYERS /* by something sharp, so it has met two surfaces; no groups */
        Spectrum light = spectrum_mul(beta, merged);
        light_layers_add(scene, path, at, merges, (integer)(2), (integer)(0), light, light_layers);
#endif
        merged = spectrum_add(load_path_radiance(path, at), spectrum_mul(beta, merged));
        store_path_radiance(path, at, merges, merged);
    }
#endif

#if BSDF_GUIDED
    Guided guided = guide_at(scene, guide, s, v.d);
#endif
#if USES_LIGHTS && !BSDF_DELTA
    /* Next-event estimation. */
    vec3 hemisphere = vertex_hemisphere(frame, wo);
    vec2 point = sampler_pair(sampler, scatter.dimension + DIMENSION_LIGHT);
    LightSample ls = light_sample_nothing();
#if BSDF_IS_PHASE && SEALED_MEDIA
    mask sealed = (v.medium & MEDIUM_SEALED) != 0;
    if (any(next & !sealed))
#elif BSDF_ABSORBS
    if (any(next))
#endif
        ls = light_sample(scene, s.p, hemisphere, scatter.choice.x, point, scatter.lambdas);
    vec3 wi = to_local(frame, ls.wi);
    Spectrum f = spectrum_scale(bsdf_eval(m, wo, wi), shading_frame_share(scatter.shading, ls.wi));
#if WEIGHS_LIGHT_PATHS
    real p = rival_pdf(m, wo, wi);
    real third = rival_of_light_sample(scene, rival, s, ls, p, rival_pdf(m, wi, wo));
    real w = mis_weight_of_three(ls.pdf, p, third);
#elif BSDF_GUIDED
    real p = guide_pdf(guide, guided, ls.wi, hero_pdf(m, wo, wi, ratio));
    real w = sel(ls.pdf < 0.0f, (real)(1.0f), mis_weight(ls.pdf, p));
#else
    real w = sel(ls.pdf < 0.0f, (real)(1.0f), mis_weight(ls.pdf, hero_pdf(m, wo, wi, ratio)));
#endif
    mask shine = next & (ls.pdf != 0.0f) & (spectrum_max(f) > 0.0f);
#if BSDF_IS_PHASE && SEALED_MEDIA
    shine = shine & !sealed;
#endif
    w = w / sel(shine, fabs(ls.pdf), (real)(1.0f));
    Spectrum value = spectrum_scale(spectrum_mul(spectrum_mul(beta, f), ls.radiance), w);
    value = vertex_beyond(scene, v, ls.wi, ls.t, scatter.lambdas, value);
    state += sel_i(shine, (integer)(PATH_SHADOW), (integer)(0));
#endif

    /* The next direction. */
    vec2 uv = sampler_pair(sampler, scatter.dimension + DIMENSION_BSDF);
#if BSDF_GUIDED
    real pick = sampler_pair(sampler, scatter.dimension + DIMENSION_CHOICE).y;
    BsdfSample bs = guide_sample(guide, guided, m, frame, wo, uv, pick, &ratio);
#else
    BsdfSample bs = hero_sample(m, wo, v3(uv.x, uv.y, scatter.choice.y), &ratio);
#endif
#if USES_LIGHTS && !BSDF_DELTA /* after the sample: between them compilers would read tables of materials again */
    shadow_toward(shadow, at, active, shine, s, ls, value);
#if LIGHT_LAYER_GROUPS
    store_path_light(path, at, shine, ls.row);
#endif
#if BRICK_LIGHTS
    store_shadow_into(shadow, at, shine, brick_medium(scene, sel_i(shine, ls.row, (integer)(0))));
#endif
#if SHADOW_MEDIA
#if USES_BODIES
    store_shadow_through(shadow, at, shine, bodies_beyond(v.bodies, dot3(s.n, ls.wi) < 0.0f));
#else
    store_shadow_through(shadow, at, shine, vertex_medium(v, ls.wi));
#endif
#endif
#endif
    mask null = vertex_is_null(bs.lobe);
    next = next & (bs.pdf > 0.0f);
#if BSDF_IS_PANE
    next = next & vertex_continues(scene, v, null);
#if USES_LAYERS
    state = layers_record(scene, path, at, LAYER_PASSED, met & !null, v, scatter, state);
#endif
#endif
    vec3 onward = normalize3(to_world(frame, bs.wi));
    beta = spectrum_scale(spectrum_mul(beta, bs.weight), shading_frame_share(scatter.shading, onward));
    real eta = load_path_eta(path, at) * bs.eta;

#if !BSDF_IS_NULL /* Russian roulette. */
    mask play = !null & (depth + 1 >= settings->rr_depth);
    real strength = spectrum_max(beta);
    next = next & (strength > 0.0f);
#if BSDF_GUIDED
    real brings = spectrum_max(spectrum_mul(v.beta, bsdf_albedo(m)));
    real chance = sampler_pair(sampler, scatter.dimension + DIMENSION_ROULETTE).x;
    play = play & !guide_roulette(path, at, guided, brings, chance, &next, &beta);
#endif
    if (any(next & play)) {
        vec2 u = sampler_pair(sampler, scatter.dimension + DIMENSION_ROULETTE);
        next = roulette(next, play, strength * eta * eta, u.x, &beta);
    }
#endif

    vertex_leave(path, at, next, null, v, onward, beta);
    store_path_cone(path, at, next, cone_scattered(v.cone, bs.pdf, (bs.lobe & LOBE_DELTA) != 0));
#if !BSDF_IS_NULL
    mask scatters = next & !null;
    path_scattered(path, at, scatters);
    mask delta = (bs.lobe & LOBE_DELTA) != 0;
#if USES_LIGHTS && BSDF_IS_PHASE && SEALED_MEDIA /* light that is met has its whole weight */
    delta = delta | sealed;
#endif
#if WEIGHS_LIGHT_PATHS
    bs.pdf = rival_pdf(m, wo, bs.wi);
    real p_back = rival_pdf(m, bs.wi, wo);
    store_path_rival(path, at, scatters, rival_to_light(rival, s, onward, delta, bs.pdf, p_back));
#if MERGES
    state -= sel_i(rival_sharp(delta, bs.pdf, p_back), (integer)(0), state & PATH_SHARP);
    store_path_pending(path, at, scatters, rival_pending(rival, s, onward, delta, bs.pdf, p_back));
#endif
#endif
    store_path_pdf(path, at, scatters, sel(delta, (real)(-1.0f), bs.pdf));
#if USES_HEMISPHERE && !BSDF_DELTA
    store_path_sampled_hemisphere(path, at, next, hemisphere);
#endif
#endif
    store_path_eta(path, at, next, eta);
    store_path_ratio(path, at, next, ratio);
    vertex_end(path, at, met, next, null, state);
}

#if !SHADES_BOTH
void integrator_vertex(Scene scene, Slab path, Slab hit, Slab shadow, uint at, mask active SHADE_ARGS)
{
    Vertex v = vertex_load(scene, path, hit, at, active);
    path_vertex(scene, path, shadow, at, active, v SHADE_PASSED);
}
#endif
