/* Photons of light paths that collide in media. */
typedef struct {
    mask collides;  /* the light path has collided in a medium */
    integer medium;
} Collision;

/* Step. */
#include "transport/photons/media.cl"

/* The collisions of light paths; clears `active` in media without photons. */
inline Collision collision_met(Scene scene, Slab path, Slab hit, uint at, mask *active)
{
    integer part = merging_part(scene, *active, load_hit_material(hit, at));
    Collision c;
    c.collides = photon_collides(MATERIAL_KIND(part));
    c.medium = sel_i(*active, load_path_medium(path, at), (integer)(0));
    *active = *active & (!c.collides | photon_along(MATERIAL_KIND(merging_phase(scene, c.medium))));
    return c;
}

/* Members of a photon at a collision: the medium in place of a normal, and no cosine. */
inline void collision_photon(Slab path, Slab hit, uint at, Collision c, Photon *photon, integer *group)
{
    vec3 p = madd3(load_path_d(path, at), load_hit_t(hit, at), load_path_o(path, at));
    photon->p = sel3(c.collides, p, photon->p);
    photon->normal = sel_n(c.collides, as_natural(c.medium), photon->normal);
    photon->mis_ratio = sel(c.collides, load_path_mis_ratio(path, at), photon->mis_ratio);
    *group = *group | sel_i(c.collides, (integer)(MERGING_IN_MEDIUM), (integer)(0));
}

/* Twin, where there are no media. */
inline Collision collision_met(Scene scene, Slab path, Slab hit, uint at, mask *active)
{
    return (Collision){mask_of(0), (integer)(0)};
}
inline void collision_photon(Slab path, Slab hit, uint at, Collision c, Photon *photon, integer *group) {}
