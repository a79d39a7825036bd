/* Deforming vertices: each has a row for every key, side by side, and moves linearly between keys. Word MOTION_ROW +
 * 4 of motion/motion.cl's table is where a table begins with the first word of each shape's steps. There lie the
 * number of steps, then each step's begin [s] and inverse length [1/s]; a shape that does not deform has no steps. */
typedef struct {
    integer count, key, next; /* rows of a vertex; the row before the time; the share of the next row */
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

/* The point of a triangle at a time, before its instance's transform. u, v: barycentrics of vertices 1 and 2;
 * number: of the scene's shape. */
inline vec3 vertex_point(Scene scene, integer number, integer prim, real u, real v, real time)
{
    VertexKeys k = vertex_keys(scene, number, time);
    vec3 corners = gather3((global const float *)scene.faces, 3 * prim);
    vec3 a = vertex_keyed(scene.vertices, as_integer(corners.x), k);
    vec3 b = vertex_keyed(scene.vertices, as_integer(corners.y), k);
    return madd3(a, 1.0f - u - v, madd3(b, u, scale3(vertex_keyed(scene.vertices, as_integer(corners.z), k), v)));
}
