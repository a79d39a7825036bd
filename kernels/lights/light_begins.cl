/* How densely light paths begin at a light that a path from p along wi meets at distance t: light_emit_pdf. n: the
 * normal there. *found: the density with which next-event estimation at p finds that point, light_found_pdf. */
inline real light_begins_pdf(Scene scene, integer row, vec3 p, Receiver receiver, vec3 wi, real t, vec3 n, real *found)
{
    *found = light_found_pdf(scene, row, p, receiver, wi, t, n);
    return light_emit_pdf(scene, row, wi, t);
}
