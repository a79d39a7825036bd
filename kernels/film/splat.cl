/* Adding to pixels that the slot does not own: what a path from a light leaves where the camera sees it. */
#include "film/film.cl"

/* Returns how many sums are full, lane by lane. No sample is counted: the host knows how many paths there were. */
inline integer film_splat(global const Settings *settings, global uint *film, mask m, integer plane,
                          integer pixel_index, vec3 value)
{
    Exposure e = exposure_add(exposure_none(), sel3(m, value, v3(0.0f, 0.0f, 0.0f)));
    e.samples = 0;
    return film_add(settings, film, m, plane, pixel_index, e);
}
