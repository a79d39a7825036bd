/* Aims of lamps that shine into a cone: flights aim at such a lamp only where its light goes. Behind the aims in
 * `media` follow as many cones: x, y, z of the axis, and the cosine of the half angle, -1 for no cone. */
#define AIM_COUNT (MEDIUM_AIMS / 2)

/* The part of a ray in the cone of the aim in `row`. to: the aim as seen from the ray's origin; delta: its component
 * along d; far2: its squared length; end: of the ray [m]. */
inline AimSpan aim_span(Scene scene, integer row, vec3 d, vec3 to, real delta, real far2, real end)
{
    vec4 cone = row4(scene.media, row + 4 * AIM_COUNT);
    vec3 axis = v3(cone.x, cone.y, cone.z);
    real along = dot3(axis, d), from = -dot3(axis, to), c2 = cone.w * cone.w;
    /* a t^2 + 2 b t + c is above 0 in the cone, and in its mirror image behind the apex */
    real a = along * along - c2, b = from * along + c2 * delta, c = from * from - c2 * far2;
    real square = b * b - a * c, root = sqrt_r(max_r(square, (real)(0.0f)));
    real q = -(b + sel(b < 0.0f, -root, root));
    real one = q / sel(fabs(a) > 1e-12f, a, (real)(1e-12f)), two = c / sel(fabs(q) > 1e-20f, q, (real)(1e-20f));
    real low = min_r(one, two), high = max_r(one, two);
    mask beyond = a > 0.0f, ahead = along > 0.0f; /* a ray that is steeper than the cone enters or leaves it once */
    mask misses = !beyond & ((square <= 0.0f) | (from + 0.5f * (low + high) * along <= 0.0f));
    AimSpan s;
    s.from = max_r(sel(beyond, sel(ahead, high, (real)(0.0f)), low), (real)(0.0f));
    s.to = min_r(sel(beyond & ahead, end, sel(beyond, low, high)), end);
    mask none = cone.w < 0.0f;
    s.from = sel(none, (real)(0.0f), min_r(s.from, end));
    s.to = sel(none, end, max_r(s.to, s.from));
    s.meets = none | (!misses & (s.to > s.from));
    return s;
}

/* Twin, where no lamp near which flights end shines into a cone. */
#define AIM_COUNT MEDIUM_AIMS

inline AimSpan aim_span(Scene scene, integer row, vec3 d, vec3 to, real delta, real far2, real end)
{
    AimSpan s = {(real)(0.0f), end, mask_of(1)};
    return s;
}
