/* Russian roulette: the chance that a path goes on, by its throughput over what it began with. Where paths
 * end only by chance (a share of 1 each time), a little less than 1 brings them to an end; a path that has
 * still a third of its light is worth its time. Both were measured, see bench/NOTES.md. */
#define ROULETTE_FREE 3.0f
#define ROULETTE_MOST 0.98f

inline real roulette_chance(real strength) { return min_r(ROULETTE_FREE * strength, (real)(ROULETTE_MOST)); }
