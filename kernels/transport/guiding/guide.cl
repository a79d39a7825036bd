/* Path guiding: where scattered light comes from, learned from light paths before the first sample (Jensen 1995,
 * "Importance Driven Path Tracing using the Photon Map").
 *
 * Space is a grid of cells. A cell has a row for each of the six main directions of normals, and a row for collisions
 * in media; a hash numbers the rows. A row is a histogram over the sphere: GUIDE_BINS bins of equal solid angle.
 * stage/train.cl adds the power of each light path to the bin that it comes from. Paths straight from a light are left
 * out, as next-event estimation finds them; their power is counted once for each row, behind all rows.
 * transport/guiding/sum.cl turns histograms to cumulative sums: guide[row + k] is the light from bins 0 to k. Then the
 * guide stays constant, so that no pixel depends on the order of samples.
 *
 * Where a row has light, a camera path samples two candidate directions, by the guide and by the material, and
 * resampling selects a candidate (guide_sample). So narrow lobes follow the material and wide lobes the guide, without
 * a parameter of the material. There Russian roulette compares the expected contribution, throughput times the light of
 * the row, with the expected contribution where the path first met the guide, because the throughput alone is low where
 * the guide is right (after Vorba and Krivanek 2016, "Adjoint-Driven Russian Roulette and Splitting in Light Transport
 * Simulation"). */

/* Step. */
#include "transport/guiding/guide.cl#bins"
#include "transport/photons/cells.cl"

#define GUIDE_EVEN 2.0f /* uniform light that is expected in addition, over the light of the row */
#define GUIDE_STRAIGHT 4.0f /* likewise over direct light, which may come from any direction above */
#define GUIDE_LEAST 0.5f /* probability to continue */
#define GUIDE_FACES 0x01000193 /* distinguishes the faces of a cell in its hash */

/* The first word of a point's row. n: normal, on the viewer's side. */
inline integer guide_row(Scene scene, vec3 p, vec3 n)
{
    real x = fabs(n.x), y = fabs(n.y), z = fabs(n.z);
    mask is_x = (x >= y) & (x >= z), is_y = !is_x & (y >= z);
    real along = sel(is_x, n.x, sel(is_y, n.y, n.z));
    integer face = sel_i(is_x, (integer)(0), sel_i(is_y, (integer)(2), (integer)(4)));
    face += sel_i(along < 0.0f, (integer)(1), (integer)(0));
    return cell_number(scene, cell_at(scene, p, (real)(scene.settings->guide_side)), face * GUIDE_FACES) * GUIDE_BINS;
}

/* The word of a row's direct light. */
inline integer guide_straight(Scene scene, integer row)
{
    return scene.settings->photon_cells * GUIDE_BINS + row / GUIDE_BINS;
}

/* The bin of a direction; any bin where it is not finite, as in idle lanes. */
inline integer guide_bin(vec3 d)
{
    real turn = atan2_r(d.y, d.x) * (0.5f / PI);
    turn -= floor(turn);
    integer row = min_i(to_integer((0.5f * d.z + 0.5f) * GUIDE_ROWS), (integer)(GUIDE_ROWS - 1));
    integer column = min_i(to_integer(turn * GUIDE_COLUMNS), (integer)(GUIDE_COLUMNS - 1));
    return max_i(row, (integer)(0)) * GUIDE_COLUMNS + max_i(column, (integer)(0));
}

#if BSDF_GUIDED
/* d: direction of the incident ray. */
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

/* Density of the directions of a bin by the guide alone [1/sr]. own: light of the bin. */
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

/* Density of guide and material together, where the material alone has the density p [1/sr]: their mean, which MIS
 * weights use. */
inline real guide_pdf(global const uint *guide, Guided g, vec3 d, real p)
{
    mask known = g.light > 0.0f;
    return any(known) ? sel(known, 0.5f * (p + guide_density(guide, g, d)), p) : p;
}

/* Binary search of `light` in GUIDE_ROWS sums from `first` on, in steps of `step`; below, above: the sums around it. */
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

/* Samples a direction of the guide. u: x selects the height, y the azimuth, so that stratification is kept. density: of
 * the direction [1/sr]. */
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

/* A candidate for the next direction. */
typedef struct {
    vec3 wi;
    real guided, material; /* densities of both techniques [1/sr]; guided is 0 where the guide cannot sample wi */
    real weight;           /* expected contribution, by the mean of the wavelengths: unnormalized probability */
} Candidate;

