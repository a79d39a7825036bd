/* The nodes of graphs, by the names of MaterialX's standard library. clpt/scene/textures/nodes.py has their inputs and
 * the same in float64; clpt/render/textures/graphs.py writes a function `graph_<number>` for each structure of a graph,
 * which calls these. A node of numbers is called for each channel. The others take and return vectors: a number stands
 * in all channels, and what a value does not have is 0. */
#include "core/lattice_noise.cl"
#include "textures/graph_cells.cl"

inline vec4 vec4_sel(mask m, vec4 a, vec4 b)
{
    return v4(sel(m, a.x, b.x), sel(m, a.y, b.y), sel(m, a.z, b.z), sel(m, a.w, b.w));
}

/* A number among a graph's words, and the first word of a row or a table; 0 in idle lanes. */
inline real graph_number(Scene scene, integer at) { return gather_w(scene.textures, at); }
inline integer graph_index(Scene scene, mask running, integer at)
{
    return sel_i(running, gather_i(scene.textures, at), (integer)(0));
}

#if USES_ATTRIBUTES
/* The second uv of a mesh; at: the first of the words with the numbers of its attributes. */
inline vec2 graph_second_uv(Scene scene, integer at, TexturePoint point)
{
    vec3 uv = texture_uv(scene, sel_i(at > 0, (integer)(MAPPING_UV1), (integer)(MAPPING_UV)), at, point);
    return (vec2){uv.x, uv.y};
}
#endif

/* ---- of numbers */

inline real graph_add(real a, real b) { return a + b; }
inline real graph_subtract(real a, real b) { return a - b; }
inline real graph_multiply(real a, real b) { return a * b; }
inline real graph_divide(real a, real b) { return sel(b == 0.0f, (real)(0.0f), safe_div(a, b)); }
inline real graph_modulo(real a, real b) { return a - b * floor(graph_divide(a, b)); }
inline real graph_min(real a, real b) { return min_r(a, b); }
inline real graph_max(real a, real b) { return max_r(a, b); }
inline real graph_absval(real a) { return fabs(a); }
inline real graph_sign(real a) { return sel(a > 0.0f, (real)(1.0f), sel(a < 0.0f, (real)(-1.0f), (real)(0.0f))); }
inline real graph_floor(real a) { return floor(a); }
inline real graph_ceil(real a) { return -floor(-a); }
inline real graph_round(real a) { return floor(a + 0.5f); }
inline real graph_fract(real a) { return a - floor(a); }
inline void graph_sincos(real a, real *s, real *c)
{
    real turns = a * INV_2PI;
    sincos_2pi(clamp_r(turns - floor(turns), (real)(0.0f), (real)(1.0f)), s, c);
}
inline real graph_sin(real a)
{
    real s, c;
    graph_sincos(a, &s, &c);
    return s;
}
inline real graph_cos(real a)
{
    real s, c;
    graph_sincos(a, &s, &c);
    return c;
}
inline real graph_tan(real a)
{
    real s, c;
    graph_sincos(a, &s, &c);
    return safe_div(s, c);
}
inline real graph_acos(real a) { return acos_r(a); }
inline real graph_asin(real a) { return 0.5f * PI - acos_r(a); }
inline real graph_atan2(real y, real x) { return atan2_r(y, x); }
inline real graph_exp(real a) { return exp_r(a); }
inline real graph_ln(real a) { return log_r(max_r(a, (real)(1e-9f))); }
inline real graph_sqrt(real a) { return sqrt_r(a); }
/* Of a negative number where the exponent is whole. */
inline real graph_power(real a, real b)
{
    mask whole = floor(b) == b, odd = floor(0.5f * b) != 0.5f * b;
    real size = sel(b == 0.0f, (real)(1.0f), pow_r(fabs(a), b));
    return sel(a < 0.0f, sel(whole, sel(odd & whole, -size, size), (real)(0.0f)), size);
}
inline real graph_invert(real a, real amount) { return amount - a; }
inline real graph_clamp(real a, real low, real high) { return clamp_r(a, low, high); }
inline real graph_mix(real fg, real bg, real amount) { return bg + (fg - bg) * amount; }
inline real graph_remap(real a, real inlow, real inhigh, real low, real high)
{
    return low + graph_divide(a - inlow, inhigh - inlow) * (high - low);
}
inline real graph_smoothstep(real a, real low, real high)
{
    real t = clamp_r(graph_divide(a - low, high - low), (real)(0.0f), (real)(1.0f));
    return sel(a >= high, (real)(1.0f), t * t * (3.0f - 2.0f * t));
}
inline real graph_and(real a, real b) { return a * b; }
inline real graph_or(real a, real b) { return max_r(a, b); }
inline real graph_not(real a) { return 1.0f - a; }
inline real graph_ifgreater(real p, real q, real a, real b) { return sel(p > q, a, b); }
inline real graph_ifgreatereq(real p, real q, real a, real b) { return sel(p >= q, a, b); }
inline real graph_ifequal(real p, real q, real a, real b) { return sel(p == q, a, b); }
inline real graph_plus(real fg, real bg, real amount) { return graph_mix(fg + bg, bg, amount); }
inline real graph_minus(real fg, real bg, real amount) { return graph_mix(bg - fg, bg, amount); }
inline real graph_difference(real fg, real bg, real amount) { return graph_mix(fabs(bg - fg), bg, amount); }
inline real graph_screen(real fg, real bg, real amount)
{
    return graph_mix(1.0f - (1.0f - fg) * (1.0f - bg), bg, amount);
}
inline real graph_dodge(real fg, real bg, real amount) { return graph_mix(graph_divide(bg, 1.0f - fg), bg, amount); }
inline real graph_burn(real fg, real bg, real amount)
{
    return graph_mix(sel(fg == 0.0f, (real)(0.0f), 1.0f - graph_divide(1.0f - bg, fg)), bg, amount);
}
inline real graph_inside(real a, real matte) { return a * matte; }
inline real graph_outside(real a, real matte) { return a * (1.0f - matte); }

