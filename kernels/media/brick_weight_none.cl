/* Stands for media/brick_weight.cl where no brick is a light. */
#define brick_weight(scene, row, active, origin, t) ((real)(1.0f))
