/* Stands for film/screen_motion.cl where no layer tells how what is seen moves. */
#define layers_of_sky(scene, path, at, layers, unseen)
