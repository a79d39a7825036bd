/* Vertices that move by themselves: each has a row for every key, side by side, and moves linearly from one to the
 * next. The table of motion/motion.cl says at MOTION_ROW + 4 where for each shape the word of its steps is: how many,
 * and for each when it begins [s] and one over how long it takes; none where it does not deform. */
typedef struct {
    integer count, key, next; /* rows of a vertex; the one before the time; from it to the one after it */
    real share;               /* of the way between these */
} VertexKeys;

inline VertexKeys vertex_keys(Scene scene, integer number, real time)
{
    integer first = as_int(scene.distributions[MOTION_ROW + 4]);
    integer at = motion_word(scene, first + number), steps = motion_word(scene, at);
    VertexKeys k = {steps + 1, (integer)(0), sel_i(steps > 0, (integer)(1), (integer)(0)), (real)(0.0f)};
    mask later = (k.key + 1 < steps) & (time >= gather(scene.distributions, at + 3));
    while (any(later)) {
        k.key = sel_i(later, k.key + 1, k.key);
        later = later & (k.key + 1 < steps) & (time >= gather(scene.distributions, at + 3 + 2 * k.key));
    }
    real since = time - gather(scene.distributions, at + 1 + 2 * k.key);
    k.share = clamp_r(since * gather(scene.distributions, at + 2 + 2 * k.key), (real)(0.0f), (real)(1.0f));
    return k;
}

/* Where a row of three floats is at the time, of the vertex whose first row this is. */
inline vec3 vertex_keyed(global const float *table, integer vertex, VertexKeys k)
{
    integer at = 3 * (vertex + k.key);
    return madd3(gather3(table, at), 1.0f - k.share, scale3(gather3(table, at + 3 * k.next), k.share));
}

/* Where the point of a triangle with the barycentrics u, v of its vertices 1 and 2 is at a time, before what its
 * instance does; number: of the scene's shape. */
inline vec3 vertex_point(Scene scene, integer number, integer prim, real u, real v, real time)
{
    VertexKeys k = vertex_keys(scene, number, time);
    vec3 corners = gather3((global const float *)scene.faces, 3 * prim);
    vec3 a = vertex_keyed(scene.vertices, as_integer(corners.x), k);
    vec3 b = vertex_keyed(scene.vertices, as_integer(corners.y), k);
    return madd3(a, 1.0f - u - v, madd3(b, u, scale3(vertex_keyed(scene.vertices, as_integer(corners.z), k), v)));
}
