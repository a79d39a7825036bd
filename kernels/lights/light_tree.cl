/* Sampling a light in proportion to an estimate of its light at a point, by a tree over all lights (Conty Estevez and
 * Kulla 2018). Behind the rows in `lights` lies a word for every row: two bits for each level, the node of a group that
 * leads to the row. The groups follow: see clpt/render/lights/tree.py. */
#define LIGHT_TREE_SLACK 1e-3f /* of a cosine, so that rounding hides no light */
#define LIGHT_TREE_DARK 1e-5f  /* of a cosine: rounding, behind flat lights */
/* Corrections for the extent of a node: the share of its squared radius that is added to the squared distance; the
 * share of its squared sine, as seen from p, that is added to the squared cosine at the lights; and the least cosine at
 * p over that of the highest point of the node. All were measured, see bench/notes/lights.md. */
#define LIGHT_TREE_NEAR 0.33f
#define LIGHT_TREE_AROUND 0.1f
#define LIGHT_TREE_RISING 0.25f
/* The least importance of local lights over that of lights on the whole scene, and vice versa, if both may send light:
 * occlusion is unknown. */
#define LIGHT_TREE_LEAST 0.05f

/* The lanes where p may lie in a cone of a node's lights. from: from the node's centre to p. Inside the node every
 * point may. */
inline mask light_tree_in_cone(LightNode n, vec3 from)
{
    real d2 = dot3(from, from), inverse = 1.0f / sqrt(max_r(d2, (real)(1e-20f)));
    real sine = min_r(n.radius * inverse, (real)(1.0f));
    real turned = n.cos_e * sqrt_r(1.0f - sqr(sine)) - sqrt_r(1.0f - sqr(n.cos_e)) * sine;
    mask within = dot3(n.mean, from) * inverse > (turned - LIGHT_TREE_SLACK) * sqrt(dot3(n.mean, n.mean));
    return within | (n.radius * inverse >= 1.0f);
}

/* Estimate of the light of a node at p: power, times the mean cosine at the lights (lights/tree.py), over the squared
 * distance, times the reflectance at p, which is the cosine for a diffuse surface if only a single hemisphere matters.
 * It is 0 only where no light arrives. lift: 1 where light from both sides matters, else 0. Lights on the whole scene
 * have the same importance everywhere. */
inline real light_tree_importance(LightNode n, vec3 p, Receiver receiver, real lift)
{
    vec3 from = sub3(p, n.center);
    real d2 = dot3(from, from) + LIGHT_TREE_NEAR * sqr(n.radius), inverse = 1.0f / sqrt(max_r(d2, (real)(1e-20f)));
    vec3 w = scale3(from, inverse), across = v3(w.y * w.z, w.z * w.x, w.x * w.y);
    real sine = min_r(n.radius * inverse, (real)(1.0f));
    real square = dot3(n.squares, v3(w.x * w.x, w.y * w.y, w.z * w.z)) + 2.0f * dot3(n.products, across);
    real along = dot3(n.mean, w), shines = 0.5f * (along + sqrt_r(square + LIGHT_TREE_AROUND * sqr(sine)));
    mask flat = (n.child < 0) & (dot3(n.mean, n.mean) > 1.0f - LIGHT_TREE_SLACK);
    mask faces = !flat | (along > LIGHT_TREE_DARK);
    mask narrow = n.cos_e > -1.0f;
    if (any(narrow)) faces = faces & (!narrow | light_tree_in_cone(n, from));
    real straight = lift - dot3(receiver.hemisphere, w), highest = straight + sine;
    real cosine = max_r(max_r(straight, LIGHT_TREE_RISING * highest), (real)(LIGHT_TREE_SLACK));
    real reflected = receiver_reflects(receiver, neg3(w), sine, min_r(cosine, (real)(1.0f)));
    real importance = n.power * shines * reflected * sqr(inverse);
    importance = sel(faces & (highest > -LIGHT_TREE_SLACK), importance, (real)(0.0f));
    return sel(n.radius < 0.0f, n.power, importance);
}

/* The importance and the child of each node of a group; returns the sum of the importance. A GPU takes node by node:
 * the words of four nodes at once, and arrays that are indexed, need too many registers. */
