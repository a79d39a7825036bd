/* Which paths that ended only scouted: their samples begin anew. */
#include "generated/scouts.cl"

inline mask scouts_ended(PathEnd end) { return end.ended & end.begun & path_scouts(end.state); }

/* The bits of Path.state by which the paths begin that go ahead of their samples. */
inline integer scouts_begin(mask ended, integer sample)
{
    return sel_i(!ended & (sample < LAYER_SAMPLES), (integer)(PATH_SCOUTS), (integer)(0));
}
#define LAYERS_END(end, scouted) (scouted)

/* Twin, where no path scouts. */
#define scouts_ended(end) mask_of(0)
#define scouts_begin(ended, sample) 0
#define LAYERS_END(end, scouted) ((end).ended & (end).begun)
