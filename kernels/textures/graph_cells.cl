/* Patterns of nodes of graphs that MaterialX does not have: those of Blender's nodes.
 * clpt/scene/textures/cells.py has the same in float64. A place in the plane has z = 0 and `planar`, a constant of the
 * caller, as features, metrics and outputs are. */
#define VORONOI_NEXT 1
#define VORONOI_SMOOTH 2
#define VORONOI_EDGE 3
#define VORONOI_RADIUS 4
#define VORONOI_FAR 8.0f

inline natural cells_shifted(natural x) { return x ^ as_natural(as_integer(x) >> 16); }
inline real cells_share(natural x) { return to_real(x & 0x7fffffffu) * (1.0f / 2147483647.0f); }

/* Numbers in [0, 1] of a cell: pcg2d, pcg3d (Jarzynski, Olano 2020), whose shifts keep the sign. */
called vec3 cells_point(vec3 cell, int planar)
{
    natural x = lattice_whole(cell.x) * 1664525u + 1013904223u, y = lattice_whole(cell.y) * 1664525u + 1013904223u;
    natural z = lattice_whole(cell.z) * 1664525u + 1013904223u;
    for (int turn = 0; turn < 2; turn++) {
        x += planar ? y * 1664525u : y * z;
        y += planar ? x * 1664525u : z * x;
        z += planar ? z - z : x * y;
        if (turn == 0) x = cells_shifted(x), y = cells_shifted(y), z = cells_shifted(z);
    }
    return v3(cells_share(x), cells_share(y), planar ? (real)(0.0f) : cells_share(z));
}

inline real voronoi_length(vec3 d, real exponent, int metric)
{
    vec3 a = v3(fabs(d.x), fabs(d.y), fabs(d.z));
    if (metric == 1) return a.x + a.y + a.z;
    if (metric == 2) return max_r(max_r(a.x, a.y), a.z);
    if (metric == 3) {
        vec3 tiny = v3(1e-20f, 1e-20f, 1e-20f);
        real sum = pow_r(a.x + tiny.x, exponent) + pow_r(a.y + tiny.y, exponent) + pow_r(a.z + tiny.z, exponent);
        return pow_r(sum, 1.0f / exponent);
    }
    return sqrt(dot3(d, d));
}

/* The step to a neighbour by its number, with `side` cells along an axis. */
inline vec3 voronoi_step(int i, int side, int planar)
{
    int reach = side / 2;
    return v3((real)((float)(i % side - reach)), (real)((float)((i / side) % side - reach)),
              (real)(planar ? 0.0f : (float)(i / (side * side) - reach)));
}

/* From a place in its cell to the point of a neighbour. */
inline vec3 voronoi_offset(vec3 cell, vec3 step, real randomness, int planar)
{
    return madd3(cells_point(add3(cell, step), planar), randomness, step);
}

/* The distance to the nearest edge of a cell, whose point is at `place`. */
called real voronoi_edge(vec3 cell, vec3 within, vec3 place, real randomness, int planar)
{
    real best = VORONOI_FAR;
    for (int i = 0; i < (planar ? 9 : 27); i++) {
        vec3 offset = voronoi_offset(cell, voronoi_step(i, 3, planar), randomness, planar);
        vec3 away = sub3(offset, place), middle = sub3(scale3(add3(offset, place), 0.5f), within);
        real square = dot3(away, away), d = dot3(middle, away) / sqrt(max_r(square, (real)(1e-4f)));
        best = sel((square > 1e-4f) & (d < best), d, best);
    }
    return best;
}

/* Half of the distance from a point to the one nearest to it. */
called real voronoi_radius(vec3 cell, vec3 step, vec3 place, real randomness, real exponent, int metric, int planar)
{
    real best = VORONOI_FAR;
    for (int i = 0; i < (planar ? 9 : 27); i++) {
        if (i == (planar ? 4 : 13)) continue;
        vec3 other = voronoi_offset(cell, add3(step, voronoi_step(i, 3, planar)), randomness, planar);
        best = min_r(best, voronoi_length(sub3(other, place), exponent, metric));
    }
    return 0.5f * best;
}

