/* Adding to pixels that the slot does not own: what a path from a light leaves where the camera sees it. */
#include "film/film.cl"

/* Returns how many sums are full, lane by lane. No sample is counted here: stage/emit.cl counts paths. */
inline integer film_splat(global const Settings *settings, global uint *film, mask m, integer plane,
                          integer pixel_index, vec3 value)
{
    value = sel3(m, value, v3(0.0f, 0.0f, 0.0f));
    Exposure e = {fixed_of(value.x), fixed_of(value.y), fixed_of(value.z), (natural)(0u)};
    return film_add(settings, film, m, plane, pixel_index, e);
}
