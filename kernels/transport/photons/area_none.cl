/* Stands for transport/photons/area.cl where no photons are merged: each path has a time and wavelengths of its own. */
#define PATH_BEGUN PATH_ALIVE /* the state in which a path begins at the camera */
#define merging_moment(scene, u, own, pass) (own)
#define merging_wavelength(scene, u, pass) (u)
#define merging_pass(scene, light_path) (light_path)
