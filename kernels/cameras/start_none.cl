/* Stands for cameras/start.cl where all rays count alike, or the film has no alpha. */
#define path_start(scene, path, at, pixel_index, sample) camera_start()
