/* How paths that scout choose among the parts of a mixture: by the numbers of their samples, turned so that the first
 * sample has 1/2. So an id is that of the part whose share is the half of the whole or more, and no chance. */
#include "transport/path_state.cl"
#include "generated/scouts.cl"

inline real scout_choice(Scene scene, natural key, integer state, natural dimension, real u)
{
    Sampler first = pixel_sampler(scene.settings, key, (integer)(0));
    real turned = u + 0.5f - sampler_pair(first, dimension).y;
    return sel(path_scouts(state), turned - floor(turned), u);
}

/* Twin, where no path scouts. */
inline real scout_choice(Scene scene, natural key, integer state, natural dimension, real u) { return u; }
