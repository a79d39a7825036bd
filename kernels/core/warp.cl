/* From the unit square to directions and areas; pdfs per solid angle [1/sr] unless named otherwise. */
inline vec2 disk_of(vec2 u) /* concentric in the radius only: r = sqrt(u.x), angle 2 pi u.y */
{
    real s, c, r = sqrt_r(u.x);
    sincos_2pi(u.y, &s, &c);
    return (vec2){r * c, r * s};
}
/* The unit square onto the unit disk, rings to rings (Shirley and Chiu 1997). */
inline vec2 concentric_disk(vec2 u)
{
    real x = 2.0f * u.x - 1.0f, y = 2.0f * u.y - 1.0f;
    mask upright = fabs(x) < fabs(y);
    real r = sel(upright, y, x), turn = 0.125f * safe_div(sel(upright, x, y), r), s, c;
    turn = sel(upright, 0.25f - turn, turn);
    sincos_2pi(turn - floor(turn), &s, &c);
    return (vec2){r * c, r * s};
}

inline vec3 cosine_hemisphere(vec2 u) /* Malley: a point of the disk, raised to the hemisphere */
{
    vec2 p = concentric_disk(u);
    return v3(p.x, p.y, sqrt_r(1.0f - p.x * p.x - p.y * p.y));
}
inline real cosine_hemisphere_pdf(real cos_t) { return max_r(cos_t, (real)(0.0f)) * INV_PI; }

inline vec3 uniform_sphere(vec2 u)
{
    real s, c, z = 1.0f - 2.0f * u.x, r = sqrt_r(1.0f - z * z);
    sincos_2pi(u.y, &s, &c);
    return v3(r * c, r * s, z);
}
/* A cone about +z of solid angle 2 pi (1 - cos_max), given as 1 - cos_max to keep small cones exact. */
inline vec3 uniform_cone(vec2 u, real one_minus_cos)
{
    real s, c, h = u.x * one_minus_cos, z = 1.0f - h, r = sqrt_r(h * (2.0f - h));
    sincos_2pi(u.y, &s, &c);
    return v3(r * c, r * s, z);
}
/* Barycentrics of vertices 1 and 2, uniform over a triangle (Heitz 2019 would fold; this is the root form). */
inline vec2 uniform_triangle(vec2 u)
{
    real r = sqrt_r(u.x);
    return (vec2){1.0f - r, u.y * r};
}
/* From area to solid angle: the pdf of a point at distance t whose normal leans by cos to wi. */
inline real solid_angle_pdf(real pdf_area, real t, real cos_t)
{
    return pdf_area * t * t / max_r(cos_t, (real)(1e-9f));
}

/* A unit vector in a word: its point on an octahedron unfolded to a square, 16 bits a side (Cigolle et al.
 * 2014, "A Survey of Efficient Representations for Independent Unit Vectors"); off by 5e-5 at most. */
inline natural octahedral_pack(vec3 v)
{
    real inverse = 1.0f / (fabs(v.x) + fabs(v.y) + fabs(v.z));
    real x = v.x * inverse, y = v.y * inverse;
    mask below = v.z < 0.0f;
    real folded_x = copysign(1.0f - fabs(y), x), folded_y = copysign(1.0f - fabs(x), y);
    x = sel(below, folded_x, x);
    y = sel(below, folded_y, y);
    return to_natural(32767.0f * x + 32768.0f) | to_natural(32767.0f * y + 32768.0f) << 16u;
}

inline vec3 octahedral_unpack(natural word)
{
    real x = (to_real(word & 0xffffu) - 32767.5f) * (1.0f / 32767.0f);
    real y = (to_real(word >> 16u) - 32767.5f) * (1.0f / 32767.0f);
    real z = 1.0f - fabs(x) - fabs(y), over = max_r(-z, (real)(0.0f));
    return normalize3(v3(x - copysign(over, x), y - copysign(over, y), z));
}
