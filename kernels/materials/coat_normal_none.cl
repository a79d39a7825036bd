/* Stands for materials/coat_normal.cl where a material has no coat with a normal of its own. */
#define coat_normal_turned(scene, row, m, s, shaded) (m)
