/* The classic ray tracer (Whitted 1980): ambient and direct light, and a ray onward where a surface mirrors: with the
 * weight of a material's `reflectivity`, or as a delta material sends it. Direct light comes from a light a sample,
 * chosen at random, so several lights converge to their sum. */
/* `radiance` with the light of surfaces that are met. */
inline Spectrum whitted_emission(Scene scene, mask active, Vertex v, Spectrum radiance)
{
    mask lit = active & (v.s.light >= 0) & light_shows(scene, v.s.light, v.front);
    if (any(lit)) {
        integer light = sel_i(lit, v.s.light, (integer)(0));
        LightRow lamp = light_at(scene, light);
        TexturePoint point = area_lookup(lamp, surface_texture_point(v.s), neg3(v.d));
        Spectrum le = emission_load(scene, lamp.radiance, point, v.lambdas);
        radiance = spectrum_sel(lit, spectrum_add(radiance, spectrum_mul(v.beta, le)), radiance);
    }
    return radiance;
}

#if USES_LIGHTS
/* Puts a ray to a light into the shadow slab; own: the throughput of light that is not mirrored. Returns the gain
 * of the path's state. */
inline integer whitted_light(Scene scene, Slab shadow, uint at, mask active, Vertex v, Scattering scatter, Spectrum own)
{
    Frame frame = scatter.shading.frame;
    vec2 point = sampler_pair(scatter.sampler, scatter.dimension + DIMENSION_LIGHT);
    Receiver receiver = vertex_receiver(scene, v, scatter, neg3(v.d));
    LightSample ls = common_light_sample(scene, v.s.p, receiver, scatter.choice.x, point, scatter.lambdas);
    Spectrum f = bsdf_eval(scatter.bsdf, scatter.wo, to_frame(frame, ls.wi));
    f = spectrum_scale(f, shading_frame_share(scatter.shading, ls.wi));
    mask shine = active & (ls.pdf != 0.0f) & (spectrum_max(f) > 0.0f);
    real w = 1.0f / sel(shine, fabs(ls.pdf), (real)(1.0f));
    Spectrum value = spectrum_scale(spectrum_mul(spectrum_mul(own, f), ls.radiance), w);
    value = vertex_beyond(scene, v, ls.wi, ls.t, scatter.lambdas, value);
    store_shadow_t(shadow, at, active, sel(shine, shadow_aim(shadow, at, shine, v.s, ls.wi, ls.t), (real)(-1.0f)));
    store_shadow_value(shadow, at, shine, value);
    store_shadow_into(shadow, at, shine, volume_medium(scene, sel_i(shine, ls.row, (integer)(0))));
    store_shadow_through(shadow, at, shine, vertex_through(v, ls.wi));
    return sel_i(shine, (integer)(PATH_SHADOW), (integer)(0));
}
#endif

/* Step vertex: the whole vertex. */
inline void integrator_vertex(Scene scene, Slab path, Slab hit, Slab shadow, uint at, mask active)
{
    global const Settings *settings = scene.settings;
    Vertex v = vertex_load(scene, path, hit, at, active);
    Surface s = v.s;
    Spectrum beta = v.beta, radiance = load_path_radiance(path, at);
    integer state = v.state, depth = v.depth;
    if (BSDF_SHINES) radiance = whitted_emission(scene, active, v, radiance);
    Sampler sampler = pixel_sampler(settings, load_path_pixel_key(path, at), load_path_sample(path, at));
    Scattering scatter = vertex_scattering(scene, path, at, active, v, sampler);
    Bsdf m = scatter.bsdf;
    Frame frame = scatter.shading.frame;
    vec3 wo = scatter.wo;
    real mirror = BSDF_REFLECTIVITY(m);

#if !BSDF_DELTA
    Spectrum own = spectrum_scale(beta, 1.0f - mirror);
    Spectrum ambient = emission_load(scene, (integer)(settings->ambient), surface_texture_point(s), scatter.lambdas);
    Spectrum everywhere = spectrum_mul(spectrum_mul(own, bsdf_albedo(m)), ambient);
    radiance = spectrum_sel(active, spectrum_add(radiance, everywhere), radiance);
#if USES_LIGHTS
    state += whitted_light(scene, shadow, at, active, v, scatter, own);
#endif
    vec3 wi = reflect_z(wo);
    beta = spectrum_scale(beta, mirror);
    mask next = active & (mirror > 0.0f) & (wo.z > 0.0f);
#else
    vec2 uv = sampler_pair(sampler, scatter.dimension + DIMENSION_BSDF);
    Spectrum ratio = load_path_ratio(path, at);
    BsdfSample bs = hero_sample(m, wo, v3(uv.x, uv.y, scatter.choice.y), &ratio);
    vec3 wi = bs.wi;
    beta = spectrum_mul(beta, bs.weight);
    mask next = active & (bs.pdf > 0.0f);
    store_path_ratio(path, at, next, ratio);
#endif
    mask null = vertex_is_null((integer)(0));
    next = next & vertex_continues(scene, v, null);
    vec3 onward = normalize3(to_world(frame, wi));
    beta = spectrum_scale(beta, shading_frame_share(scatter.shading, onward));
    store_path_radiance(path, at, active, radiance);
    vertex_leave(path, at, next, null, v, onward, beta);
    store_path_cone(path, at, next, cone_word(v.cone));
    if (!BSDF_IS_NULL) store_path_pdf(path, at, next, (real)(-1.0f));
    vertex_end(path, at, active, next, null, state);
}
