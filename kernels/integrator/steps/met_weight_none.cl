/* Stands for integrator/steps/met_weight.cl where paths are not weighed against light paths. */
#define met_weight(scene, path, at, v, light, pdf, other) \
    sel((pdf) < 0.0f, (real)(1.0f), mis_weight(pdf, other))
