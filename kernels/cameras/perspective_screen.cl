/* A pinhole: see film/screen.cl. */
#include "film/screen.cl"

vec2 perspective_screen(global const PerspectiveCamera *camera, vec3 p, mask away, mask *seen)
{
    return pinhole_screen(camera->to_world, camera->extent, camera->offset, p, away, seen);
}
