/* Path.state: depth in bits 0 to 11, flags, number of shadow rays in bits 16 to 27; and the dimensions of a sample. */
#include "generated/path_bits.cl"
#define PATH_DEPTH 0x0fff
#define PATH_SHADOW 0x10000
#define PATH_SEEN 0x10000000 /* layers for denoisers have the path, see film/layers.cl */
#define PATH_GHOST 0x20000000 /* of a lens's samples, of light that two of its surfaces have reflected */

/* Null surfaces (holes, null boundaries, panes) add no depth. Across more, paths and shadow rays end. */
#define MOST_NULL_SURFACES 1024

/* Dimensions of a sample, in pairs: an even dimension and the next are well spread together. Film and first light
 * point, then DIMENSIONS_A_VERTEX a surface, null surfaces too. From _TEXEL, _FLIGHT and _AIM on, each surface has one
 * more pair. */
#define DIMENSION_FILM 0
#define DIMENSION_VERTEX 1
#define DIMENSIONS_A_VERTEX 4
#define DIMENSION_LIGHT 0    /* a point on a light */
#define DIMENSION_CHOICE 1   /* the light, the lobe */
#define DIMENSION_ROULETTE 2 /* Russian roulette; the part of a mixture */
#define DIMENSION_BSDF 3     /* a direction */
#define DIMENSION_LENS 0x50000
#define DIMENSION_WAVELENGTH 0x50001
#define DIMENSION_LIGHT_TIME (DIMENSION_VERTEX + DIMENSION_BSDF) /* of a light path: its first vertex has no BSDF */
#define DIMENSION_TEXEL 0x10000 /* chooses a texel among neighbours */
#define DIMENSION_FLIGHT 0x20000 /* distance of a ray in a medium */
#define DIMENSION_AIM 0x30000 /* chooses a lamp in a medium */

/* MIS weights of met lights need the point where the direction was sampled, `null_distance` [m] before the origin. */
#define path_scattered(path, at, m) store_path_null_distance(path, at, m, (real)(0.0f))

/* Step end: which paths have ended in the last bounce, for the stages that begin paths. */
#include "film/film.cl"

typedef struct {
    integer state, depth; /* Path.state and its bits PATH_DEPTH */
    mask begun;           /* the slot has a path: false before its first path */
    mask missed;          /* the path's last ray left the scene */
    mask ended;           /* the slot is free for another path */
} PathEnd;

inline PathEnd path_end(Slab path, Slab hit, uint at)
{
    PathEnd e;
    e.state = load_path_state(path, at);
    e.depth = e.state & PATH_DEPTH;
    e.begun = (e.state & PATH_FRESH) == 0;
    e.missed = e.begun & ((e.state & PATH_ALIVE) != 0) & (load_hit_prim(hit, at) < 0);
    e.ended = ((e.state & PATH_DONE) == 0) & (((e.state & PATH_ALIVE) == 0) | e.missed);
    return e;
}

/* Whether half of the lanes have ended their paths, or no path is in flight. Beginning paths takes as long for a single
 * lane as for all lanes. If it takes long and paths are short, it is faster to wait for more lanes. */
inline int path_end_of_half(PathEnd e)
{
    mask in_flight = ((e.state & PATH_ALIVE) != 0) & !e.missed;
    return any(e.ended) && (2 * lanes_of(e.ended) >= LANES || !any(in_flight));
}

/* Counts paths that are finished; rays: their rays that met a surface. */
inline void path_end_count(global uint *counters, PathEnd e, integer rays)
{
    mask finished = e.ended & e.begun;
    count(counters, COUNTER_SAMPLES, finished, (integer)(1));
    count(counters, COUNTER_CLOSEST, finished, rays + sel_i(e.missed, (integer)(1), (integer)(0)));
    count(counters, COUNTER_SHADOW, finished, (e.state & (PATH_SEEN - 1)) >> 16);
}
