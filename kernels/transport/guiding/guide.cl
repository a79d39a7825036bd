/* Path guiding: where scattered light comes from, learned from light paths before the first sample (Jensen 1995,
 * "Importance Driven Path Tracing using the Photon Map").
 *
 * Space is a grid of cells. A cell has a row for each of six directions that a surface may mostly face, and one for
 * collisions in media; a hash numbers the rows. A row has the equal parts of the sphere of transport/guiding/bins.cl.
 * stage/train.cl adds what light paths carry to the part from which they come, but for those straight from a light,
 * which next-event estimation finds: of these it counts what a row has got, behind all rows.
 * transport/guiding/sum.cl turns that to sums: guide[row + k] is light from part k and those before it. Then it stays
 * as it is, so that no pixel depends on the order of samples.
 *
 * Where something is known, two directions are drawn for a camera's path, one by the guide and one by the material,
 * and one of them is taken by what it brings (guide_sample). So a sharp lobe keeps to itself, and a dull one follows
 * the guide, without a word of the material's. There Russian roulette compares what the path will bring, throughput
 * times the light of the row, with that where it met the guide first, as throughput alone is low where the guide is
 * right (after Vorba and Krivanek 2016, "Adjoint-Driven Russian Roulette and Splitting in Light Transport
 * Simulation"). */
#include "transport/guiding/bins.cl"
#include "transport/photons/cells.cl"

#define GUIDE_EVEN 2.0f /* light from everywhere that is expected beside what is known, over that */
#define GUIDE_STRAIGHT 4.0f /* the same of what comes straight from lights, which may be from anywhere above */
#define GUIDE_LEAST 0.5f /* chance that a path goes on */
#define GUIDE_FACES 0x01000193 /* sets the faces of a cell apart, in its hash */

/* Where the row of a point begins. n: normal, on the side from which it is seen. */
inline integer guide_row(Scene scene, vec3 p, vec3 n)
{
    real x = fabs(n.x), y = fabs(n.y), z = fabs(n.z);
    mask is_x = (x >= y) & (x >= z), is_y = !is_x & (y >= z);
    real along = sel(is_x, n.x, sel(is_y, n.y, n.z));
    integer face = sel_i(is_x, (integer)(0), sel_i(is_y, (integer)(2), (integer)(4)));
    face += sel_i(along < 0.0f, (integer)(1), (integer)(0));
    return cell_number(scene, cell_at(scene, p, (real)(scene.settings->guide_side)), face * GUIDE_FACES) * GUIDE_BINS;
}

/* The word of what comes straight from lights to a row. */
inline integer guide_straight(Scene scene, integer row)
{
    return scene.settings->photon_cells * GUIDE_BINS + row / GUIDE_BINS;
}

/* The part of the sphere that holds a direction; some part also where it is not finite, as in idle lanes. */
inline integer guide_bin(vec3 d)
{
    real turn = atan2_r(d.y, d.x) * (0.5f / PI);
    turn -= floor(turn);
    integer row = min_i(to_integer((0.5f * d.z + 0.5f) * GUIDE_ROWS), (integer)(GUIDE_ROWS - 1));
    integer column = min_i(to_integer(turn * GUIDE_COLUMNS), (integer)(GUIDE_COLUMNS - 1));
    return max_i(row, (integer)(0)) * GUIDE_COLUMNS + max_i(column, (integer)(0));
}

#if BSDF_GUIDED
/* d: the direction in which the path arrives. */
inline Guided guide_at(Scene scene, Surface s, vec3 d MERGE_ARGS)
{
    Guided g;
    g.row = 0;
    g.light = 0.0f;
    g.even = 0.0f;
    g.row = guide_row_at(scene, s, d);
    g.light = gather((global const float *)guide, g.row + GUIDE_BINS - 1);
    real straight = gather((global const float *)guide, guide_straight(scene, g.row));
    g.even = GUIDE_EVEN + GUIDE_STRAIGHT * straight / max_r(g.light, (real)(1e-30f));
    return g;
}

/* Density of the directions of a part by the guide alone [1/sr]. own: light that comes from there. */
inline real guide_density_of(Guided g, real own)
{
    return own * (GUIDE_BINS / (4.0f * PI)) / max_r(g.light, (real)(1e-30f));
}

/* Density of a direction by the guide alone [1/sr]. */
inline real guide_density(global const uint *guide, Guided g, vec3 d)
{
    integer bin = guide_bin(d);
    real before = gather((global const float *)guide, g.row + max_i(bin - 1, (integer)(0)));
    real own = gather((global const float *)guide, g.row + bin) - sel(bin > 0, before, (real)(0.0f));
    return guide_density_of(g, own);
}

/* Density by guide and material together, which alone has the density p [1/sr]: the mean, by which light is weighed
 * that is found in two ways. */
inline real guide_pdf(global const uint *guide, Guided g, vec3 d, real p)
{
    mask known = g.light > 0.0f;
    return any(known) ? sel(known, 0.5f * (p + guide_density(guide, g, d)), p) : p;
}

/* The place of `light` among four bits of sums from `first` on, every `step`-th: what lies below and up to there. */
inline integer guide_search(global const uint *guide, integer first, int step, real light, real *below, real *above)
{
    integer found = 0;
    for (int size = GUIDE_ROWS / 2; size > 0; size /= 2) {
        real sum = gather((global const float *)guide, first + (found + (size - 1)) * step);
        mask after = light >= sum;
        found += sel_i(after, (integer)(size), (integer)(0));
        *below = sel(after, sum, *below);
        *above = sel(after, *above, sum);
    }
    return found;
}

