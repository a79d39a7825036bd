/* Media with coefficients times a density at the points of a lattice, trilinear between the points. Bricks of 8^3 cells
 * hold the density of their 9^3 points over the brick's highest, in 16 bits each. A ray goes from brick to brick by
 * integer steps (Amanatides and Woo 1987); the highest density of a brick gives the majorant there. Flights are in
 * media/grid_flight.cl (delta tracking); shadow rays use ratio tracking (Novak et al. 2014).
 *
 * All estimates are linear in the density, so a random point of the eight around stands for it, with its trilinear
 * weight as its probability. In `materials` follow behind a medium's coefficients: the first word in `images`, the
 * number of bricks along x, y and z, a matrix of three rows from the world to the lattice, and the upper corner of
 * the box there; the lower corner is (1/2, 1/2, 1/2). In `images` each brick has two words: where its points begin,
 * counted from the first word, and its highest density. A medium with MEDIUM_BYTES in its name has 8 bits for each
 * number. */
#include "generated/brick_cells.cl"
#define GRID_ROULETTE 0.05f /* transmittance below which Russian roulette begins */
/* The most collisions of a ray in a grid. A density of 1 beside empty cells, under a large coefficient, makes as
 * many null collisions as a file likes. A ray with more makes its sample infinite, which the film rejects and
 * counts. */
#define MOST_NULL_COLLISIONS 262144u

/* A ray in the lattice, and the brick where it is. */
typedef struct {
    vec3 o, d, inverse;
    real t, end; /* [m] */
    integer first, nx, ny, nz, x, y, z;
    integer packed; /* base-2 logarithm of the numbers in a word */
} GridWalk;

/* A brick on the ray: its first point, its highest density, where the ray leaves it [m], and the axis along which. */
typedef struct {
    integer points;
    real most, exit;
    mask across_x, across_y;
} GridBrick;

/* The key of the random numbers of a ray. */
inline natural grid_key(Scene scene, natural pixel_key, integer sample, integer vertex)
{
    natural key = hash_natural(as_natural(sample) + 0x9e3779b9u * scene.settings->seed);
    return hash_natural(pixel_key + hash_natural(key + as_natural(vertex)));
}

#include "generated/grid_numbers.cl"

/* The lattice of a medium, whose words begin at `at`, and the ray from o along d there. */
inline void grid_enter(Scene scene, integer name, integer at, vec3 o, vec3 d, GridWalk *w)
{
    w->first = gather_i(scene.materials, at);
    w->nx = max_i(gather_i(scene.materials, at + 1), (integer)(1));
    w->ny = max_i(gather_i(scene.materials, at + 2), (integer)(1));
    w->nz = gather_i(scene.materials, at + 3);
    w->packed = grid_packed(name);
#define AXIS(a, n)                                                            \
    vec4 row_##a = row4(scene.materials, at + 4 + 4 * n);                     \
    w->o.a = row_##a.x * o.x + row_##a.y * o.y + row_##a.z * o.z + row_##a.w; \
    w->d.a = row_##a.x * d.x + row_##a.y * d.y + row_##a.z * d.z;             \
    w->inverse.a = 1.0f / sel(fabs(w->d.a) > 1e-20f, w->d.a, (real)(1e-20f));
    AXIS(x, 0)
    AXIS(y, 1)
    AXIS(z, 2)
#undef AXIS
}

