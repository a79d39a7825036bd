/* Merging along a ray through a medium: photons are collisions of light paths in the medium, and a camera ray gathers
 * the photons near it, wherever the ray itself collides (Jarosz 2008; Krivanek 2014, "Unifying Points, Beams and
 * Paths", the estimator "point-beam 2D"). With the transmittance T along the ray to a photon and the phase function f,
 * sum T f power / (N pi r^2) is radiance: power includes the scattering albedo.
 *
 * Only a window of a long ray gathers photons. Its middle is sampled as collisions are, and light is divided by the
 * probability that the window contains the photon. */
#include "core/warp.cl"
#include "transport/photons/cells.cl"
#include "transport/photons/weight.cl#light"
#include "transport/photons/media.cl"

#define MERGING_STEPS 64.0f  /* of a window at most */
#define MERGING_DEPTH 1.0f   /* its optical depth at most */
#define MERGING_CLEAR 1e-4f  /* share of the mean extinction: wavelengths with less do not determine the window */

/* A camera's ray in a medium. */
typedef struct {
    vec3 o, d;
    real end; /* where it leaves the medium [m] */
    integer medium, depth, group;
    Medium m;
    Spectrum ratio;
    real arrives; /* mis_ratio */
} MergingRay;

/* The part of a ray that gathers photons. */
typedef struct {
    real from, to, reach; /* [m]; reach: half of the window's length, FAR if it contains the whole ray */
    real sigma, all;     /* extinction that samples its middle; probability of a collision before the end */
} MergingWindow;

/* Probability of a middle before t. */
inline real merging_before(MergingWindow w, MergingRay ray, real t)
{
    return (1.0f - exp_r(-w.sigma * clamp_r(t, (real)(0.0f), ray.end))) / w.all;
}

/* u: samples the window; step: length of a step [m]. */
inline MergingWindow merging_window(MergingRay ray, real step, real u)
{
    MergingWindow w;
    real mean = spectrum_mean(ray.m.sigma_t), least = mean;
#define C(c) least = sel(ray.m.sigma_t.c > MERGING_CLEAR * mean, min_r(least, ray.m.sigma_t.c), least);
    SPECTRUM_EACH(C)
#undef C
    real length = min_r(MERGING_STEPS * step, MERGING_DEPTH / max_r(mean, (real)(1e-30f)));
    w.sigma = max_r(least, 1e-3f / ray.end);
    w.all = 1.0f - exp_r(-w.sigma * ray.end);
    mask whole = length >= ray.end;
    w.reach = sel(whole, (real)(FAR), 0.5f * length);
    real middle = -log_r(max_r(1.0f - u * w.all, (real)(1e-9f))) / w.sigma;
    w.from = max_r(middle - w.reach, (real)(0.0f));
    w.to = min_r(middle + w.reach, ray.end);
    return w;
}

/* The probability that the window contains t. */
inline real merging_chance(MergingWindow w, MergingRay ray, real t)
{
    real inside = merging_before(w, ray, t + w.reach) - merging_before(w, ray, t - w.reach);
    return sel(w.reach < FAR, max_r(inside, (real)(1e-6f)), (real)(1.0f));
}

/* Light from the photons of the lanes that are `near`, at t along the ray. */
inline Spectrum merge_photon_along(Photon photon, mask near, MergingRay ray, MergingWindow window, real t, Bsdf bsdf,
                                   Frame frame, real area, real unit, real number)
{
    vec3 wi = to_frame(frame, octahedral_unpack(photon.to_light)), wo = v3(0.0f, 0.0f, 1.0f);
    BsdfPair pair = bsdf_pair(bsdf, wo, wi, ray.ratio);
    real w = photon_weight(photon.mis_ratio, ray.arrives, number, area / unit, pair.p, pair.p_back);
    Spectrum light = photon_light(photon, near, pair, ray.ratio, w / (area * merging_chance(window, ray, t)));
    return spectrum_mul(light, spectrum_exp(spectrum_scale(ray.m.sigma_t, -t)));
}

/* The light of all photons near a ray with their MIS weights, without the path's throughput. u: uniform in [0, 1). */
inline Spectrum merge_along(Scene scene, mask active, MergingRay ray, Bsdf bsdf, integer pass, real u MERGE_ARGS)
{
    global const Settings *settings = scene.settings;
    real radius = merging_radius(scene, pass), half_step = MERGING_BESIDE * radius, step = 2.0f * half_step;
    real beside = merging_beside(scene, pass, ray.m.sigma_t), area = merging_area_along(scene, pass, ray.m.sigma_t);
    real unit = settings->mis_area_unit, number = settings->light_paths, begins = 0.0f, ends = 0.0f;
    MergingWindow window = merging_window(ray, step, u);
    Frame frame = frame_of(neg3(ray.d));
    Spectrum sum = spectrum_of(0.0f);
    integer steps = to_integer(ceil((window.to - window.from) / step));
    integer corner = 0, corners = sel_i(active, 8 * steps, (integer)(0)), entry = 0, end = 0;
    mask empty = corner < corners;
    while (any((entry < end) | empty)) {
        if (any(empty)) { /* the next of the eight cells of a step */
            real at = to_real(corner >> 3);
            begins = sel(empty, window.from + at * step, begins);
            ends = sel(empty, min_r(window.from + (at + 1.0f) * step, window.to), ends);
            vec3 low = sub3(madd3(ray.d, begins + half_step, ray.o), v3(radius, radius, radius));
            Cell c = cell_at(scene, low, 2.0f * radius);
            c.x += corner & 1;
            c.y += corner >> 1 & 1;
            c.z += corner >> 2 & 1;
            integer cell = sel_i(empty, cell_number(scene, c, ray.group), (integer)(0));
            entry = sel_i(empty, gather_i(photon_cells, cell), entry);
            end = sel_i(empty, gather_i(photon_cells, cell + 1), end);
            corner = sel_i(empty, corner + 1, corner);
        }
        mask there = entry < end;
        if (any(there)) {
            integer row = sel_i(there, gather_i(photon_order, sel_i(there, entry, (integer)(0))), (integer)(0));
            row *= PHOTON_WORDS;
            vec3 off = sub3(gather3((global const float *)photons, row), ray.o);
            real t = dot3(off, ray.d);
            off = madd3(ray.d, -t, off);
            mask near = there & (dot3(off, off) < sqr(beside)) & (t >= begins) & (t < ends);
            if (any(near)) {
                Photon photon = photon_row(photons, row);
                near = near & ((photon.depth >> 16) == ray.group) & (as_integer(photon.normal) == ray.medium);
                near = near & ((photon.depth & 0xffff) + ray.depth < settings->max_depth);
                Spectrum light =
                    merge_photon_along(photon, near, ray, window, t, bsdf, frame, area, unit, number);
                sum = spectrum_add(sum, light);
            }
            entry += sel_i(there, (integer)(1), (integer)(0));
        }
        empty = (entry >= end) & (corner < corners);
    }
    return sum;
}
