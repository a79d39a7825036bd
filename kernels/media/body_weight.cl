/* Emission gathered along a ray in a homogeneous medium, weighted (MIS) against next-event estimation. */
inline Spectrum emission_mis_weighted(Scene scene, Slab path, uint at, mask flies, Spectrum light)
{
    integer row = medium_light_row(scene, sel_i(flies, load_path_medium(path, at), (integer)(0)));
    real pdf = load_path_pdf(path, at);
    mask sought = flies & (row > 0) & (pdf >= 0.0f);
    if (any(sought)) {
        vec3 d = load_path_d(path, at), from = madd3(d, -load_path_null_distance(path, at), load_path_o(path, at));
        real own = body_light_pdf(scene, sel_i(sought, row - 1, (integer)(0)), from, path_receiver(path, at), d);
        light = spectrum_scale(light, sel(sought, mis_weight(pdf, own), (real)(1.0f)));
    }
    return light;
}

/* Twin, where no homogeneous medium is a light. */
inline Spectrum emission_mis_weighted(Scene scene, Slab path, uint at, mask flies, Spectrum light) { return light; }
