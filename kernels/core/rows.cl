/* Words that follow one another in a table, lane by lane: table[at], table[at + 1] and so on; an idle lane's index must
 * be valid: give 0. `gather2` to `gather4` read the words of a lane at once and transpose them in registers, half of
 * the time of reading word by word. gather_w4 is gather4 of a table of words.
 *
 * `row4` is gather_w4 for tables of few rows, of which all lanes mostly read one: its words then come by broadcast.
 * Else processors that gather do so by pairs of words: slower than a transposition, but 10 instructions in the place
 * of 100, of which programs have many. */
#if LANES == 1
inline vec2 gather2(global const float *p, integer at)
{
    vec2 r = {p[at], p[at + 1]};
    return r;
}
inline vec3 gather3(global const float *p, integer at)
{
    vec3 r = {p[at], p[at + 1], p[at + 2]};
    return r;
}
inline vec4 gather4(global const float *p, integer at)
{
    vec4 r = {p[at], p[at + 1], p[at + 2], p[at + 3]};
    return r;
}
#else
#define ROW_2(i) vload2(0, p + at.s##i)
#define ROW_3(i) (float4)(vload3(0, p + at.s##i), 0.0f)
#define ROW_4(i) vload4(0, p + at.s##i)
#if LANES == 8
#define ROW_HALVES(R) real a = (real)(R(0), R(1), R(2), R(3)), b = (real)(R(4), R(5), R(6), R(7));
#define ROW_QUARTERS(R) \
    real a = (real)(R(0), R(1)), b = (real)(R(2), R(3)), c = (real)(R(4), R(5)), d = (real)(R(6), R(7));
#else
#define ROW_HALVES(R)                                                \
    real a = (real)(R(0), R(1), R(2), R(3), R(4), R(5), R(6), R(7)); \
    real b = (real)(R(8), R(9), R(a), R(b), R(c), R(d), R(e), R(f));
#define ROW_QUARTERS(R)                                                                    \
    real a = (real)(R(0), R(1), R(2), R(3)), b = (real)(R(4), R(5), R(6), R(7));           \
    real c = (real)(R(8), R(9), R(a), R(b)), d = (real)(R(c), R(d), R(e), R(f));
#endif
inline vec2 gather2(global const float *p, integer at)
{
    ROW_HALVES(ROW_2)
    vec2 r = {(real)(a.even, b.even), (real)(a.odd, b.odd)};
    return r;
}
inline vec3 gather3(global const float *p, integer at)
{
    ROW_QUARTERS(ROW_3)
    real xz = (real)(a.even, b.even), last_xz = (real)(c.even, d.even);
    vec3 r = {(real)(xz.even, last_xz.even), (real)(a.odd.even, b.odd.even, c.odd.even, d.odd.even),
              (real)(xz.odd, last_xz.odd)};
    return r;
}
inline vec4 gather4(global const float *p, integer at)
{
    ROW_QUARTERS(ROW_4)
    real xz = (real)(a.even, b.even), last_xz = (real)(c.even, d.even);
    real yw = (real)(a.odd, b.odd), last_yw = (real)(c.odd, d.odd);
    vec4 r = {(real)(xz.even, last_xz.even), (real)(yw.even, last_yw.even), (real)(xz.odd, last_xz.odd),
              (real)(yw.odd, last_yw.odd)};
    return r;
}
#undef ROW_2
#undef ROW_3
#undef ROW_4
#undef ROW_HALVES
#undef ROW_QUARTERS
#endif
inline vec4 gather_w4(global const uint *p, integer at) { return gather4((global const float *)p, at); }

#ifdef NATIVE_PAIRS
inline vec4 row4_alike(global const uint *table, integer at)
{
    global const float *row = (global const float *)table;
    if (any(at != at.s0)) {
        real a = NATIVE_PAIRS(row, at.lo), b = NATIVE_PAIRS(row, at.hi);
        real c = NATIVE_PAIRS(row + 2, at.lo), d = NATIVE_PAIRS(row + 2, at.hi);
        vec4 r = {(real)(a.even, b.even), (real)(a.odd, b.odd), (real)(c.even, d.even), (real)(c.odd, d.odd)};
        return r;
    }
    row += at.s0;
    vec4 r = {(real)(row[0]), (real)(row[1]), (real)(row[2]), (real)(row[3])};
    return r;
}
#define row4 row4_alike
#else
#define row4 gather_w4
#endif
