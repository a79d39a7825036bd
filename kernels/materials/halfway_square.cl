/* Halfway directions as points of the unit square (Dupuy and Jakob 2018, section 4.1): x is the root of the angle to z,
 * y the azimuth, each over its range. */
inline vec2 halfway_square(vec3 w)
{
    real theta = atan2_r(sqrt_r(w.x * w.x + w.y * w.y), w.z);
    vec2 r = {sqrt_r(theta * (2.0f * INV_PI)), (atan2_r(w.y, w.x) + PI) * INV_2PI};
    return r;
}

/* A point's direction; its azimuth is turned by so many full turns. */
inline vec3 halfway_direction(vec2 p, real turned)
{
    real turn = p.y + 0.5f + turned, sin_p, cos_p, sin_t, cos_t;
    sincos_2pi(turn - floor(turn), &sin_p, &cos_p);
    sincos_2pi(0.25f * p.x * p.x, &sin_t, &cos_t);
    return v3(cos_p * sin_t, sin_p * sin_t, cos_t);
}

/* Solid angle of wi over area of the square, at x; h: the halfway direction there, cos_o: its cosine to wo. */
inline real halfway_area(real x, vec3 h, real cos_o)
{
    real sin_m = sqrt_r(h.x * h.x + h.y * h.y);
    return max_r(2.0f * PI * PI * x * sin_m, (real)(1e-6f)) * 4.0f * max_r(cos_o, (real)(1e-6f));
}
