/* Stands for transport/guiding/collisions.cl where there are no media. */
#define collision_row(scene, path, hit, at, active, row, shared) (row)
