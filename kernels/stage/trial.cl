/* A trial of a runtime, in a few milliseconds: what takes the time of rendering, with no scene.
 *
 * A work-item has LANES paths. At each bounce they are scattered in lanes, by a normal and a colour from rows of
 * words, as in shading; then each goes down through boxes in float8, as in bvh/wide8.cl. What comes out only
 * keeps the compiler from leaving that out. table: TRIAL_NODES nodes of 64 floats in [0, 1).
 */
#include "core/lanes.cl"
#include "core/rows.cl"
#include "core/math.cl"
#include "core/random.cl"
#include "core/frame.cl"
#include "core/warp.cl"
#include "bvh/mask8.cl"
#include "bvh/hints.cl"

#define TRIAL_BOUNCES 8
#define TRIAL_STEPS 12

inline float8 trial_least(float8 a, float8 b) { return a < b ? a : b; }
inline float8 trial_most(float8 a, float8 b) { return a > b ? a : b; }

/* The last node that a ray (x, y, z: the reciprocals of its direction) comes to, from the node `at`. */
inline uint trial_descend(global const float *table, uint at, float x, float y, float z)
{
    float t = 4.0f;
    for (uint step = 0; step < TRIAL_STEPS; step++) {
        global const float8 *row = (global const float8 *)(table + 64 * at);
        float8 ax = row[0] * x, bx = row[1] * x, ay = row[2] * y, by = row[3] * y, az = row[4] * z, bz = row[5] * z;
        float8 entry = trial_most(trial_most(trial_least(ax, bx), trial_least(ay, by)), trial_least(az, bz));
        float8 exit = trial_least(trial_least(trial_most(ax, bx), trial_most(ay, by)), trial_most(az, bz));
        Mask8 met = mask8(entry <= trial_least(exit, (float8)(t)));
        uint next = 7 * at + step;
        while (met) { /* the children that are met wait, the first of them is next */
            uint child = mask8_first(met);
            met = mask8_without(met, child);
            next += (child + 1) * (uint)(1024.0f * table[64 * at + 48 + child]);
            t = min(t, 3.9f);
        }
        at = next % TRIAL_NODES;
    }
    return at;
}

kernel NO_VECTORIZE void trial(global const float *table, global float *out)
{
    uint item = get_global_id(0);
    natural state = hash_natural(as_natural(LANE_INDEX) + (natural)(item * LANES));
    integer at = as_integer(state % (natural)(TRIAL_NODES));
    real beta = (real)(1.0f);
    for (uint bounce = 0; bounce < TRIAL_BOUNCES; bounce++) {
        vec4 a = gather4(table, 64 * at), b = gather4(table, 64 * at + 4);
        vec3 n = v3(a.x, a.y, a.z), e = gather3(table, 64 * at + 8);
        real colour = a.w, alpha = b.x;
        state = hash_natural(state + bounce);
        vec2 u = {unit_interval(state), unit_interval(hash_natural(state))};
        vec3 wi = cosine_hemisphere(u);
        real lobe = exp_r(-sqr(wi.x) / (sqr(alpha) + 0.01f)) + sqrt_r(colour * wi.z);
        beta *= sel(u.x < 0.5f, lobe, pow_r(wi.z, alpha)) * (b.y + b.z * e.x + b.w * e.y + e.z);
        vec3 d = to_world(frame_of(normalize3(n)), wi);
        d = v3(1.0f / d.x, 1.0f / d.y, 1.0f / d.z);
#define DESCEND(i) LANE(at, i) = (int)trial_descend(table, (uint)LANE(at, i), LANE(d.x, i), LANE(d.y, i), LANE(d.z, i));
        FOR_LANES(DESCEND)
    }
    block_store(out + item * LANES, beta + to_real(at));
}
