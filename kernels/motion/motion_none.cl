/* Stands for motion/motion.cl where nothing moves. */
#define motion_time(scene, u) ((real)(0.0f))
