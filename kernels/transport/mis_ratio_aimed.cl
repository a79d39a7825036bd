/* The first mis_ratio of a light path over the gain of aiming, see lights/aiming.cl. */
inline real mis_ratio_aimed(real mis_ratio, LightRay r) { return mis_ratio / r.gain; }

/* Twin, without aimed light paths. */
inline real mis_ratio_aimed(real mis_ratio, LightRay r) { return mis_ratio; }
