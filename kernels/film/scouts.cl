/* Where fog, thin glass or masks decide by chance what a path meets first, a path goes ahead of each of a pixel's first
 * samples, to the first surface, for layers alone (film/scout.cl). */
#define LAYERS_SCOUT 1
#define PATH_SCOUTS 0x40000000

inline mask path_scouts(integer state) { return (state & PATH_SCOUTS) != 0; }

/* Twin, where no path scouts. */
#define LAYERS_SCOUT 0

inline mask path_scouts(integer state) { return mask_of(0); }