inline Candidate guide_candidate(vec3 wo, vec3 wi, real guided, real material)
{
    Candidate c;
    c.wi = wi;
    c.guided = sel(guide_leads(wo, wi), guided, (real)(0.0f));
    c.material = material;
    return c;
}

/* The radiance that is expected from a direction, over all light of the row. */
inline real guide_expects(Guided g, Candidate c) { return c.guided / guide_cosine(c.wi) + g.even * (0.25f / PI); }

/* The next direction by resampling (Talbot et al. 2005): a candidate of the material and a candidate of the guide,
 * selected in proportion to their expected contributions. u: random numbers of the material; toward: of the guide;
 * chance: uniform in [0, 1), selects the candidate. */
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

/* Russian roulette where the row has light; returns the lanes that took part. brings: throughput times albedo; u:
 * uniform in [0, 1); beta: the throughput after the vertex. */
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

/* Step at_surface: the guide at a surface: it holds the flux on the side of wo alone. */
#define GUIDE_COSINE 0.1f /* the least cosine that divides flux for radiance */
#define GUIDE_LOBE LOBE_REFLECT
#define guide_row_at(scene, s, d) guide_row(scene, (s).p, sel3(dot3((s).n, d) < 0.0f, (s).n, neg3((s).n)))
#define guide_leads(wo, wi) ((wi).z * (wo).z > 0.0f)
#define guide_cosine(wi) max_r(fabs((wi).z), (real)(GUIDE_COSINE))

/* Step at_collision: the guide at a collision in a medium: it holds light of all directions, without a cosine. */
#include "transport/guiding/guide.cl#row_of_collision"

#define GUIDE_LOBE LOBE_TRANSMIT
#define guide_row_at(scene, s, d) guide_row_of_collision(scene, (s).p)
#define guide_leads(wo, wi) mask_of(1)
#define guide_cosine(wi) ((real)(1.0f))

/* Step bins: the bins of a guide's row over the sphere, of equal solid angle: in height, and around z. */
#define GUIDE_ROWS 16
#define GUIDE_COLUMNS 16
#define GUIDE_BINS (GUIDE_ROWS * GUIDE_COLUMNS)

/* Step row_of_collision: the first word of the row of a point in a medium. */
#include "transport/guiding/guide.cl#bins"
#include "transport/photons/cells.cl"

#define GUIDE_IN_MEDIUM 0x600d10c5 /* distinguishes it from the faces of its cell */

inline integer guide_row_of_collision(Scene scene, vec3 p)
{
    return cell_number(scene, cell_at(scene, p, (real)(scene.settings->guide_side)), (integer)(GUIDE_IN_MEDIUM)) *
           GUIDE_BINS;
}

/* Step collisions: light paths that collide in media add their power to rows of their own. */
#include "generated/medium.cl"
#include "generated/phases.cl"
#include "transport/photons/media.cl"
#include "transport/guiding/guide.cl#row_of_collision"

#define GUIDE_THIN 0.0625f /* limits of 4 sigma_s times a cell's side: beyond them */
#define GUIDE_DENSE 4.0f   /* whole numbers would not resolve the power */

/* The row of a light path, which is `row` on a surface. shared: divisor of its light, so that Russian roulette can
 * compare collisions and surfaces: in uniform light, the power that collides in a cell is 4 sigma_s times the cell's
 * side of the power on a side. */
inline integer collision_row(Scene scene, Slab path, Slab hit, uint at, mask active, integer row, real *shared)
{
    integer part = merging_part(scene, active, load_hit_material(hit, at));
    mask collides = active & is_phase(MATERIAL_KIND(part));
    if (!any(collides)) return row;
    integer name = sel_i(collides, load_path_medium(path, at), (integer)(0));
    real sigma = spectrum_mean(medium_load(scene, name, load_path_lambdas(path, at)).sigma_s);
    real counts = clamp_r(4.0f * sigma * scene.settings->guide_side, (real)(GUIDE_THIN), (real)(GUIDE_DENSE));
    *shared = sel(collides, counts, *shared);
    vec3 p = madd3(load_path_d(path, at), load_hit_t(hit, at), load_path_o(path, at));
    return sel_i(collides, guide_row_of_collision(scene, p), row);
}

/* Twin, where there are no media. */
inline integer collision_row(Scene scene, Slab path, Slab hit, uint at, mask active, integer row, real *shared)
{
    return row;
}
