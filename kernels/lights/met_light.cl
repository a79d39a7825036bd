/* What a path from the camera tells of a light that it meets. */

#include "generated/kept_hemisphere.cl"

/* What light paths do, over the path's own density (transport/rivals.cl): nothing where the camera or its first surface
 * sees the light, which is left to paths from the camera. */
#define path_rival(path, at, depth) sel((depth) > 1, load_path_rival(path, at), (real)(0.0f))
