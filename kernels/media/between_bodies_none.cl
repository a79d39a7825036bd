/* Stands for media/between_bodies.cl where what is outside of a material does not change it. */
#define bsdf_between_bodies(scene, active, v, m)
