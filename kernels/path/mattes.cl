/* Adds the names of the objects and materials that the camera sees to mattes; points of media have none. */
inline void mattes_record(global uint *mattes, mask first, integer pixel_index, Vertex v)
{
    if (BSDF_IS_PHASE) return;
    if (MATTE_OBJECT) mattes_add(mattes, first, pixel_index, MATTE_OBJECT - 1, v.object);
    if (MATTE_MATERIAL) mattes_add(mattes, first, pixel_index, MATTE_MATERIAL - 1, v.material);
}
