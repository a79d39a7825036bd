/* Numbers as a float and its rounding error, exact to 2^-45: for differences of large numbers, such as from an eye to a
 * ball of a planet's size, which a single float would lose. Sums: Knuth 1969 (4.2.2, theorem B); products by `fma`; dot
 * products: Ogita, Rump and Oishi 2005 (Accurate Sum and Dot Product, algorithm 5.3). */
typedef struct { real high, low; } Twofold;
typedef struct { vec3 high, low; } Twofold3;

inline Twofold twofold_sum(real a, real b)
{
    real sum = a + b, from_b = sum - a;
    Twofold r = {sum, (a - (sum - from_b)) + (b - from_b)};
    return r;
}

inline Twofold twofold_product(real a, real b)
{
    real product = a * b;
    Twofold r = {product, fma(a, b, -product)};
    return r;
}

inline Twofold twofold_add(Twofold a, Twofold b)
{
    Twofold r = twofold_sum(a.high, b.high);
    r.low += a.low + b.low;
    return r;
}

inline Twofold twofold_neg(Twofold a) { Twofold r = {-a.high, -a.low}; return r; }

inline Twofold twofold_sqr(Twofold a)
{
    Twofold r = twofold_product(a.high, a.high);
    r.low += 2.0f * a.high * a.low;
    return r;
}

inline Twofold3 twofold_sub3(vec3 a, vec3 b)
{
    Twofold x = twofold_sum(a.x, -b.x), y = twofold_sum(a.y, -b.y), z = twofold_sum(a.z, -b.z);
    Twofold3 r = {v3(x.high, y.high, z.high), v3(x.low, y.low, z.low)};
    return r;
}

inline Twofold twofold_dot3(Twofold3 a, vec3 b)
{
    Twofold r = twofold_add(twofold_product(a.high.x, b.x), twofold_product(a.high.y, b.y));
    r = twofold_add(r, twofold_product(a.high.z, b.z));
    r.low += dot3(a.low, b);
    return r;
}

inline Twofold twofold_square3(Twofold3 a)
{
    Twofold r = twofold_dot3(a, a.high);
    r.low += dot3(a.low, a.high);
    return r;
}

inline real twofold_real(Twofold a) { return a.high + a.low; }
