/* The classic ray tracer (Whitted 1980): ambient and direct light, and one ray onward where a surface
 * mirrors: with the weight of a material's `reflectivity`, or as a delta material sends it. Direct
 * light comes from one light a sample, chosen at random, so several lights converge to their sum. */
void integrator_vertex(Scene scene, Slab path, Slab hit, Slab shadow, At at, mask active)
{
    global const Settings *settings = scene.settings;
    Vertex v = vertex_load(scene, path, hit, at, active);
    Surface s = v.s;
    Wavelengths lambdas = v.lambdas;
    Spectrum beta = v.beta, radiance = load_path_radiance(path, at);
    integer state = v.state, depth = v.depth;
#if USES_SURFACE_LIGHTS
    mask lit = active & (s.light >= 0) & light_shows(scene, s.light, v.front);
    if (any(lit)) {
        integer light = sel_i(lit, s.light, (integer)(0));
        Spectrum le = emission_load(scene, light_at(scene, light).radiance, surface_texture_point(s), lambdas);
        radiance = spectrum_sel(lit, spectrum_add(radiance, spectrum_mul(beta, le)), radiance);
    }
#endif
    Bsdf m = bsdf_load(scene, v.row, surface_texture_point(s), lambdas);
    ShadingFrame shading = shading_frame_load(scene, v.row, s, v.d, lambdas);
    Frame frame = shading.frame;
    vec3 wo = to_local(frame, neg3(v.d));
    Sampler sampler = pixel_sampler(settings, load_path_pixel_index(path, at), load_path_sample(path, at));
    natural dimension = as_natural(DIMENSION_VERTEX + depth * DIMENSIONS_A_VERTEX);
    vec2 choice = sampler_pair(sampler, dimension + DIMENSION_CHOICE);
    real mirror = BSDF_REFLECTIVITY(m);
#if BSDF_FLUORESCES
    lambdas = bsdf_shift(scene, v.row, m, lambdas, choice.y, depth); /* from here on, those by which light comes */
    store_path_lambdas(path, at, active, lambdas);
#endif

#if !BSDF_DELTA
    Spectrum own = spectrum_scale(beta, 1.0f - mirror);
    Spectrum ambient = emission_load(scene, (integer)(settings->ambient), surface_texture_point(s), lambdas);
    Spectrum everywhere = spectrum_mul(spectrum_mul(own, bsdf_albedo(m)), ambient);
    radiance = spectrum_sel(active, spectrum_add(radiance, everywhere), radiance);
#if USES_LIGHTS
    LightSample ls = light_sample(scene, s.p, vertex_side(frame, wo), choice.x, sampler_pair(sampler, dimension + DIMENSION_LIGHT), lambdas);
    Spectrum f = spectrum_scale(bsdf_eval(m, wo, to_local(frame, ls.wi)), shading_frame_share(shading, ls.wi));
    mask shine = active & (ls.pdf != 0.0f) & (spectrum_max(f) > 0.0f);
    Spectrum value = spectrum_scale(spectrum_mul(spectrum_mul(own, f), ls.radiance), 1.0f / sel(shine, fabs(ls.pdf), (real)(1.0f)));
    value = vertex_beyond(scene, v, ls.wi, ls.t, lambdas, value);
    shadow_toward(shadow, at, active, shine, s, ls, value);
    state += sel_i(shine, (integer)(PATH_SHADOW), (integer)(0));
#endif
    vec3 wi = reflect_z(wo);
    beta = spectrum_scale(beta, mirror);
    mask next = active & (mirror > 0.0f) & (wo.z > 0.0f);
#else
    vec2 uv = sampler_pair(sampler, dimension + DIMENSION_BSDF);
    Spectrum ratio = hero_ratio(path, at);
    BsdfSample bs = hero_sample(m, wo, v3(uv.x, uv.y, choice.y), &ratio);
    vec3 wi = bs.wi;
    beta = spectrum_mul(beta, bs.weight);
    mask next = active & (bs.pdf > 0.0f);
    hero_keep(path, at, next, ratio);
#endif
    next = next & (depth + 1 < settings->max_depth);
    vec3 onward = normalize3(to_world(frame, wi));
    beta = spectrum_scale(beta, shading_frame_share(shading, onward));
    store_path_radiance(path, at, active, radiance);
    vertex_leave(path, at, next, v, onward, beta);
    store_path_pdf(path, at, next, (real)(-1.0f));
    state = sel_i(next, state, state - (state & PATH_ALIVE)) + sel_i(active, (integer)(1), (integer)(0));
    store_path_state(path, at, active, state);
}
