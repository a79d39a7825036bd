/* Stands for shapes/deforms.cl where nothing deforms, or no layer tells how. */
#define surface_deforms(scene, shape, space, prim, active, h, s)
