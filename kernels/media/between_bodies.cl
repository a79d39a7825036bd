/* The exterior index of a dielectric among overlapping bodies: the index of the body of highest priority there. */
inline void bsdf_between_bodies(Scene scene, mask active, Vertex v, Bsdf *m)
{
    integer index = body_word(scene, v.media.bodies.next, 1);
    mask known = active & (v.media.bodies.next != 0) & (index != 0);
    if (any(known)) {
        Spectrum outside = body_index(scene, sel_i(known, index, (integer)(0)), texture_point_nowhere(), v.lambdas);
        m->ext_ior = spectrum_sel(known, outside, m->ext_ior);
    }
}

/* Twin, where a material keeps its own exterior index. */
inline void bsdf_between_bodies(Scene scene, mask active, Vertex v, Bsdf *m) {}
