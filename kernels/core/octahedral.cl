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
