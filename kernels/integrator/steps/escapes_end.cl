/* At other surfaces: a path that goes on from there is none that leaves a sealed medium, see media/escape.cl. */
inline integer path_escapes(Scene scene, Slab path, Slab shadow, uint at, mask next, Vertex v, Scattering scatter,
                            BsdfSample bs, vec3 onward)
{
    store_path_escape(path, at, next, (real)(0.0f));
    store_path_escape_width(path, at, next, (real)(0.0f));
    return 0;
}
