/* Which paths that ended only scouted: their samples begin anew. */
#include "generated/scouts.cl"

inline mask scouts_ended(PathEnd end) { return end.ended & end.begun & path_scouts(end.state); }

/* The bits of Path.state by which the paths begin that go ahead of their samples. */
inline integer scouts_begin(mask ended, integer sample)
{
    return sel_i(!ended & (sample < LAYER_SAMPLES), (integer)(PATH_SCOUTS), (integer)(0));
}

/* Which paths have ended that add to layers. */
inline mask layers_end(PathEnd end, mask scouted) { return scouted; }

/* Twin, where no path scouts. */
inline mask scouts_ended(PathEnd end) { return mask_of(0); }
inline integer scouts_begin(mask ended, integer sample) { return (integer)(0); }
inline mask layers_end(PathEnd end, mask scouted) { return end.ended & end.begun; }
