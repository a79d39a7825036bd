/* The media around a vertex of a path among overlapping bodies. */
typedef struct {
    integer medium;      /* incident: the ray travelled in it */
    integer inside;      /* interior: behind the surface */
    integer outside;     /* exterior: before the surface */
    BodyBoundary bodies;
} VertexMedia;

inline VertexMedia vertex_media(Scene scene, Slab path, Slab hit, uint at, mask active, integer row, mask front)
{
    VertexMedia m;
    integer bodies = sel_i(active, load_path_bodies(path, at), (integer)(0));
    integer shape_row = BSDF_IS_PHASE ? (integer)(0) : sel_i(active, load_hit_shape(hit, at), (integer)(0));
    m.bodies = body_boundary(scene, shape_row, bodies, front);
    if (BSDF_IS_PHASE) {
        m.bodies.body = 0;
        m.bodies.others = bodies;
    }
    m.inside = body_medium(scene, bodies_top(bodies_beyond(m.bodies, mask_of(1))));
    m.outside = body_medium(scene, bodies_top(m.bodies.others));
    m.medium = sel_i(active, load_path_medium(path, at), (integer)(0));
    return m;
}
