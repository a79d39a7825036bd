/* Stands for cameras/front_motion.cl where the camera stands still. */
#define front_moved(scene, ray) (ray)
#define front_lowered(scene, to, grows) (to)
