/* Stands for transport/rivals_camera.cl where no light path is joined to the camera. */
#define rival_seen(scene, v, sampler, rival) ((real)(0.0f))
