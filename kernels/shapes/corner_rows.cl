/* Rows of three floats of a vertex, of meshes that keep their form. */
typedef integer CornerKeys;
#define corner_keys(scene, shape, active) ((integer)(0))
#define corner_vec3(table, vertex, keys) gather3(table, (vertex) * 3)
