/* Choosing a light in proportion to what it may send to a point, by a tree over all lights (Conty Estevez
 * and Kulla 2018; its nodes' importance after pbrt-v4, 12.6.3). Behind the rows in `lights` lie a word for every row,
 * whose bits say which child leads to it at each level, and then the nodes: see
 * clpt/render/lowering/lights/light_tree.py. */
#define LIGHT_TREE_SLACK 1e-3f /* of a cosine, so that rounding hides no light */
/* The least chance of lights at places beside those that shine on the whole scene, and of the latter beside the former,
 * where both may send light: what is in the way is not known. */
#define LIGHT_TREE_LEAST 0.05f

/* cos and sin of max(a - b, 0) for angles in [0, pi]. */
inline void light_tree_minus(real cos_a, real sin_a, real cos_b, real sin_b, real *c, real *s)
{
    mask below = cos_a > cos_b;
    *c = sel(below, (real)(1.0f), cos_a * cos_b + sin_a * sin_b);
    *s = sel(below, (real)(0.0f), sin_a * cos_b - cos_a * sin_b);
}

inline real light_tree_16(natural word, int shift)
{
    return to_real(as_integer((word >> shift) & 0xffffu)) * (2.0f / 65535.0f) - 1.0f;
}

inline vec3 light_tree_axis(natural word)
{
    real u = light_tree_16(word, 0), v = light_tree_16(word, 16), z = 1.0f - fabs(u) - fabs(v);
    real fold = max_r(-z, (real)(0.0f));
    return normalize3(v3(u + sel(u < 0.0f, fold, -fold), v + sel(v < 0.0f, fold, -fold), z));
}

/* What the lights below a node may send to p, all surfaces there shading them: their power, times the cosine at the
 * light, over the squared distance; and times the cosine at p, where light from one hemisphere only matters. The
 * cosines are the largest that any of these lights may have. Lights that shine on the whole scene count as much
 * everywhere. */
inline real light_tree_importance(LightNode n, vec3 p, vec3 hemisphere)
{
    vec3 from = sub3(p, n.center), axis = light_tree_axis(n.axis);
    real r2 = n.radius * n.radius, d2 = dot3(from, from);
    mask outside = d2 > r2;
    real inverse = 1.0f / sqrt(max_r(max_r(d2, r2), (real)(1e-20f))); /* of the distance, within of the radius */
    real cos_w = dot3(axis, from) * inverse, cos_i = -dot3(hemisphere, from) * inverse;
    cos_w = sel((n.cones & 0x80000000u) != 0, fabs(cos_w), cos_w);
    real cos_o = light_tree_16(n.cones, 0);
    real cos_e = to_real(as_integer((n.cones >> 16) & 0x7fffu)) * (2.0f / 32767.0f) - 1.0f;
    real sin_b = sel(outside, n.radius * inverse, (real)(1.0f)), cos_b = sqrt_r(1.0f - sin_b * sin_b);
    real cos_x, sin_x, cos_p, sin_p, cos_r, sin_r;
    light_tree_minus(cos_w, sqrt_r(1.0f - cos_w * cos_w), cos_o, sqrt_r(1.0f - cos_o * cos_o), &cos_x, &sin_x);
    light_tree_minus(cos_x, sin_x, cos_b, sin_b, &cos_p, &sin_p);
    light_tree_minus(cos_i, sqrt_r(1.0f - cos_i * cos_i), cos_b, sin_b, &cos_r, &sin_r);
    cos_p = sel(outside, cos_p, (real)(1.0f));
    cos_r = sel(outside & hemisphere_given(hemisphere), cos_r, (real)(1.0f));
    real arrives = max_r(cos_p, (real)(LIGHT_TREE_SLACK)) * max_r(cos_r, (real)(LIGHT_TREE_SLACK));
    mask faces = (cos_p > cos_e - LIGHT_TREE_SLACK) & (cos_r > -LIGHT_TREE_SLACK);
    real importance = sel(faces, n.power * arrives * sqr(inverse), (real)(0.0f));
    return sel(n.radius < 0.0f, n.power, importance);
}

