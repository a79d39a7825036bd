/* Adds the light of photons around a vertex, where they are merged. A GPU then reads throughput and wavelengths again,
 * in a slot that compilers do not know to be `at`: else they keep them in registers while photons are weighed. */
inline void merge_at_vertex(Scene scene, Slab path, uint at, mask met, Vertex *v, Scattering *scatter,
                            MisRatio mis_ratio, Spectrum ratio SHADE_ARGS)
{
    mask merges = met & merging_here(v->state, v->depth);
    if (any(merges)) {
        integer sample = load_path_sample(path, at);
        Spectrum merged = merge_photons(scene, merges, *v, *scatter, mis_ratio, ratio, sample MERGE_PASSED);
        if (LANES == 1) {
            uint again = at + (scene.settings->max_depth < 0);
            scatter->lambdas = load_path_lambdas(path, again);
            if (!BSDF_FLUORESCES) v->lambdas = scatter->lambdas;
            v->beta = load_path_beta(path, again);
            v->beta = vertex_arriving(scene, path, again, merges, *v);
        }
        /* This light has been at a specular vertex and at this vertex, so its depth is 2. Its group is unknown. */
        light_layers_add(scene, path, at, merges, (integer)(2), (integer)(0), (real)(0.0f),
                         spectrum_mul(v->beta, merged) LIGHT_LAYER_PASSED);
        merged = spectrum_add(load_path_radiance(path, at), spectrum_mul(v->beta, merged));
        store_path_radiance(path, at, merges, merged);
    }
}

/* Twin, where no photons are merged. */
inline void merge_at_vertex(Scene scene, Slab path, uint at, mask met, Vertex *v, Scattering *scatter,
                            MisRatio mis_ratio, Spectrum ratio SHADE_ARGS) {}
