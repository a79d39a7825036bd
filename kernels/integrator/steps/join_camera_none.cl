/* Stands for integrator/steps/join_camera.cl where light paths leave photons alone, or a material sends light one way
 * only. */
typedef integer CameraJoint;
#define join_camera_to(joint, scatter) ((scatter).wo)
#define join_camera_seek(scene, v, scatter) ((integer)(0))
#define join_camera(scene, shadow, at, active, v, scatter, rival, joint, arrives) ((integer)(0))
