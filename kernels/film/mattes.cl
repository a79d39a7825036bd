/* Adds the names of the objects and materials that the camera sees to mattes; points of media have none. */
inline void mattes_record(Scene scene, mask first, integer pixel_index, Vertex v LAYER_ARGS)
{
    if (BSDF_IS_PHASE) return;
    int object = scene.settings->matte_object, material = scene.settings->matte_material;
    if (object) mattes_add(scene, mattes, first, pixel_index, object - 1, v.object);
    if (material) mattes_add(scene, mattes, first, pixel_index, material - 1, v.material);
}

/* Twin, where there are none. */
inline void mattes_record(Scene scene, mask first, integer pixel_index, Vertex v LAYER_ARGS) {}
