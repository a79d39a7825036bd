/* Parallel rays: what is infinitely far is nowhere on the film. */
#include "film/screen.cl"

vec2 orthographic_screen(global const OrthographicCamera *camera, vec3 p, mask away, mask *seen)
{
    vec3 d = screen_point_back(camera->to_world, p);
    *seen = *seen & !away;
    vec2 film = {0.5f - 0.5f * d.x, 0.5f - 0.5f * d.y / camera->aspect};
    return film;
}