/* ---- of vectors */

inline vec4 graph_mixed(vec4 fg, vec4 bg, real amount)
{
    return v4(graph_mix(fg.x, bg.x, amount), graph_mix(fg.y, bg.y, amount), graph_mix(fg.z, bg.z, amount),
              graph_mix(fg.w, bg.w, amount));
}
inline vec4 graph_over(vec4 fg, vec4 bg, real amount)
{
    real s = 1.0f - fg.w;
    return graph_mixed(v4(fg.x + bg.x * s, fg.y + bg.y * s, fg.z + bg.z * s, fg.w + bg.w * s), bg, amount);
}
inline vec4 graph_times(vec4 a, real s) { return v4(a.x * s, a.y * s, a.z * s, a.w * s); }
inline vec4 graph_disjointover(vec4 fg, vec4 bg, real amount)
{
    real whole = fg.w + bg.w;
    vec4 below = graph_times(bg, sel(whole <= 1.0f, (real)(1.0f), graph_divide(1.0f - fg.w, bg.w)));
    vec4 both = v4(fg.x + below.x, fg.y + below.y, fg.z + below.z, min_r(whole, (real)(1.0f)));
    return graph_mixed(both, bg, amount);
}
inline vec4 graph_matte(vec4 fg, vec4 bg, real amount)
{
    vec4 both = graph_mixed(fg, bg, fg.w);
    both.w = fg.w + bg.w * (1.0f - fg.w);
    return graph_mixed(both, bg, amount);
}
inline vec4 graph_in(vec4 fg, vec4 bg, real amount) { return graph_mixed(graph_times(fg, bg.w), bg, amount); }
inline vec4 graph_out(vec4 fg, vec4 bg, real amount) { return graph_mixed(graph_times(fg, 1.0f - bg.w), bg, amount); }
inline vec4 graph_mask(vec4 fg, vec4 bg, real amount) { return graph_mixed(graph_times(bg, fg.w), bg, amount); }
inline vec4 graph_premult(vec4 a) { return v4(a.x * a.w, a.y * a.w, a.z * a.w, a.w); }
inline vec4 graph_unpremult(vec4 a)
{
    real s = 1.0f / sel(a.w == 0.0f, (real)(1.0f), a.w);
    return v4(a.x * s, a.y * s, a.z * s, a.w);
}
inline real graph_dotproduct(vec4 a, vec4 b) { return a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w; }
inline real graph_magnitude(vec4 a) { return sqrt(graph_dotproduct(a, a)); }
inline vec4 graph_normalize(vec4 a)
{
    return graph_times(a, graph_divide((real)(1.0f), graph_magnitude(a)));
}
inline real graph_distance(vec4 a, vec4 b)
{
    return graph_magnitude(v4(a.x - b.x, a.y - b.y, a.z - b.z, a.w - b.w));
}
inline vec3 graph_crossproduct(vec3 a, vec3 b) { return cross3(a, b); }
inline vec3 graph_luminance(vec3 color, vec3 weights)
{
    real grey = dot3(color, weights);
    return v3(grey, grey, grey);
}
inline vec3 graph_rgbtohsv(vec3 c)
{
    real most = max_r(max_r(c.x, c.y), c.z), least = min_r(min_r(c.x, c.y), c.z), spread = most - least;
    real r = graph_divide(c.x - least, spread), g = graph_divide(c.y - least, spread);
    real b = graph_divide(c.z - least, spread);
    real hue = sel(c.x >= most, g - b, sel(c.y >= most, 2.0f + b - r, 4.0f + r - g));
    hue = sel(spread > 0.0f, graph_fract(hue * (1.0f / 6.0f)), (real)(0.0f));
    return v3(hue, graph_divide(spread, most), most);
}
inline real graph_hue_channel(vec3 hsv, float turn)
{
    real k = 6.0f * graph_fract(hsv.x + turn * (1.0f / 6.0f));
    return hsv.z - hsv.z * hsv.y * clamp_r(min_r(k, 4.0f - k), (real)(0.0f), (real)(1.0f));
}
inline vec3 graph_hsvtorgb(vec3 hsv)
{
    return v3(graph_hue_channel(hsv, 5.0f), graph_hue_channel(hsv, 3.0f), graph_hue_channel(hsv, 1.0f));
}
inline vec3 graph_hsvadjust(vec3 color, vec3 amount)
{
    vec3 hsv = graph_rgbtohsv(color);
    return graph_hsvtorgb(v3(hsv.x + amount.x, hsv.y * amount.y, hsv.z * amount.z));
}
/* amount [degrees] */
inline vec2 graph_rotate2d(vec2 a, real amount)
{
    real s, c;
    graph_sincos(amount * (PI / 180.0f), &s, &c);
    return (vec2){c * a.x + s * a.y, c * a.y - s * a.x};
}
inline vec3 graph_rotate3d(vec3 a, real amount, vec3 axis)
{
    real s, c;
    graph_sincos(amount * (PI / 180.0f), &s, &c);
    vec3 n = scale3(axis, graph_divide((real)(1.0f), sqrt(dot3(axis, axis))));
    return madd3(a, c, madd3(cross3(n, a), s, scale3(n, dot3(n, a) * (1.0f - c))));
}
inline vec2 graph_place2d(vec2 uv, vec2 pivot, vec2 scale, real turn, vec2 offset, int order)
{
    vec2 p = {uv.x - pivot.x, uv.y - pivot.y};
    if (order) p = graph_rotate2d((vec2){p.x - offset.x, p.y - offset.y}, turn);
    p = (vec2){graph_divide(p.x, scale.x), graph_divide(p.y, scale.y)};
    if (!order) {
        p = graph_rotate2d(p, turn);
        p = (vec2){p.x - offset.x, p.y - offset.y};
    }
    return (vec2){p.x + pivot.x, p.y + pivot.y};
}
inline vec4 graph_ramplr(vec4 l, vec4 r, vec2 uv)
{
    return graph_mixed(r, l, clamp_r(uv.x, (real)(0.0f), (real)(1.0f)));
}
inline vec4 graph_ramptb(vec4 t, vec4 b, vec2 uv)
{
    return graph_mixed(t, b, clamp_r(uv.y, (real)(0.0f), (real)(1.0f)));
}
inline vec4 graph_ramp4(vec4 tl, vec4 tr, vec4 bl, vec4 br, vec2 uv)
{
    return graph_ramptb(graph_ramplr(tl, tr, uv), graph_ramplr(bl, br, uv), uv);
}
inline vec4 graph_splitlr(vec4 l, vec4 r, real center, vec2 uv) { return vec4_sel(uv.x < center, l, r); }
inline vec4 graph_splittb(vec4 t, vec4 b, real center, vec2 uv) { return vec4_sel(uv.y < center, b, t); }