/* Begins a walk where the ray from o along d, t metres long, enters the box; returns the rays that do. */
inline mask grid_begin(Scene scene, integer name, vec3 o, vec3 d, real t, mask active, GridWalk *w)
{
    integer at = sel_i(active, MEDIUM_ROW(name) + 2 * MEDIUM_SCATTERING, (integer)(0));
    grid_enter(scene, name, at, o, d, w);
    real lo = 0.0f, hi = t;
#define AXIS(a, n)                                                                              \
    real from_##a = (0.5f - w->o.a) * w->inverse.a;                                             \
    real to_##a = (gather_w(scene.materials, at + 16 + n) - w->o.a) * w->inverse.a;             \
    lo = max_r(lo, min_r(from_##a, to_##a));                                                    \
    hi = min_r(hi, max_r(from_##a, to_##a));
    AXIS(x, 0)
    AXIS(y, 1)
    AXIS(z, 2)
#undef AXIS
    w->t = lo;
    w->end = hi;
    mask inside = active & (lo < hi);
#define AXIS(a) \
    w->a = clamp_i(to_integer(sel(inside, w->o.a + lo * w->d.a, (real)(0.0f)) * (1.0f / BRICK_CELLS)), w->n##a - 1);
    AXIS(x)
    AXIS(y)
    AXIS(z)
#undef AXIS
    return inside;
}

inline GridBrick grid_brick(Scene scene, GridWalk w, mask active)
{
    GridBrick b;
    integer at = w.first + 2 * ((w.z * w.ny + w.y) * w.nx + w.x);
    at = sel_i(active, at, (integer)(0));
    b.points = w.first + gather_i(scene.images, at);
    b.most = gather_w(scene.images, at + 1);
    real end_x, end_y, end_z;
#define AXIS(a)                                                                                       \
    end_##a = to_real(BRICK_CELLS * (w.a + sel_i(w.d.a > 0.0f, (integer)(1), (integer)(0)))) - w.o.a; \
    end_##a = sel(fabs(w.d.a) > 1e-20f, end_##a * w.inverse.a, (real)(FAR));
    AXIS(x)
    AXIS(y)
    AXIS(z)
#undef AXIS
    b.across_x = (end_x <= end_y) & (end_x <= end_z);
    b.across_y = !b.across_x & (end_y <= end_z);
    b.exit = max_r(min_r(min_r(end_x, end_y), min_r(end_z, w.end)), w.t);
    return b;
}

/* Goes to the next brick; returns the rays that stay in the box. */
inline mask grid_next(GridWalk *w, GridBrick b, mask active)
{
    mask across_z = !b.across_x & !b.across_y, inside = active & (b.exit < w->end);
#define AXIS(a, m)                                                                                \
    w->a += sel_i(active & (m), sel_i(w->d.a > 0.0f, (integer)(1), (integer)(-1)), (integer)(0)); \
    inside = inside & (w->a >= 0) & (w->a < w->n##a);
    AXIS(x, b.across_x)
    AXIS(y, b.across_y)
    AXIS(z, across_z)
#undef AXIS
    return inside;
}

/* The index in the brick of the point that `bits` choose around the ray's point at w.t. */
inline integer grid_corner(GridWalk w, natural bits)
{
    integer at = 0;
#define AXIS(a, shift, step)                                                                                   \
    real p_##a = clamp_r(w.o.a + w.t * w.d.a - to_real(BRICK_CELLS * w.a), (real)(0.0f), (real)(BRICK_CELLS)); \
    integer c_##a = clamp_i(to_integer(p_##a), (integer)(BRICK_CELLS - 1));                                    \
    real u_##a = (to_real(as_integer((bits >> shift) & 1023u)) + 0.5f) * (1.0f / 1024.0f);                     \
    at += step * (c_##a + sel_i(u_##a < p_##a - to_real(c_##a), (integer)(1), (integer)(0)));
    AXIS(x, 0u, 1)
    AXIS(y, 10u, BRICK_POINTS)
    AXIS(z, 20u, BRICK_POINTS * BRICK_POINTS)
#undef AXIS
    return at;
}

/* The density there over the brick's highest. */
inline real brick_density(Scene scene, GridWalk w, GridBrick b, mask active, natural bits)
{
    integer at = grid_corner(w, bits);
    integer word = gather_i(scene.images, sel_i(active, b.points + (at >> w.packed), (integer)(0)));
    return grid_number_at(w.packed, word, at);
}

inline real grid_length(natural bits) { return -log_r(1.0f - unit_interval(bits)); }

/* The colour at the point that `bits` choose; 1 for a grid without colours. Word `at` of a medium's row is the first
 * word of the colours in `images`: a word for each brick, where its points begin from there, and three words for a
 * point, a colour or the coefficients of its curve. Where that word is negative, colours and density are trilinear
 * each by itself: `bits` choose the density's point, and other bits the colour's. Else their product is trilinear. */
inline Spectrum grid_tint(Scene scene, integer name, int at, GridWalk w, mask active, natural bits, Wavelengths lambdas)
{
    integer first = gather_i(scene.materials, sel_i(active, MEDIUM_ROW(name) + at, (integer)(0)));
    active = active & (first != 0);
    bits = sel_n(first < 0, hash_natural(bits ^ 0x94d049bbu), bits);
    first = sel_i(first < 0, -first, first);
    integer brick = (w.z * w.ny + w.y) * w.nx + w.x;
    integer points = first + gather_i(scene.images, sel_i(active, first + brick, (integer)(0)));
    integer point = sel_i(active, points + 3 * grid_corner(w, bits), (integer)(0));
    vec4 words = v4(gather_w(scene.images, point), gather_w(scene.images, point + 1),
                    gather_w(scene.images, point + 2), (real)(1.0f));
    return spectrum_sel(active, spectrum_constant(words, lambdas), spectrum_of(1.0f));
}

#include "generated/grid_steps.cl"

/* The coefficients at the point that `bits` choose, for a density of 1. Colours of albedo and extinction are at most
 * 1, so the majorant of a brick holds at all wavelengths. */
inline Medium grid_medium(Scene scene, integer name, Medium m, GridWalk w, mask active, natural bits,
                          Wavelengths lambdas)
{
    grid_coloured(scene, name, w, active, bits, lambdas, &m);
    grid_tinted(scene, name, w, active, bits, lambdas, &m);
    grid_mixed(scene, name, w, active, bits, lambdas, &m);
    return m;
}

/* Transmittance of t metres from o along d through the medium `name`, estimated by ratio tracking. */
inline Spectrum grid_transmittance(Scene scene, integer name, Medium m, vec3 o, vec3 d, real t, natural key,
                                   mask active, Wavelengths lambdas)
{
    GridWalk w;
    active = grid_begin(scene, name, o, d, t, active, &w);
    real most = max_r(spectrum_max(m.sigma_t), (real)(1e-30f)), inverse = 1.0f / most;
    Spectrum passes = spectrum_of(1.0f);
    Spectrum share = spectrum_scale(m.sigma_t, inverse);
    natural count = 1u, bits = hash_natural(key);
    real left = grid_length(bits) * inverse;
    while (any(active)) {
        GridBrick b = grid_brick(scene, w, active);
        real thick = b.most * (b.exit - w.t);
        mask meets = active & (thick > left);
        w.t = sel(active, sel(meets, min_r(w.t + left / max_r(b.most, (real)(1e-30f)), b.exit), b.exit), w.t);
        left -= sel(active, thick, (real)(0.0f));
        if (any(meets)) {
            bits = hash_natural(key + count * 0x9e3779b9u);
            natural more = hash_natural(bits ^ 0x68bc21ebu);
            real density = brick_density(scene, w, b, meets, more);
            if (GRIDS_VARY)
                share = spectrum_scale(grid_medium(scene, name, m, w, meets, more, lambdas).sigma_t, inverse);
            Spectrum kept = spectrum_sub(spectrum_of(1.0f), spectrum_scale(share, density));
            passes = spectrum_sel(meets, spectrum_mul(passes, kept), passes);
            mask staked = meets & (spectrum_max(passes) < GRID_ROULETTE);
            mask won = staked & (unit_interval(hash_natural(more ^ 0x2f6e2b1u)) < 0.25f);
            passes = spectrum_sel(staked, spectrum_scale(passes, sel(won, (real)(4.0f), (real)(0.0f))), passes);
            active = active & (spectrum_max(passes) > 0.0f);
            left = sel(meets, grid_length(bits) * inverse, left);
            count += sel_n(meets, (natural)(1u), (natural)(0u));
            mask endless = active & (count > MOST_NULL_COLLISIONS);
            passes = spectrum_sel(endless, spectrum_of(INFINITY), passes);
            active = active & !endless;
        }
        active = sel_i(meets, active, grid_next(&w, b, active & !meets));
    }
    return passes;
}

/* Step bytes: numbers on grids, with 8 or 16 bits each. */
inline integer grid_packed(integer name) { return sel_i((name & MEDIUM_BYTES) != 0, (integer)(2), (integer)(1)); }

/* The number at index `at` of a brick over the brick's highest; word: the word that holds it. */
inline real grid_number_at(integer packed, integer word, integer at)
{
    mask small = packed == 2;
    integer place = sel_i(small, (at & 3) << 3, (at & 1) << 4), most = sel_i(small, (integer)(0xff), (integer)(0xffff));
    return to_real((word >> place) & most) / to_real(most);
}

/* Twin, where all numbers have 16 bits. */
inline integer grid_packed(integer name) { return (integer)(1); }
inline real grid_number_at(integer packed, integer word, integer at)
{
    return to_real((word >> ((at & 1) << 4)) & 0xffff) * (1.0f / 65535.0f);
}

/* Step coloured: extinction with colours on a grid. */
inline void grid_coloured(Scene scene, integer name, GridWalk w, mask active, natural bits, Wavelengths lambdas,
                           Medium *m)
{
    Spectrum colour = grid_tint(scene, name, GRID_COLOUR, w, active, bits, lambdas);
    m->sigma_s = spectrum_mul(m->sigma_s, colour);
    m->sigma_t = spectrum_mul(m->sigma_t, colour);
}

/* Twin, where extinction has no colours on a grid. */
inline void grid_coloured(Scene scene, integer name, GridWalk w, mask active, natural bits, Wavelengths lambdas,
                           Medium *m) {}

/* Step tinted: scattering with albedos on a grid. */
inline void grid_tinted(Scene scene, integer name, GridWalk w, mask active, natural bits, Wavelengths lambdas,
                          Medium *m)
{
    m->sigma_s = spectrum_mul(m->sigma_s, grid_tint(scene, name, GRID_ALBEDO, w, active, bits, lambdas));
}

/* Twin, where no albedo is on a grid. */
inline void grid_tinted(Scene scene, integer name, GridWalk w, mask active, natural bits, Wavelengths lambdas,
                          Medium *m) {}

/* Step mixed: mixtures: media on a grid that are made of parts. */

/* In a mixture's row, word GRID_MIXED is 1 + the first word of its shares in `images`; it is 0 for other media. The
 * shares are a word for each brick, where its points begin from there, and for each point the density of GRIDS_MIXED
 * parts over the density of the bricks. Behind word GRID_MIXED follow the phase function's word and the coefficients
 * of each part. The mixture's own coefficients times the density of its bricks bound the sum of all parts: they are
 * the majorant. */
inline integer grid_shares(Scene scene, integer name, GridWalk w, mask active, natural bits)
{
    integer first = gather_i(scene.materials, sel_i(active, MEDIUM_ROW(name) + GRID_MIXED, (integer)(0))) - 1;
    active = active & (first >= 0);
    integer brick = (w.z * w.ny + w.y) * w.nx + w.x;
    integer points = first + gather_i(scene.images, sel_i(active, first + brick, (integer)(0)));
    return sel_i(active, points + GRIDS_MIXED * grid_corner(w, bits), (integer)(0));
}

/* A part of a mixture at the point with its shares at word `shares` of `images`, for a density of the bricks of 1.
 * Lanes without shares get any medium. */
inline Medium grid_part(Scene scene, integer name, int part, integer shares, Wavelengths lambdas)
{
    integer row = MEDIUM_ROW(name) + GRID_MIXED + 2 + part * (1 + 2 * MEDIUM_SCATTERING);
    Medium m = medium_load(scene, sel_i(shares != 0, row + 1, (integer)(0)), lambdas);
    real share = gather_w(scene.images, sel_i(shares != 0, shares + part, (integer)(0)));
    m.sigma_s = spectrum_scale(m.sigma_s, share);
    m.sigma_t = spectrum_scale(m.sigma_t, share);
    return m;
}

/* The mixture of all parts at a point. */
inline void grid_mixed(Scene scene, integer name, GridWalk w, mask active, natural bits, Wavelengths lambdas, Medium *m)
{
    integer shares = grid_shares(scene, name, w, active, bits);
    if (any(shares != 0)) {
        Medium whole = grid_part(scene, name, 0, shares, lambdas);
        for (int i = 1; i < GRIDS_MIXED; i++) {
            Medium part = grid_part(scene, name, i, shares, lambdas);
            whole.sigma_s = spectrum_add(whole.sigma_s, part.sigma_s);
            whole.sigma_t = spectrum_add(whole.sigma_t, part.sigma_t);
        }
        m->sigma_s = spectrum_sel(shares != 0, whole.sigma_s, m->sigma_s);
        m->sigma_t = spectrum_sel(shares != 0, whole.sigma_t, m->sigma_t);
    }
}

/* Twin, where no medium is a mixture. */
inline void grid_mixed(Scene scene, integer name, GridWalk w, mask active, natural bits, Wavelengths lambdas, Medium *m)
{
}

/* Step shadow: shadow rays through media on grids. */

/* The key of the random numbers of a shadow ray. */
inline natural grid_shadow_key(Scene scene, Slab path, uint at)
{
    integer vertex = (load_path_state(path, at) & PATH_DEPTH) + load_path_nulls(path, at);
    return ~grid_key(scene, load_path_pixel_key(path, at), load_path_sample(path, at), vertex);
}

/* The transmittance of a shadow ray through a medium on a grid; for other media the argument. */
inline Spectrum grid_shadow_transmittance(Scene scene, integer medium, vec3 o, vec3 d, real way, natural key,
                                          mask active, Wavelengths lambdas, Spectrum transmittance)
{
    mask gridded = active & ((medium & MEDIUM_GRID) != 0);
    if (any(gridded)) {
        Medium m = medium_load(scene, sel_i(gridded, medium, (integer)(0)), lambdas);
        Spectrum passed = grid_transmittance(scene, medium, m, o, d, way, key, gridded, lambdas);
        transmittance = spectrum_sel(gridded, passed, transmittance);
    }
    return transmittance;
}

/* Twin, where no medium is on a grid. */
inline natural grid_shadow_key(Scene scene, Slab path, uint at) { return ((natural)(0u)); }
inline Spectrum grid_shadow_transmittance(Scene scene, integer medium, vec3 o, vec3 d, real way, natural key,
                                          mask active, Wavelengths lambdas, Spectrum transmittance)
{
    return transmittance;
}
