/* Stands for integrator/steps/met_emission.cl on surfaces that do not shine. */
#define met_emission(scene, path, at, active, v) mask_of(0)
