/* Stands for cameras/camera_axis.cl where the camera stands still. */
#define camera_axis_moved(scene, from, axis)
