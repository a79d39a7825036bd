/* Stands for shapes/triangle_normal.cl in a scene whose meshes have no normals. */
#define triangle_normal(scene, space, c, s)
