/* Path guiding: where scattered light comes from, learned from light paths before the first sample (Jensen 1995,
 * "Importance Driven Path Tracing using the Photon Map").
 *
 * Space is a grid of cells, and a cell has a row for each of six directions that a surface may mostly face; a hash
 * numbers the rows. A row has the equal parts of the sphere of guiding/bins.cl. stage/train.cl adds what light paths
 * carry to the part from which they come, but for those straight from a light, which next-event estimation finds.
 * guiding/sum.cl turns that to sums: guide[row + k] is light from part k and those before it. Then it stays as it is,
 * so that no pixel depends on the order of samples.
 *
 * Where something is known, a camera's path takes its next direction from the guide with the chance GUIDE_SHARE, else
 * from the material; the density of both together counts (one-sample MIS, balance heuristic). There Russian roulette
 * compares what the path will bring, throughput times the light of the row, with that where it met the guide first, as
 * throughput alone is low where the guide is right (after Vorba and Krivanek 2016, "Adjoint-Driven Russian Roulette and
 * Splitting in Light Transport Simulation"). */
#include "guiding/bins.cl"
#include "merging/cells.cl"

#define GUIDE_SHARE 0.6f
#define GUIDE_LEAST 0.3f /* chance that a path goes on */
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
/* What the guide knows where a camera's path is. */
typedef struct {
    integer row;
    real light; /* all that has come there; 0: nothing is known */
    real share; /* the chance that the guide gives the next direction */
} Guided;

/* d: the direction in which the path arrives. */
inline Guided guide_at(Scene scene, global const uint *guide, Surface s, vec3 d)
{
    Guided g;
    g.row = guide_row(scene, s.p, sel3(dot3(s.n, d) < 0.0f, s.n, neg3(s.n)));
    g.light = gather((global const float *)guide, g.row + GUIDE_BINS - 1);
    g.share = sel(g.light > 0.0f, (real)(GUIDE_SHARE), (real)(0.0f));
    return g;
}

/* Density of a direction by guide and material together, which alone has the density p [1/sr]. */
inline real guide_pdf(global const uint *guide, Guided g, vec3 d, real p)
{
    integer bin = guide_bin(d);
    real before = gather((global const float *)guide, g.row + max_i(bin - 1, (integer)(0)));
    real own = gather((global const float *)guide, g.row + bin) - sel(bin > 0, before, (real)(0.0f));
    own *= GUIDE_BINS / (4.0f * PI) / max_r(g.light, (real)(1e-30f));
    return p + g.share * (own - p);
}

/* A direction of the guide. u: chooses the part, v: a point in it. */
inline vec3 guide_direction(global const uint *guide, Guided g, real u, vec2 v)
{
    integer bin = 0;
    for (int step = GUIDE_BINS / 2; step > 0; step /= 2) {
        real sum = gather((global const float *)guide, g.row + bin + (step - 1));
        bin += sel_i(u * g.light >= sum, (integer)(step), (integer)(0));
    }
    real z = (to_real(bin / GUIDE_COLUMNS) + v.x) * (2.0f / GUIDE_ROWS) - 1.0f, s, c;
    sincos_2pi((to_real(bin & (GUIDE_COLUMNS - 1)) + v.y) * (1.0f / GUIDE_COLUMNS), &s, &c);
    real level = sqrt(max_r(1.0f - z * z, (real)(0.0f)));
    return v3(level * c, level * s, z);
}

/* The next direction, of the guide where pick < share, else of the material. pick: uniform in [0, 1), chooses a lobe
 * too. */
inline BsdfSample guide_sample(global const uint *guide, Guided g, Bsdf m, Frame frame, vec3 wo, vec2 uv, real pick,
                               Spectrum *ratio)
{
    mask follows = pick < g.share;
    real lobe = clamp_r((pick - g.share) / (1.0f - g.share), (real)(0.0f), (real)(0.99999994f));
    BsdfSample s = hero_sample(m, wo, v3(uv.x, uv.y, lobe), ratio);
    if (any(follows)) {
        vec3 toward = guide_direction(guide, g, pick * (1.0f / GUIDE_SHARE), uv);
        s.wi = sel3(follows, to_local(frame, toward), s.wi);
        s.lobe = sel_i(follows, (integer)(LOBE_REFLECT), s.lobe);
        s.eta = sel(follows, (real)(1.0f), s.eta);
    }
    mask even = (g.light > 0.0f) & ((s.lobe & LOBE_DELTA) == 0) & (follows | (s.pdf > 0.0f));
    real pdf = guide_pdf(guide, g, normalize3(to_world(frame, s.wi)), hero_pdf(m, wo, s.wi, *ratio));
    Spectrum weight = spectrum_scale(bsdf_eval(m, wo, s.wi), 1.0f / max_r(pdf, (real)(1e-30f)));
    s.weight = spectrum_sel(even, weight, spectrum_scale(s.weight, 1.0f / (1.0f - g.share)));
    s.pdf = sel(even, pdf, s.pdf);
    return s;
}

/* Russian roulette where something is known; returns which paths played. brings: throughput times albedo; u: uniform in
 * [0, 1); beta: the throughput behind. */
inline mask guide_roulette(Slab path, uint at, Guided g, real brings, real u, mask *next, Spectrum *beta)
{
    real light = brings * g.light, first = load_path_expected(path, at);
    mask plays = (light > 0.0f) & (first > 0.0f);
    store_path_expected(path, at, *next & (first == 0.0f), light);
    real q = clamp_r(light / max_r(first, (real)(1e-30f)), (real)(GUIDE_LEAST), (real)(1.0f));
    *next = *next & (!plays | (u < q));
    *beta = spectrum_scale(*beta, sel(plays, 1.0f / q, (real)(1.0f)));
    return plays;
}
#endif