/* The nearest distance with round ridges, and values that blend there. */
called vec3 voronoi_smooth(vec3 cell, vec3 within, real randomness, real smoothness, real exponent, int metric,
                           int output, int planar)
{
    real s = max_r(smoothness, (real)(1e-6f)), near = 0.0f;
    vec3 value = v3(0.0f, 0.0f, 0.0f);
    for (int i = 0; i < (planar ? 25 : 125); i++) {
        vec3 step = voronoi_step(i, 5, planar), offset = voronoi_offset(cell, step, randomness, planar);
        real d = voronoi_length(sub3(offset, within), exponent, metric);
        real t = clamp_r(0.5f + 0.5f * (near - d) / s, (real)(0.0f), (real)(1.0f));
        real h = i ? t * t * (3.0f - 2.0f * t) : (real)(1.0f), bend = s * h * (1.0f - h);
        near += (d - near) * h - bend;
        bend = output ? bend / (1.0f + 3.0f * s) : bend;
        if (output) {
            vec3 toward = output == 1 ? cells_point(add3(cell, step), 0) : offset;
            value = v3(value.x + (toward.x - value.x) * h - bend, value.y + (toward.y - value.y) * h - bend,
                       value.z + (toward.z - value.z) * h - bend);
        }
    }
    if (!output) return v3(near, near, near);
    return output == 1 ? value : v3(cell.x + value.x, cell.y + value.y, planar ? (real)(0.0f) : cell.z + value.z);
}

/* output: 0: a distance in each channel, 1: the color of a cell, 2: the place of its point */
called vec3 cells_voronoi(vec3 p, real randomness, real smoothness, real exponent, int feature, int metric, int output,
                          int planar)
{
    vec3 cell = v3(floor(p.x), floor(p.y), planar ? (real)(0.0f) : floor(p.z)), within = sub3(p, cell);
    if (planar) within.z = 0.0f;
    if (feature == VORONOI_SMOOTH)
        return voronoi_smooth(cell, within, randomness, smoothness, exponent, metric, output, planar);
    real near = 1e30f, next = 1e30f;
    vec3 place = within, step = v3(0.0f, 0.0f, 0.0f), place2 = within, step2 = step;
    for (int i = 0; i < (planar ? 9 : 27); i++) {
        vec3 there = voronoi_step(i, 3, planar), offset = voronoi_offset(cell, there, randomness, planar);
        real d = voronoi_length(sub3(offset, within), exponent, metric);
        mask first = d < near, second = !first & (d < next);
        next = sel(first, near, sel(second, d, next));
        place2 = sel3(first, place, sel3(second, offset, place2));
        step2 = sel3(first, step, sel3(second, there, step2));
        near = sel(first, d, near);
        place = sel3(first, offset, place);
        step = sel3(first, there, step);
    }
    if (feature == VORONOI_NEXT) near = next, place = place2, step = step2;
    if (feature == VORONOI_EDGE) near = voronoi_edge(cell, within, place, randomness, planar);
    if (feature == VORONOI_RADIUS) near = voronoi_radius(cell, step, place, randomness, exponent, metric, planar);
    if (output == 0) return v3(near, near, near);
    return output == 1 ? cells_point(add3(cell, step), 0) : add3(cell, place);
}

/* ---- noise */

inline natural cells_hash(natural x)
{
    natural seed = LATTICE_SEED + 4u + 13u + (x ^ x);
    return lattice_final(seed + x, seed, seed);
}

/* Perlin's noise of a number. */
inline real cells_line(natural hashed, real d)
{
    real size = 1.0f + to_real(hashed & 7u);
    return sel((as_integer(hashed) & 8) != 0, -size, size) * d;
}
called real cells_perlin1(real x)
{
    real cell = floor(x), d = x - cell, w = lattice_weight(d);
    natural at = lattice_whole(cell);
    real low = cells_line(cells_hash(at), d), high = cells_line(cells_hash(at + 1u), d - 1.0f);
    return 0.25f * (low + (high - low) * w);
}

