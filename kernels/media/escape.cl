/* Escape rays: they leave a sealed medium toward lamps. No shadow ray leaves such a body, because its smooth boundary
 * refracts, so a path meets a lamp by chance alone. At a collision near the boundary an escape ray is sampled in a cone
 * around the refracted direction of the lamp's middle. Lamp and cone are chosen where the path last crossed the
 * boundary, mostly not far away. The ray is refracted where it meets the boundary (tracing/escape_light.cl), and counts
 * if it hits a lamp. Escape ray and phase function both sample a direction at the collision; MIS (balance heuristic)
 * combines them, so the cone may be a guess.
 *
 * Balls around lamps stand in `distributions`, see clpt/render/media/bodies.py. */
#include "core/rows.cl"

#define ESCAPE_WORDS 5           /* of a ball: centre, radius and an unused word */
#define ESCAPE_SPREAD 0.03f      /* added to the sine of a lamp's half angle */
#define ESCAPE_WIDEST 0.8f       /* the largest sine of a cone's half angle */
#define ESCAPE_SHARE 0.5f        /* factor of the optical depth in the probability of an escape ray */
#define ESCAPE_DEEPEST 6.0f      /* optical depth beyond which no escape ray is sent */
#define ESCAPE_FAR (4.0f * FAR)  /* length that marks an escape ray */

/* The cone of a lamp, as seen from a boundary. */
typedef struct {
    vec3 axis;          /* refracted direction toward the lamp, inside the body */
    real one_minus_cos; /* of the half angle; 0 without a lamp */
    real up;            /* cosine between axis and normal */
} EscapeCone;

/* Chooses a lamp by u and its apparent size from the point p of a boundary with the outward normal n. eta: exterior
 * over interior index. */
inline EscapeCone escape_cone(Scene scene, vec3 p, vec3 n, real eta, real u)
{
    EscapeCone e;
    e.axis = n;
    e.one_minus_cos = 0.0f;
    e.up = 1.0f;
    real sum = 0.0f, c = 0.0f, size = 0.0f;
    vec3 toward = n;
    for (int i = 0; i < scene.settings->aim_count; i++) {
        global const float *ball = scene.distributions + scene.settings->aims + ESCAPE_WORDS * i;
        vec3 to = sub3(v3((real)(ball[0]), (real)(ball[1]), (real)(ball[2])), p);
        real inverse = 1.0f / max_r(sqrt_r(dot3(to, to)), (real)(1e-20f)), cosine = dot3(to, n) * inverse;
        real own = min_r(ball[3] * inverse, (real)(1.0f));
        real seems = sel(cosine > -own, sqr(own) * max_r(cosine, 0.1f * own), (real)(0.0f));
        sum += seems;
        mask taken = u * sum < seems;
        u = sel(taken, u * sum / max_r(seems, (real)(1e-30f)), (u * sum - seems) / max_r(sum - seems, (real)(1e-30f)));
        u = clamp_r(u, (real)(0.0f), (real)(0.99999994f));
        toward = sel3(taken, scale3(to, inverse), toward);
        c = sel(taken, cosine, c);
        size = sel(taken, own, size);
    }
    vec3 level = scale3(sub3(toward, scale3(n, c)), eta);
    e.up = sqrt_r(max_r(1.0f - dot3(level, level), (real)(0.04f)));
    e.axis = normalize3(add3(level, scale3(n, e.up)));
    real sine = min_r(eta * size + ESCAPE_SPREAD, (real)(ESCAPE_WIDEST));
    e.one_minus_cos = sel(sum > 0.0f, 1.0f - sqrt_r(1.0f - sine * sine), (real)(0.0f));
    return e;
}

/* Density of a direction by escape rays [1/sr]; chance: the probability that an escape ray is sent. */
inline real escape_density(EscapeCone e, real chance, vec3 d)
{
    mask within = 1.0f - dot3(e.axis, d) < e.one_minus_cos;
    return sel(within, chance / max_r(2.0f * PI * e.one_minus_cos, (real)(1e-30f)), (real)(0.0f));
}
