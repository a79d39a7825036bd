/* The throughput that arrives at a vertex, after the transmittance of the incident medium. */
inline Spectrum vertex_arriving(Scene scene, Slab path, uint at, mask active, Vertex v)
{
    real through = v.t + sel(active, load_path_ray_offset(path, at), (real)(0.0f));
    Spectrum left = medium_transmittance(scene, medium_left(v.media.medium), through, v.lambdas);
    return spectrum_mul(v.beta, left);
}

/* Whether w leads to the interior of the shape: the normal of a two-sided shape is turned to the viewer. */
inline mask vertex_inward(Vertex v, vec3 w)
{
    mask crosses = dot3(v.s.n, w) * dot3(v.s.n, v.d) > 0.0f;
    return sel_i(crosses, v.front, !v.front);
}

/* `value` times the transmittance of t metres along w away from the vertex. */
inline integer vertex_medium(Vertex v, vec3 w);
inline Spectrum vertex_beyond(Scene scene, Vertex v, vec3 w, real t, Wavelengths lambdas, Spectrum value)
{
    return medium_dims(scene, vertex_medium(v, w), t, lambdas, value);
}
