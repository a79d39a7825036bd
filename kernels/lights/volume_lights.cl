/* Lights that are parts of media. */

/* The medium that a row of `lights` is a brick or all of, 0 for any other light. */
inline integer volume_medium(Scene scene, integer row)
{
    LightRow l = light_at(scene, row);
    mask part = l.kind >= LIGHT_VOLUMES;
    integer medium = gather_i(scene.light_params, sel_i(part, l.params, (integer)(0)));
    return sel_i(part, medium, (integer)(0));
}
