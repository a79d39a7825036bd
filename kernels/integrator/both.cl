/* One vertex of a path from a light (which: 0) or from the camera (1), in one program: the surface that either meets is
 * loaded by the same instructions, as to compile them takes long. */
inline void integrator_vertex(Scene scene, Slab path, Slab hit, Slab shadow, uint at, mask active SHADE_ARGS,
                              uint which)
{
    Vertex v = vertex_load(scene, path, hit, at, active);
    if (which == 0) light_path_vertex(scene, path, shadow, at, active, v);
    else path_vertex(scene, path, shadow, at, scout_vertex(scene, path, at, active, v LAYER_PASSED), v SHADE_PASSED);
}