inline real light_tree_group(Scene scene, integer group, vec3 p, Receiver receiver, real value[LIGHT_TREE_WIDTH],
                             integer child[LIGHT_TREE_WIDTH])
{
    int words = scene.settings->light_count * (LIGHT_ROW_WORDS + 1);
    global const uint *nodes = scene.lights + (words + LIGHT_TREE_LINE - 1) / LIGHT_TREE_LINE * LIGHT_TREE_LINE;
    integer at = group * (LIGHT_TREE_WIDTH * LIGHT_NODE_WORDS);
    real lift = sel(hemisphere_given(receiver.hemisphere), (real)(0.0f), (real)(1.0f)), sum = 0.0f;
    mask placed = mask_of(0), everywhere = mask_of(0); /* of the root's group: the first and the middle node */
    ROLLED
    for (int i = 0; i < LIGHT_TREE_WIDTH; i++) {
        LightNode n = light_node_row(nodes + i * LIGHT_NODE_WORDS, at);
        real own = light_tree_importance(n, p, receiver, lift);
        if (LANES > 1) {
            value[i] = own;
            child[i] = n.child;
        } else {
            UNROLLED
            for (int k = 0; k < LIGHT_TREE_WIDTH; k++) {
                value[k] = k < i ? value[k] : own;
                child[k] = k < i ? child[k] : n.child;
            }
        }
        if (i == 0) placed = n.radius >= 0.0f;
        if (i == LIGHT_TREE_WIDTH / 2) everywhere = n.radius < 0.0f;
    }
    real near = value[0], far = value[LIGHT_TREE_WIDTH / 2];
    mask apart = placed & everywhere & (near > 0.0f) & (far > 0.0f);
    value[0] = sel(apart, max_r(near, LIGHT_TREE_LEAST * far), near);
    value[LIGHT_TREE_WIDTH / 2] = sel(apart, max_r(far, LIGHT_TREE_LEAST * near), far);
    UNROLLED
    for (int i = 0; i < LIGHT_TREE_WIDTH; i++) sum += value[i];
    return sum;
}

/* Samples a row, with its probability at p for a surface with `receiver`: 0 where no light reaches p. *u is rescaled to
 * a new random number. other: see light_bits. */
inline integer light_tree_pick(Scene scene, vec3 p, Receiver receiver, real *u, real other, real *pmf)
{
    integer at = 0, child[LIGHT_TREE_WIDTH];
    real value[LIGHT_TREE_WIDTH];
    mask open = at >= 0;
    *pmf = 1.0f;
#if !FEW_LIGHTS
    real grain = UNIT_GRAIN; /* of *u: grows as its bits are used up */
#endif
    while (any(open)) {
        real sum = light_tree_group(scene, max_i(at, (integer)(0)), p, receiver, value, child);
        real target = min_r(*u, (real)(0.9999998f)) * sum, below = 0.0f, part = value[0], above = value[0];
        integer next = child[0];
        UNROLLED
        for (int i = 1; i < LIGHT_TREE_WIDTH; i++) {
            mask beyond = target >= above;
            below = sel(beyond, above, below);
            part = sel(beyond, value[i], part);
            next = sel_i(beyond, child[i], next);
            above += value[i];
        }
        real chance = part / max_r(sum, (real)(1e-37f)), remainder = (target - below) / max_r(part, (real)(1e-37f));
        *u = sel(open, clamp_r(remainder, (real)(0.0f), (real)(0.99999994f)), *u);
        *pmf *= sel(open, chance, (real)(1.0f));
#if !FEW_LIGHTS
        grain /= sel(open, max_r(chance, (real)(1e-20f)), (real)(1.0f));
        mask coarse = open & (grain > 0x1p-11f);
        if (any(coarse)) {
            real finer = *u + light_bits(as_natural(next), other, min_r(grain, (real)(1.0f)));
            *u = sel(coarse, min_r(finer, (real)(0.99999994f)), *u);
            grain = sel(coarse, (real)(UNIT_GRAIN), grain);
        }
#endif
        at = sel_i(open, next, at);
        open = at >= 0;
    }
    return -1 - at;
}

/* The probability of a row at p. */
inline real light_tree_pmf(Scene scene, integer row, vec3 p, Receiver receiver)
{
    int trails = scene.settings->light_count * LIGHT_ROW_WORDS;
    natural trail = as_natural(gather_i(scene.lights, row + trails));
    integer at = 0, child[LIGHT_TREE_WIDTH];
    real value[LIGHT_TREE_WIDTH];
    mask open = at >= 0;
    real pmf = 1.0f;
    while (any(open)) {
        real sum = light_tree_group(scene, max_i(at, (integer)(0)), p, receiver, value, child), part = value[0];
        integer slot = as_integer(trail & (LIGHT_TREE_WIDTH - 1)), next = child[0];
        UNROLLED
        for (int i = 1; i < LIGHT_TREE_WIDTH; i++) {
            part = sel(slot == i, value[i], part);
            next = sel_i(slot == i, child[i], next);
        }
        pmf *= sel(open, part / max_r(sum, (real)(1e-37f)), (real)(1.0f));
        at = sel_i(open, next, at);
        trail = trail >> 2;
        open = at >= 0;
    }
    return pmf;
}

#define light_choose light_tree_pick
#define light_pmf(scene, row, l, p, receiver) light_tree_pmf(scene, row, p, receiver)
