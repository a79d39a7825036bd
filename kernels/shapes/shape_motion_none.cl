/* Stands for shapes/shape_motion.cl where shapes stand still. */
typedef integer ShapeMotion;
#define shape_motion(scene, shape) ((integer)(0))
#define shape_point(motion, p) (p)
#define shape_point_back(motion, p) (p)
#define shape_vector(motion, v) (v)
#define shape_motion_size(motion, rest) 0.0f
