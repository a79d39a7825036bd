/* Stands for steps/join_camera.cl where light paths leave photons alone, or a material sends light one way only. */
#define join_camera(scene, shadow, at, active, v, scatter, rival, arrives) ((integer)(0))
