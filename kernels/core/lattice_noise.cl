/* Noises of Open Shading Language, which MaterialX has: Perlin's (Improving Noise, 2002) on a lattice without a period,
 * whose gradients Bob Jenkins' hash lookup3 chooses (public domain), cells, and Worley's (1996).
 * clpt/scene/textures/noise.py has the same in float64. A place in the plane has z = 0 and `planar`, a constant of the
 * caller. */
#define LATTICE_SEED 0xdeadbeefu

inline natural lattice_turned(natural x, int bits) { return (x << bits) | (x >> (32 - bits)); }

inline natural lattice_final(natural a, natural b, natural c)
{
    c = (c ^ b) - lattice_turned(b, 14);
    a = (a ^ c) - lattice_turned(c, 11);
    b = (b ^ a) - lattice_turned(a, 25);
    c = (c ^ b) - lattice_turned(b, 16);
    a = (a ^ c) - lattice_turned(c, 4);
    b = (b ^ a) - lattice_turned(a, 14);
    return (c ^ b) - lattice_turned(b, 24);
}

/* The hash of two whole numbers where planar, else of three. */
inline natural lattice_hash(natural x, natural y, natural z, int planar)
{
    natural seed = LATTICE_SEED + (planar ? 8u : 12u) + 13u;
    return lattice_final(seed + x, seed + y, planar ? seed : seed + z);
}

/* And of another number behind them. */
inline natural lattice_hash_more(natural x, natural y, natural z, natural more, int planar)
{
    natural seed = LATTICE_SEED + (planar ? 12u : 16u) + 13u;
    natural a = seed + x, b = seed + y, c = seed + z;
    if (planar) return lattice_final(a, b, seed + more);
    a = (a - c) ^ lattice_turned(c, 4), c += b;
    b = (b - a) ^ lattice_turned(a, 6), a += c;
    c = (c - b) ^ lattice_turned(b, 8), b += a;
    a = (a - c) ^ lattice_turned(c, 16), c += b;
    b = (b - a) ^ lattice_turned(a, 19), a += c;
    c = (c - b) ^ lattice_turned(b, 4), b += a;
    return lattice_final(a + more, b, c);
}

inline natural lattice_whole(real x) { return as_natural(to_integer(x)); }

/* The product of a place within a cell and a corner's gradient. */
inline real lattice_gradient(natural hashed, vec3 d, int planar)
{
    integer h = as_integer(hashed) & (planar ? 7 : 15);
    mask few = h < 4;
    real u = sel(h < (planar ? 4 : 8), d.x, d.y);
    real v = planar ? 2.0f * sel(few, d.y, d.x) : sel(few, d.y, sel((h == 12) | (h == 14), d.x, d.z));
    return sel((h & 1) != 0, -u, u) + sel((h & 2) != 0, -v, v);
}

/* A corner's products: with one gradient, or by bytes of its hash with three. */
inline vec3 lattice_corner(natural hashed, vec3 d, int channels, int planar)
{
    if (channels == 1) return v3(lattice_gradient(hashed, d, planar), (real)(0.0f), (real)(0.0f));
    return v3(lattice_gradient(hashed & 255u, d, planar), lattice_gradient((hashed >> 8) & 255u, d, planar),
              lattice_gradient((hashed >> 16) & 255u, d, planar));
}

inline real lattice_weight(real t) { return t * t * t * (10.0f + t * (6.0f * t - 15.0f)); }

