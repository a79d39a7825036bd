/* The first mis_ratio of a light path over the gain of aiming, see lights/aiming.cl. */
#define mis_ratio_aimed(mis_ratio, r) ((mis_ratio) / (r).gain)

/* Twin, without aimed light paths. */
#define mis_ratio_aimed(mis_ratio, r) (mis_ratio)
