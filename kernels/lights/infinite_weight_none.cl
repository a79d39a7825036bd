/* Stands for lights/infinite_weight.cl where paths are not weighed against light paths. */
#define infinite_weight(scene, row, p, d, pdf, other, rival) \
    sel((pdf) < 0.0f, (real)(1.0f), mis_weight(pdf, other))
