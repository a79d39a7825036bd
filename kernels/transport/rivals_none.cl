/* Stands for transport/rivals.cl where paths are not weighed against light paths. */
typedef integer Rival;
#define rival_of_camera(scene, path, at, v, sampler) ((integer)(0))
#define rival_of_emission(scene, path, at, v, receiver) ((integer)(0))
#define event_begins(scene, s, ls) ((real)(0.0f))
#define event_weight(scene, rival, s, ls, begins, pair, p) \
    sel((ls).pdf < 0.0f, (real)(1.0f), mis_weight((ls).pdf, p))
#define rival_goes_to_light(path, at, scatters, rival, v, onward, delta, bs) ((bs).pdf)
#define rival_goes_to_camera(scene, path, at, next, null, rival, v, onward, bs) (next)
#define rival_joint(scene, rival, v, pair, c, shine) ((real)(1.0f))
