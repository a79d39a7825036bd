/* How a shape has moved since it was lowered. */
inline Motion shape_motion(Scene scene, ShapeRow shape) { return motion_of_shape(scene, shape.number); }
inline vec3 shape_point(Motion m, vec3 p) { return motion_point(m, p); }
inline vec3 shape_point_back(Motion m, vec3 p) { return motion_point_back(m, p); }
inline vec3 shape_vector(Motion m, vec3 v) { return motion_vector(m, v); }

/* What the way to where the shape was lowered and back rounds, as a primitive's size [m]. */
inline real shape_motion_size(Motion m, vec3 rest) { return 4.0f * (size3(m.t) + size3(shape_vector(m, rest))); }

/* Twin, where shapes stand still. */
inline Motion shape_motion(Scene scene, ShapeRow shape)
{
    vec3 zero = v3(0.0f, 0.0f, 0.0f);
    Motion m = {zero, zero, zero, zero};
    return m;
}
inline vec3 shape_point(Motion m, vec3 p) { return p; }
inline vec3 shape_point_back(Motion m, vec3 p) { return p; }
inline vec3 shape_vector(Motion m, vec3 v) { return v; }
inline real shape_motion_size(Motion m, vec3 rest) { return (real)(0.0f); }
