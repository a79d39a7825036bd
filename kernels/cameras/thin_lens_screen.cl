/* The middle of the lens: see film/screen.cl. */
#include "film/screen.cl"

vec2 thin_lens_screen(global const ThinLensCamera *camera, vec3 p, mask away, mask *seen)
{
    return pinhole_screen(camera->to_world, camera->extent, camera->offset, p, away, seen);
}