/* One or three channels of Perlin's noise, in about [-1, 1]. */
called vec3 lattice_perlin_few(vec3 p, int channels, int planar)
{
    vec3 cell = v3(floor(p.x), floor(p.y), floor(p.z)), d = sub3(p, cell);
    vec3 w = v3(lattice_weight(d.x), lattice_weight(d.y), lattice_weight(d.z)), sum = v3(0.0f, 0.0f, 0.0f);
    natural x = lattice_whole(cell.x), y = lattice_whole(cell.y), z = lattice_whole(cell.z);
    for (int corner = 0; corner < (planar ? 4 : 8); corner++) {
        int i = corner & 1, j = (corner >> 1) & 1, k = corner >> 2;
        natural hashed = lattice_hash(x + (uint)i, y + (uint)j, z + (uint)k, planar);
        real weight = (i ? w.x : 1.0f - w.x) * (j ? w.y : 1.0f - w.y) * (planar ? 1.0f : k ? w.z : 1.0f - w.z);
        vec3 off = v3(d.x - (float)i, d.y - (float)j, d.z - (float)k);
        sum = madd3(lattice_corner(hashed, off, channels, planar), weight, sum);
    }
    return scale3(sum, planar ? 0.6616f : 0.9820f);
}

/* Up to four channels: the second of two and the fourth of four are those of another place. */
inline vec4 lattice_perlin(vec3 p, int channels, int planar)
{
    int even = (channels & 1) == 0;
    vec3 n = lattice_perlin_few(p, channels == 2 ? 1 : min(channels, 3), planar);
    real last = 0.0f;
    if (even) last = lattice_perlin_few(v3(p.x + 19.0f, p.y + 193.0f, p.z + (planar ? 0.0f : 17.0f)), 1, planar).x;
    return v4(n.x, channels == 2 ? last : n.y, n.z, last);
}

/* A number in [0, 1] for each unit cell and channel. */
inline vec4 lattice_cells(vec3 p, int channels, int planar)
{
    natural x = lattice_whole(floor(p.x)), y = lattice_whole(floor(p.y)), z = lattice_whole(floor(p.z));
    if (channels == 1)
        return v4(to_real(lattice_hash(x, y, z, planar)) * (1.0f / 4294967295.0f), (real)(0.0f), (real)(0.0f),
                  (real)(0.0f));
    real n[4];
    for (int i = 0; i < 4; i++) {
        n[i] = 0.0f;
        if (i < channels)
            n[i] = to_real(lattice_hash_more(x, y, z, (natural)((uint)i), planar)) * (1.0f / 4294967295.0f);
    }
    return v4(n[0], n[1], n[2], n[3]);
}

/* Worley's noise: distances to the three nearest of points, one in each cell; style 1: the numbers of the nearest's
 * place. jitter: how far points may lie from the middles of their cells. */
called vec3 lattice_worley(vec3 p, real jitter, int channels, int style, int planar)
{
    vec3 cell = v3(floor(p.x), floor(p.y), planar ? (real)(0.0f) : floor(p.z));
    vec3 near = v3(1e30f, 1e30f, 1e30f), place = p;
    for (int corner = 0; corner < (planar ? 9 : 27); corner++) {
        vec3 step = v3((real)((float)(corner % 3 - 1)), (real)((float)((corner / 3) % 3 - 1)),
                       (real)(planar ? 0.0f : (float)(corner / 9 - 1)));
        vec3 at = add3(cell, step);
        vec4 off = lattice_cells(at, 3, planar);
        vec3 point = v3(at.x + (off.x - 0.5f) * jitter + 0.5f, at.y + (off.y - 0.5f) * jitter + 0.5f,
                        planar ? (real)(0.0f) : at.z + (off.z - 0.5f) * jitter + 0.5f);
        vec3 away = v3(point.x - p.x, point.y - p.y, planar ? (real)(0.0f) : point.z - p.z);
        real distance = dot3(away, away);
        mask first = distance < near.x, second = distance < near.y;
        near.z = sel(second, near.y, min_r(near.z, distance));
        near.y = sel(first, near.x, sel(second, distance, near.y));
        near.x = sel(first, distance, near.x);
        place = sel3(first, point, place);
    }
    if (style == 0) return v3(sqrt(near.x), sqrt(near.y), sqrt(near.z));
    vec4 cells = lattice_cells(place, channels, planar);
    return v3(cells.x, cells.y, cells.z);
}
