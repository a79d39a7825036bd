/* Over what aiming gains, see lights/aiming.cl. */
#define aimed_rival(rival, r) ((rival) / (r).gain)

/* Twin, where no light path is aimed. */
#define aimed_rival(rival, r) (rival)