/* The chance to go on to the first child of a pair, and where either leads. */
inline real light_tree_chance(Scene scene, integer pair, vec3 p, vec3 hemisphere, integer *first, integer *second)
{
    global const uint *nodes = scene.lights + scene.settings->light_count * (LIGHT_ROW_WORDS + 1);
    integer at = pair * LIGHT_NODE_WORDS;
    LightNode a = light_node_row(nodes, at), b = light_node_row(nodes + LIGHT_NODE_WORDS, at);
    real ia = light_tree_importance(a, p, hemisphere), ib = light_tree_importance(b, p, hemisphere), sum = ia + ib;
    *first = a.child;
    *second = b.child;
    real chance = sel(sum > 0.0f, ia / max_r(sum, (real)(1e-37f)), (real)(0.5f));
    mask apart = (b.radius < 0.0f) & (a.radius >= 0.0f) & (ia > 0.0f) & (ib > 0.0f);
    return sel(apart, clamp_r(chance, (real)(LIGHT_TREE_LEAST), (real)(1.0f - LIGHT_TREE_LEAST)), chance);
}

inline integer light_tree_root(Scene scene)
{
    int nodes = scene.settings->light_count * (LIGHT_ROW_WORDS + 1);
    return (integer)(as_int(scene.lights[nodes + LIGHT_NODE_CHILD]));
}

/* A row, and its chance at p, for a surface that sends light to `hemisphere` (interface/light.cl); what is left of *u
 * is uniform in [0, 1) again. other: see light_bits. */
inline integer light_tree_pick(Scene scene, vec3 p, vec3 hemisphere, real *u, real other, real *pmf)
{
    integer at = light_tree_root(scene), first, second;
    mask open = at >= 0;
    *pmf = 1.0f;
#if !FEW_LIGHTS
    real grain = UNIT_GRAIN; /* of *u: grows as its bits are spent */
#endif
    while (any(open)) {
        real chance = light_tree_chance(scene, sel_i(open, at, (integer)(1)), p, hemisphere, &first, &second);
        mask left = *u < chance;
        real share = sel(left, chance, 1.0f - chance);
        real remainder = sel(left, *u, *u - chance) / max_r(share, (real)(1e-20f));
        *u = sel(open, clamp_r(remainder, (real)(0.0f), (real)(0.99999994f)), *u);
        *pmf *= sel(open, share, (real)(1.0f));
#if !FEW_LIGHTS
        grain /= sel(open, max_r(share, (real)(1e-20f)), (real)(1.0f));
        mask coarse = open & (grain > 0x1p-11f);
        if (any(coarse)) {
            real finer = min_r(*u + light_bits(*u, other, min_r(grain, (real)(1.0f))), (real)(0.99999994f));
            *u = sel(coarse, finer, *u);
            grain = sel(coarse, (real)(UNIT_GRAIN), grain);
        }
#endif
        at = sel_i(open, sel_i(left, first, second), at);
        open = at >= 0;
    }
    return -1 - at;
}

/* The chance of a row at p. */
inline real light_tree_pmf(Scene scene, integer row, vec3 p, vec3 hemisphere)
{
    int trails = scene.settings->light_count * LIGHT_ROW_WORDS;
    natural trail = as_natural(gather_i(scene.lights, row + trails));
    integer at = light_tree_root(scene), first, second;
    mask open = at >= 0;
    real pmf = 1.0f;
    while (any(open)) {
        real chance = light_tree_chance(scene, sel_i(open, at, (integer)(1)), p, hemisphere, &first, &second);
        mask left = (trail & 1u) == 0;
        pmf *= sel(open, sel(left, chance, 1.0f - chance), (real)(1.0f));
        at = sel_i(open, sel_i(left, first, second), at);
        trail = trail >> 1;
        open = at >= 0;
    }
    return pmf;
}