/* A color of stops: `table` is the word with their number, then rows of a position and four channels, whose positions
 * rise. interpolation: 0: linear; 1: the stop's own up to the next; 2: smooth. */
called vec4 graph_ramp(real x, Scene scene, integer table, int interpolation)
{
    integer count = min_i(max_i(gather_i(scene.textures, table), (integer)(2)), (integer)(256)), upper = 1;
    for (int step = 128; step; step >>= 1) {
        integer next = min_i(upper + step, count - 1);
        upper = sel_i(x >= gather_w(scene.textures, table + 1 + 5 * (next - 1)), next, upper);
    }
    integer row = table + 1 + 5 * upper;
    real low = gather_w(scene.textures, row - 5), high = gather_w(scene.textures, row);
    real t = sel(x >= high, (real)(1.0f), clamp_r(graph_divide(x - low, high - low), (real)(0.0f), (real)(1.0f)));
    if (interpolation == 1) t = sel(t < 1.0f, (real)(0.0f), (real)(1.0f));
    if (interpolation == 2) t = t * t * (3.0f - 2.0f * t);
    return graph_mixed(gather_w4(scene.textures, row + 1), gather_w4(scene.textures, row - 4), t);
}

/* ---- patterns */

inline vec4 graph_scaled(vec4 n, vec4 amplitude, real pivot)
{
    return v4(n.x * amplitude.x + pivot, n.y * amplitude.y + pivot, n.z * amplitude.z + pivot,
              n.w * amplitude.w + pivot);
}
inline vec4 graph_noise3d(vec3 p, vec4 amplitude, real pivot, int channels)
{
    return graph_scaled(lattice_perlin(p, channels, 0), amplitude, pivot);
}
inline vec4 graph_noise2d(vec2 p, vec4 amplitude, real pivot, int channels)
{
    return graph_scaled(lattice_perlin(v3(p.x, p.y, (real)(0.0f)), channels, 1), amplitude, pivot);
}
/* octaves: at most 32, as clpt/scene/textures/noise.py has it */
called vec4 graph_octaves(vec3 p, real octaves, real lacunarity, real diminish, int channels, int planar)
{
    vec4 sum = v4(0.0f, 0.0f, 0.0f, 0.0f);
    real strength = 1.0f, scale = 1.0f;
    integer count = min_i(to_integer(-floor(-clamp_r(octaves, (real)(0.0f), (real)(32.0f)))), (integer)(32));
    for (int i = 0; any((integer)(i) < count); i++) {
        real weight = sel((integer)(i) < count, strength, (real)(0.0f));
        vec4 n = lattice_perlin(scale3(p, scale), channels, planar);
        sum = v4(sum.x + weight * n.x, sum.y + weight * n.y, sum.z + weight * n.z, sum.w + weight * n.w);
        strength *= diminish;
        scale *= lacunarity;
    }
    return sum;
}
inline vec4 graph_fractal3d(vec3 p, vec4 amplitude, real octaves, real lacunarity, real diminish, int channels)
{
    vec4 n = graph_octaves(p, octaves, lacunarity, diminish, channels, 0);
    return graph_scaled(n, amplitude, (real)(0.0f));
}
inline vec4 graph_fractal2d(vec2 p, vec4 amplitude, real octaves, real lacunarity, real diminish, int channels)
{
    vec4 n = graph_octaves(v3(p.x, p.y, (real)(0.0f)), octaves, lacunarity, diminish, channels, 1);
    return graph_scaled(n, amplitude, (real)(0.0f));
}
inline vec4 graph_cellnoise3d(vec3 p, int channels) { return lattice_cells(p, channels, 0); }
inline vec4 graph_cellnoise2d(vec2 p, int channels) { return lattice_cells(v3(p.x, p.y, (real)(0.0f)), channels, 1); }
inline vec4 graph_worleynoise3d(vec3 p, real jitter, int channels, int style)
{
    vec3 d = lattice_worley(p, jitter, channels, style, 0);
    return v4(d.x, d.y, d.z, (real)(0.0f));
}
inline vec4 graph_worleynoise2d(vec2 p, real jitter, int channels, int style)
{
    vec3 d = lattice_worley(v3(p.x, p.y, (real)(0.0f)), jitter, channels, style, 1);
    return v4(d.x, d.y, d.z, (real)(0.0f));
}
inline vec3 graph_voronoi3d(vec3 p, real randomness, real smoothness, real exponent, int feature, int metric,
                            int output)
{
    return cells_voronoi(p, randomness, smoothness, exponent, feature, metric, output, 0);
}
inline vec3 graph_voronoi2d(vec2 p, real randomness, real smoothness, real exponent, int feature, int metric,
                            int output)
{
    vec3 planar = v3(p.x, p.y, (real)(0.0f));
    return cells_voronoi(planar, randomness, smoothness, exponent, feature, metric, output, 1);
}
inline real graph_noise1d(real x) { return cells_perlin1(x); }
inline real graph_noise4d(vec4 p) { return cells_perlin4(p); }
inline vec3 graph_whitenoise(vec4 p, int dimensions) { return cells_white(p, dimensions); }
inline vec2 graph_brick(vec2 p, vec2 size, vec2 mortar, real bias, vec2 offset, vec2 squash)
{
    return cells_brick(p, size, mortar, bias, offset, squash);
}
