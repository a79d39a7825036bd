/* Stands for integrator/steps/merge.cl where no photons are merged. */
#define merge_at_vertex(scene, path, at, met, v, scatter, rival, ratio)