/* Perlin's noise of four numbers. */
inline real cells_corner(natural hashed, vec4 d)
{
    integer h = as_integer(hashed) & 31;
    real u = sel(h < 24, d.x, d.y), v = sel(h < 16, d.y, d.z), s = sel(h < 8, d.z, d.w);
    return sel((h & 1) != 0, -u, u) + sel((h & 2) != 0, -v, v) + sel((h & 4) != 0, -s, s);
}
called real cells_perlin4(vec4 p)
{
    vec4 cell = v4(floor(p.x), floor(p.y), floor(p.z), floor(p.w));
    vec4 d = v4(p.x - cell.x, p.y - cell.y, p.z - cell.z, p.w - cell.w);
    vec4 weight = v4(lattice_weight(d.x), lattice_weight(d.y), lattice_weight(d.z), lattice_weight(d.w));
    natural x = lattice_whole(cell.x), y = lattice_whole(cell.y), z = lattice_whole(cell.z), w = lattice_whole(cell.w);
    real sum = 0.0f;
    for (int corner = 0; corner < 16; corner++) {
        int i = corner & 1, j = (corner >> 1) & 1, k = (corner >> 2) & 1, l = corner >> 3;
        natural hashed = lattice_hash_more(x + (uint)i, y + (uint)j, z + (uint)k, w + (uint)l, 0);
        vec4 off = v4(d.x - (float)i, d.y - (float)j, d.z - (float)k, d.w - (float)l);
        real share = (i ? weight.x : 1.0f - weight.x) * (j ? weight.y : 1.0f - weight.y);
        share *= (k ? weight.z : 1.0f - weight.z) * (l ? weight.w : 1.0f - weight.w);
        sum += share * cells_corner(hashed, off);
    }
    return 0.8344f * sum;
}

/* Numbers in [0, 1] by the bits of so many numbers. */
inline real cells_fraction(natural x) { return to_real(x) * (1.0f / 4294967295.0f); }
called vec3 cells_white(vec4 p, int dimensions)
{
    natural x = as_natural(p.x), y = as_natural(p.y), z = as_natural(p.z), w = as_natural(p.w);
    natural one = as_natural((real)(1.0f)), two = as_natural((real)(2.0f)), a, b, c;
    if (dimensions == 1)
        a = cells_hash(x), b = lattice_hash(x, one, one, 1), c = lattice_hash(x, two, two, 1);
    else if (dimensions == 2)
        a = lattice_hash(x, y, y, 1), b = lattice_hash(x, y, one, 0), c = lattice_hash(x, y, two, 0);
    else if (dimensions == 3)
        a = lattice_hash(x, y, z, 0), b = lattice_hash_more(x, y, z, one, 0), c = lattice_hash_more(x, y, z, two, 0);
    else
        a = lattice_hash_more(x, y, z, w, 0), b = lattice_hash_more(z, x, w, y, 0),
        c = lattice_hash_more(w, z, y, x, 0);
    return v3(cells_fraction(a), cells_fraction(b), cells_fraction(c));
}

/* ---- bricks */

/* A number in [0, 1] of each brick. */
inline real cells_brick_number(real row, real number)
{
    natural n = (lattice_whole(row) << 16) + (lattice_whole(number) & 0xffffu);
    n = (n + 1013u) & 0x7fffffffu;
    n = (n >> 13) ^ n;
    n = (n * (n * n * 60493u + 19990303u) + 1376312589u) & 0x7fffffffu;
    return to_real(n) * (0.5f / 1073741824.0f);
}

/* The number of a brick, moved by a bias, and the share of mortar. mortar: its width and its softness; offset: of every
 * so many rows, as a share of a brick; squash: a factor on the width of bricks of every so many rows. */
called vec2 cells_brick(vec2 p, vec2 size, vec2 mortar, real bias, vec2 offset, vec2 squash)
{
    real row = floor(p.y / size.y), skipped = row - squash.y * floor(row / squash.y);
    real width = size.x * sel(skipped == 0.0f, squash.x, (real)(1.0f));
    skipped = row - offset.y * floor(row / offset.y);
    real x = p.x + sel(skipped == 0.0f, width * offset.x, (real)(0.0f)), number = floor(x / width);
    real y = p.y - size.y * row, tint = clamp_r(cells_brick_number(row, number) + bias, (real)(0.0f), (real)(1.0f));
    x -= width * number;
    real within = min_r(min_r(x, y), min_r(width - x, size.y - y));
    real t = (1.0f - within / max_r(mortar.x, (real)(1e-9f))) / max_r(mortar.y, (real)(1e-9f));
    t = clamp_r(t, (real)(0.0f), (real)(1.0f));
    return (vec2){tint, sel(within < mortar.x, t * t * (3.0f - 2.0f * t), (real)(0.0f))};
}
