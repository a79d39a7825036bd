/* Stands for path/kept_hemisphere.cl where no light is chosen by it. */
#define path_hemisphere(path, at) v3(0.0f, 0.0f, 0.0f)
#define path_hemisphere_keep(path, at, m, hemisphere) ((void)0)
