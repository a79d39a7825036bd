/* The hemisphere to which the surface sends light where a ray was chosen: lights are chosen by it. */
#define path_hemisphere(path, at) load_path_sampled_hemisphere(path, at)
#define path_hemisphere_keep(path, at, m, hemisphere) store_path_sampled_hemisphere(path, at, m, hemisphere)
