/* Stands for film/scouts.cl where no path scouts. */
#define LAYERS_SCOUT 0
#define path_scouts(state) mask_of(0)
