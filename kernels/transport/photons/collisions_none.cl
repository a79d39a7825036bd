/* Stands for transport/photons/collisions.cl where there are no media. */
typedef integer Collision;
#define collision_met(scene, path, hit, at, active) ((integer)(0))
#define collision_photon(path, hit, at, c, photon, group)
