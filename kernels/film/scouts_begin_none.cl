/* Stands for film/scouts_begin.cl where no path scouts. */
#define scouts_ended(end) mask_of(0)
#define scouts_begin(ended, sample) 0
#define LAYERS_END(end, scouted) ((end).ended & (end).begun)