/* Where `light` lies between two sums, in [0, 1). */
inline real guide_left(real light, real below, real above)
{
    real left = (light - below) / max_r(above - below, (real)(1e-30f));
    return clamp_r(left, (real)(0.0f), (real)(0.99999994f));
}

/* A direction of the guide. u: its x goes to the height, its y to the turn, so that what is spread evenly stays so.
 * density: of it [1/sr]. */
inline vec3 guide_direction(global const uint *guide, Guided g, vec2 u, real *density)
{
    real light = u.x * g.light, below = 0.0f, above = g.light;
    integer row = guide_search(guide, g.row + (GUIDE_COLUMNS - 1), GUIDE_COLUMNS, light, &below, &above);
    real z = (to_real(row) + guide_left(light, below, above)) * (2.0f / GUIDE_ROWS) - 1.0f, s, c;
    light = below + u.y * (above - below);
    integer column = guide_search(guide, g.row + row * GUIDE_COLUMNS, 1, light, &below, &above);
    *density = guide_density_of(g, above - below);
    sincos_2pi((to_real(column) + guide_left(light, below, above)) * (1.0f / GUIDE_COLUMNS), &s, &c);
    real level = sqrt(max_r(1.0f - z * z, (real)(0.0f)));
    return v3(level * c, level * s, z);
}

/* A direction that may be next. */
typedef struct {
    vec3 wi;
    real guided, material; /* densities of both techniques [1/sr]; guided is 0 where the guide cannot sample it */
    real weight;           /* of what it brings by the mean of the wavelengths: the chance that it is taken, unscaled */
} Candidate;

inline Candidate guide_candidate(vec3 wo, vec3 wi, real guided, real material)
{
    Candidate c;
    c.wi = wi;
    c.guided = sel(guide_leads(wo, wi), guided, (real)(0.0f));
    c.material = material;
    return c;
}

/* The radiance that is expected from a direction, over all that the guide knows. */
inline real guide_expects(Guided g, Candidate c) { return c.guided / guide_cosine(c.wi) + g.even * (0.25f / PI); }

/* The next direction: one of the material and one of the guide are drawn, and one of both is taken, by what it brings
 * of the light that is expected (resampling: Talbot et al. 2005). uv, lobe: of the material; toward: of the guide;
 * chance: uniform in [0, 1), takes one. */
inline BsdfSample guide_sample(global const uint *guide, Guided g, Bsdf m, Frame frame, vec3 wo, vec3 u, vec2 toward,
                               real chance, Spectrum *ratio)
{
    Spectrum before = *ratio;
    BsdfSample s = hero_sample(m, wo, u, ratio);
    mask known = g.light > 0.0f;
    if (!any(known)) return s;
    mask delta = (s.lobe & LOBE_DELTA) != 0;
    real guided = guide_density(guide, g, normalize3(to_world(frame, s.wi)));
    Candidate own = guide_candidate(wo, s.wi, guided, s.pdf);
    real share = sel(delta, (real)(1.0f), s.pdf / max_r(own.material + own.guided, (real)(1e-30f)));
    real brings = spectrum_mean(s.weight);
    own.weight = sel(s.pdf > 0.0f, brings * share * guide_expects(g, own), (real)(0.0f));

    vec3 wi = to_frame(frame, guide_direction(guide, g, toward, &guided));
    Candidate other = guide_candidate(wo, wi, guided, hero_pdf(m, wo, wi, before));
    Spectrum f = bsdf_eval(m, wo, wi);
    real sent = spectrum_mean(f);
    other.weight = sent / max_r(other.material + other.guided, (real)(1e-30f)) * guide_expects(g, other);
    other.weight = sel(other.guided > 0.0f, other.weight, (real)(0.0f));

    real sum = own.weight + other.weight;
    mask follows = known & (chance * sum < other.weight), stays = known & !follows;
    real taken = sum / sel(follows, guide_expects(g, other) * sent, guide_expects(g, own) * brings);
    s.weight = spectrum_sel(known, spectrum_scale(spectrum_sel(follows, f, s.weight), taken), s.weight);
    s.pdf = sel(follows, other.material + other.guided, s.pdf);
    s.pdf = sel(stays & !delta & (s.pdf > 0.0f), own.material + own.guided, s.pdf);
    s.pdf = sel(known & !delta, 0.5f * s.pdf, s.pdf);
    s.wi = sel3(follows, wi, s.wi);
    s.lobe = sel_i(follows, (integer)(GUIDE_LOBE), s.lobe);
    s.eta = sel(follows, (real)(1.0f), s.eta);
    return s;
}

/* Russian roulette where something is known; returns which paths played. brings: throughput times albedo; u: uniform in
 * [0, 1); beta: the throughput behind. */
inline mask guide_roulette(Slab path, uint at, Guided g, real brings, real u, mask *next, Spectrum *beta)
{
    if (!any(g.light > 0.0f)) return mask_of(0);
    real light = brings * g.light, first = load_path_expected(path, at);
    mask plays = (light > 0.0f) & (first > 0.0f);
    store_path_expected(path, at, *next & (first == 0.0f), light);
    real q = clamp_r(light / max_r(first, (real)(1e-30f)), (real)(GUIDE_LEAST), (real)(1.0f));
    *next = *next & (!plays | (u < q));
    *beta = spectrum_scale(*beta, sel(plays, 1.0f / q, (real)(1.0f)));
    return plays;
}
#endif
