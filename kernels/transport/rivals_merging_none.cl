/* Stands for transport/rivals_merging.cl where no photons are merged. */
#define rival_arrives(r, delta, p, p_back) ((r).arrives)
#define rival_merges_here(scene, path, at, v) ((real)(0.0f))
#define rival_left_here(scene, path, at, v) ((real)(0.0f))
#define rival_merged_square(r, s, d, importance, p, p_back) ((real)(0.0f))
#define rival_pends_to_light(path, at, m, r, v, onward, delta, p, p_back)
#define rival_pends_to_camera(path, at, m, null, r, v, onward, delta, p, p_back)
