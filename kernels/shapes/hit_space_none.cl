/* Stands for shapes/hit_space.cl in a scene without instances, where triangles lie in the world. */
typedef integer HitSpace;
#define hit_space_load(h, hit, at)
#define hit_space(scene, h, active) ((integer)(0))
#define hit_normal(space, n) (n)
#define hit_vector(space, v) (v)
