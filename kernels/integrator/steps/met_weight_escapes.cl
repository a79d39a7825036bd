/* Stands for integrator/steps/met_weight.cl where rays leave sealed media toward lamps, see media/escape.cl. */
inline real met_weight(Scene scene, Slab path, uint at, Vertex v, integer light, real pdf, real other)
{
    real sent = sel(v.depth > 0, max_r(-load_path_escape(path, at), (real)(0.0f)), (real)(0.0f));
    return sel(pdf < 0.0f, 1.0f / (1.0f + sent), mis_weight(pdf, other));
}
