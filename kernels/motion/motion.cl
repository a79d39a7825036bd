/* What moves while the shutter is open. At a time [s] that is R S x + t for a point x as it was lowered: t and the
 * symmetric S change linearly between two keys, the rotation R by slerp (Shoemake 1985), see clpt/scene/motion.py.
 * The table begins in `distributions` at MOTION_ROW: where the shutter, the camera's track, the tracks of shapes by
 * their number and those of lamps by their row begin. A track has its number of steps, and MOTION_STEP floats each. */

/* x, y, z: rows of the matrix from the world at that time to where things were lowered; t: the way back [m]. */
typedef struct { vec3 x, y, z, t; } Motion;

/* Step. */
#include "generated/motion_sizes.cl"

inline integer motion_word(Scene scene, integer at) { return as_integer(gather(scene.distributions, at)); }

/* A time for a random number: the shutter's density is linear in each of its even steps. */
inline real motion_time(Scene scene, real u)
{
    global const float *shutter = scene.distributions + as_int(scene.distributions[MOTION_ROW]);
    int steps = (int)shutter[0];
    integer step = 0;
    for (int i = 1; i < steps; i++) step = sel_i(u >= shutter[3 + 3 * i], (integer)(i), step);
    integer at = 3 + 3 * step;
    real first = gather(shutter, at + 1), last = gather(shutter, at + 2);
    real rest = max_r(u - gather(shutter, at), (real)(0.0f)) * (float)steps;
    real root = first + sqrt(max_r(sqr(first) + 2.0f * (last - first) * rest, (real)(0.0f)));
    real within = min_r(2.0f * rest / max_r(root, (real)(1e-20f)), (real)(1.0f));
    return shutter[1] + shutter[2] * ((to_real(step) + within) / (float)steps);
}

inline Motion motion_at(Scene scene, integer track)
{
    global const float *table = scene.distributions;
    integer at = track + 1, last = at + (motion_word(scene, track) - 1) * MOTION_STEP;
    mask later = (at < last) & (scene.time >= gather(table, at + MOTION_STEP));
    while (any(later)) {
        at = sel_i(later, at + MOTION_STEP, at);
        later = later & (at < last) & (scene.time >= gather(table, at + MOTION_STEP));
    }
#define K(i) gather(table, at + (i))
    real a = clamp_r((scene.time - K(0)) * K(1), (real)(0.0f), (real)(1.0f)), s, c;
    sincos_2pi(a * K(16), &s, &c);
    real x = K(8) * c + K(12) * s, y = K(9) * c + K(13) * s, z = K(10) * c + K(14) * s, w = K(11) * c + K(15) * s;
    Motion m; /* the columns of R */
    m.x = v3(1.0f - 2.0f * (y * y + z * z), 2.0f * (x * y + w * z), 2.0f * (x * z - w * y));
    m.y = v3(2.0f * (x * y - w * z), 1.0f - 2.0f * (x * x + z * z), 2.0f * (y * z + w * x));
    m.z = v3(2.0f * (x * z + w * y), 2.0f * (y * z - w * x), 1.0f - 2.0f * (x * x + y * y));
    m.t = v3(K(2) + a * K(5), K(3) + a * K(6), K(4) + a * K(7));
#if MOTION_SCALES /* S^-1 R^T, by the cofactors of S */
    real xx = K(17) + a * K(23), xy = K(18) + a * K(24), xz = K(19) + a * K(25);
    real yy = K(20) + a * K(26), yz = K(21) + a * K(27), zz = K(22) + a * K(28);
    vec3 p = v3(yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy);
    real inverse = 1.0f / (xx * p.x + xy * p.y + xz * p.z);
    p = scale3(p, inverse);
    real q = (xx * zz - xz * xz) * inverse, r = (xy * xz - xx * yz) * inverse, o = (xx * yy - xy * xy) * inverse;
    Motion turned = m;
    m.x = madd3(turned.x, p.x, madd3(turned.y, p.y, scale3(turned.z, p.z)));
    m.y = madd3(turned.x, p.y, madd3(turned.y, q, scale3(turned.z, r)));
    m.z = madd3(turned.x, p.z, madd3(turned.y, r, scale3(turned.z, o)));
#endif
#undef K
    return m;
}

/* From the world to where things were lowered: a vector, whose length a scale changes, and a point. */
inline vec3 motion_back(Motion m, vec3 v) { return v3(dot3(m.x, v), dot3(m.y, v), dot3(m.z, v)); }
inline vec3 motion_point_back(Motion m, vec3 p) { return motion_back(m, sub3(p, m.t)); }

/* And from there to the world: a normal, by the inverse transpose, whose length is not kept; a vector; a point. */
inline vec3 motion_normal(Motion m, vec3 n) { return madd3(m.x, n.x, madd3(m.y, n.y, scale3(m.z, n.z))); }
inline vec3 motion_vector(Motion m, vec3 v)
{
#if MOTION_SCALES
    vec3 yz = cross3(m.y, m.z);
    vec3 sum = madd3(yz, v.x, madd3(cross3(m.z, m.x), v.y, scale3(cross3(m.x, m.y), v.z)));
    return scale3(sum, 1.0f / dot3(m.x, yz));
#else
    return motion_normal(m, v);
#endif
}
inline vec3 motion_point(Motion m, vec3 p) { return add3(motion_vector(m, p), m.t); }

/* How much longer a vector gets that has length 1 in the world; 1 where nothing is scaled. */
inline real motion_length_back(Motion m, vec3 d)
{
#if MOTION_SCALES
    vec3 v = motion_back(m, d);
    return sqrt(max_r(dot3(v, v), (real)(1e-35f)));
#else
    return 1.0f;
#endif
}

/* Of a shape of the scene, by its number. */
inline Motion motion_of_shape(Scene scene, integer number)
{
    integer first = as_int(scene.distributions[MOTION_ROW + 2]);
    return motion_at(scene, motion_word(scene, first + number));
}

/* A row of `instances` at the time. */
inline InstanceRow motion_of_instance(Scene scene, InstanceRow i)
{
    Motion m = motion_of_shape(scene, i.number);
    vec3 x = i.x, y = i.y, z = i.z;
    i.x = madd3(m.x, x.x, madd3(m.y, x.y, scale3(m.z, x.z)));
    i.y = madd3(m.x, y.x, madd3(m.y, y.y, scale3(m.z, y.z)));
    i.z = madd3(m.x, z.x, madd3(m.y, z.y, scale3(m.z, z.z)));
    i.origin = motion_point(m, i.origin);
    return i;
}

/* Twin, where nothing moves. */
inline real motion_time(Scene scene, real u) { return (real)(0.0f); }

/* Step vertex_keys: Deforming vertices: each has a row for every key, side by side, and moves linearly between keys.
 * Word MOTION_ROW + 4 of motion/motion.cl's table is where a table begins with the first word of each shape's steps.
 * There lie the number of steps, then each step's begin [s] and inverse length [1/s]; a shape that does not deform has
 * no steps. */
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

/* Step rolling: how much later than the first row of the film a row gets light; position: on the whole film, 0 to 1. */
inline real row_delay(Scene scene, vec2 position)
{
    global const float *shutter = scene.distributions + as_int(scene.distributions[MOTION_ROW]);
    int last = scene.settings->film_height - 1;
    real row = clamp_r(floor(position.y * (float)(last + 1)), (real)(0.0f), (real)(last));
    return row * (shutter[3 + 3 * (int)shutter[0]] / (float)(last > 0 ? last : 1));
}

/* Twin, where all rows get light at once. */
inline real row_delay(Scene scene, vec2 position) { return 0.0f; }
