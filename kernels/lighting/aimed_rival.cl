/* Over what aiming gains, see lighting/aiming.cl. */
#define aimed_rival(rival, r) ((rival) / (r).gain)
