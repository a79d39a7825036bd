/* The point of an analytic shape: onto_of_shape, size_of_shape, dpdu_of_shape and dpdv_of_shape are generated for those
 * of the scene. `rest`: the point as the shape was lowered. */
#include "generated/analytic_steps.cl"

/* end: of the ray. */
inline void surface_analytic(Scene scene, ShapeRow shape, integer prim, mask active, vec3 end, Surface *s)
{
    mask analytic = active & (shape.kind != 0);
    if (any(analytic)) {
        Motion motion = shape_motion(scene, shape);
        vec3 rest = onto_of_shape(scene, shape, prim, shape_point_back(motion, end));
        s->p = sel3(analytic, shape_point(motion, rest), s->p);
        spheres_move(scene, shape, prim, analytic, motion, rest, s);
        s->size = sel(analytic, size_of_shape(scene, shape, prim) + shape_motion_size(motion, rest), s->size);
        analytic_tangents(scene, shape, prim, analytic, motion, rest, s);
    }
}

/* Twin, where all is made of triangles. */
inline void surface_analytic(Scene scene, ShapeRow shape, integer prim, mask active, vec3 end, Surface *s) {}
