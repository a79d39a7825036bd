/* Stands for film/scout.cl where no path scouts, or none meets the material. */
#define scout_vertex(scene, path, at, layers, active, v) (active)
