/* Which paths have ended in the last bounce, for the stages that begin paths. */
#include "film/film.cl"

typedef struct {
    integer state, depth; /* see transport/path_state.cl */
    mask begun;           /* the slot has a path: false before its first one */
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

/* Whether half of the lanes have ended their paths, or no other is in flight. To begin paths takes as long for one lane
 * as for all: where that is long, and paths are short, lanes had better wait for others. */
inline int path_end_of_half(PathEnd e)
{
    mask in_flight = ((e.state & PATH_ALIVE) != 0) & !e.missed;
    return any(e.ended) && (2 * lanes_of(e.ended) >= LANES || !any(in_flight));
}

/* Counts paths that are finished; rays: how many of theirs met a surface. */
inline void path_end_count(global uint *counters, PathEnd e, integer rays)
{
    mask finished = e.ended & e.begun;
    count(counters, COUNTER_SAMPLES, finished, (integer)(1));
    count(counters, COUNTER_CLOSEST, finished, rays + sel_i(e.missed, (integer)(1), (integer)(0)));
    count(counters, COUNTER_SHADOW, finished, (e.state & (PATH_SEEN - 1)) >> 16);
}
