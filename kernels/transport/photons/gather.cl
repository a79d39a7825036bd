/* Vertex merging: light from the photons of a pass around a vertex of a camera's path (Georgiev 2012; Jensen 1996).
 *
 * A photon is a vertex of a light path behind a specular vertex. The photons in a disk of radius r around x are light
 * per area, so that sum f power / (N pi r^2) is radiance, N being the number of light paths; f has no cosine. Each is
 * weighed (MIS) against all other techniques for its path, see transport/mis_ratio.cl. Photons on surfaces of another
 * orientation, or off the disk's plane, are left out. */
#include "core/warp.cl"
#include "transport/photons/cells.cl"
#include "transport/photons/weight.cl#light"

#define MERGING_FLAT 0.5f    /* largest distance of photons off the plane, over the radius */
#define MERGING_TURN 0.866f  /* least cosine between the normals */

/* Light from a photon for each lane of `near`, without the path's throughput. unit: of areas in MIS ratios [m^2]. */
inline Spectrum merge_photon(Photon photon, mask near, Vertex v, Scattering scatter, MisRatio mis_ratio,
                             Spectrum ratio, real area, real unit, real number)
{
    vec3 to = octahedral_unpack(photon.to_light), wi = to_frame(scatter.shading.frame, to);
    BsdfPair pair = bsdf_pair(scatter.bsdf, scatter.wo, wi, ratio);
    real w = photon_weight(photon.mis_ratio, mis_ratio.arrives, number, area / unit, pair.p, pair.p_back);
    real share = shading_frame_share(scatter.shading, to);
    real scale = w * share / (area * max_r(fabs(dot3(v.s.n, to)), (real)(1e-3f)));
    return photon_light(photon, near, pair, ratio, scale);
}

/* The light of all photons around a vertex with their MIS weights, without the path's throughput. ratio: of the
 * camera's path, see spectra/hero.cl. */
inline Spectrum merge_photons(Scene scene, mask active, Vertex v, Scattering scatter, MisRatio mis_ratio,
                              Spectrum ratio, integer pass MERGE_ARGS)
{
    global const Settings *settings = scene.settings;
    integer group = merging_group_of(scene, scatter.sampler);
    real radius = merging_radius(scene, pass), area = merging_area(scene, pass);
    real unit = settings->mis_area_unit, number = settings->light_paths;
    Spectrum sum = spectrum_of(0.0f);
    Cell first = cell_at(scene, sub3(v.s.p, v3(radius, radius, radius)), 2.0f * radius);
    /* Each lane goes through the photons of its own eight cells. */
    integer corner = sel_i(active, (integer)(0), (integer)(8)), entry = 0, end = 0;
    mask empty = corner < 8;
    while (any((entry < end) | empty)) {
        if (any(empty)) {
            Cell c = {first.x + (corner & 1), first.y + (corner >> 1 & 1), first.z + (corner >> 2)};
            integer cell = sel_i(empty, cell_number(scene, c, group), (integer)(0));
            entry = sel_i(empty, gather_i(photon_cells, cell), entry);
            end = sel_i(empty, gather_i(photon_cells, cell + 1), end);
            corner = sel_i(empty, corner + 1, corner);
        }
        mask there = entry < end;
        if (any(there)) {
            integer row = sel_i(there, gather_i(photon_order, sel_i(there, entry, (integer)(0))), (integer)(0));
            row *= PHOTON_WORDS;
            vec3 off = sub3(gather3((global const float *)photons, row), v.s.p);
            mask near = there & (dot3(off, off) < sqr(radius)) & (fabs(dot3(off, v.s.n)) < MERGING_FLAT * radius);
            if (any(near)) {
                Photon photon = photon_row(photons, row);
                near = near & ((photon.depth >> 16) == group);
                near = near & ((photon.depth & 0xffff) + v.depth < settings->max_depth);
                near = near & (fabs(dot3(octahedral_unpack(photon.normal), v.s.n)) > MERGING_TURN);
                Spectrum light = merge_photon(photon, near, v, scatter, mis_ratio, ratio, area, unit, number);
                sum = spectrum_add(sum, light);
            }
            entry += sel_i(there, (integer)(1), (integer)(0));
        }
        empty = (entry >= end) & (corner < 8);
    }
    return sum;
}
