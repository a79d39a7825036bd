/* The density of Henyey and Greenstein [1/sr], and its inverse: the cosine that u leads to, 1 at u = 0. */
inline real hg_density(real g, real turn)
{
    real below = max_r(1.0f + g * g - 2.0f * g * turn, (real)(1e-12f));
    return 0.25f * INV_PI * (1.0f - g * g) / (below * sqrt(below));
}
inline real hg_turn(real of, real u)
{
    mask even = fabs(of) < 1e-3f;
    real g = sel(even, (real)(1.0f), of);
    real root = (1.0f - g * g) / (1.0f + g - 2.0f * g * u);
    real turn = clamp_r((1.0f + g * g - root * root) / (2.0f * g), (real)(-1.0f), (real)(1.0f));
    return sel(even, 1.0f - 2.0f * u, turn);
}
