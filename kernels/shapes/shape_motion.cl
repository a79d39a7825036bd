/* How a shape has moved since it was lowered. */
typedef Motion ShapeMotion;
#define shape_motion(scene, shape) motion_of_shape(scene, (shape).number)
#define shape_point(motion, p) motion_point(motion, p)
#define shape_point_back(motion, p) motion_point_back(motion, p)
#define shape_vector(motion, v) motion_vector(motion, v)

/* What the way to where the shape was lowered and back rounds, as a primitive's size [m]. */
#define shape_motion_size(motion, rest) (4.0f * (size3((motion).t) + size3(shape_vector(motion, rest))))

/* Twin, where shapes stand still. */
typedef integer ShapeMotion;
#define shape_motion(scene, shape) ((integer)(0))
#define shape_point(motion, p) (p)
#define shape_point_back(motion, p) (p)
#define shape_vector(motion, v) (v)
#define shape_motion_size(motion, rest) 0.0f
