/* The mis_ratio of a camera's path that meets a light. */

#include "generated/kept_hemisphere.cl"

/* 0 where the camera or its first surface sees the light: light paths are not connected there
 * (transport/mis_ratio.cl). */
#define path_mis_ratio(path, at, depth) sel((depth) > 1, load_path_mis_ratio(path, at), (real)(0.0f))
