/* Stands for media/body_weight.cl where no homogeneous medium is a light. */
#define body_weighed(scene, path, at, flies, light) (light)
