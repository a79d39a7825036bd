/* Over what aiming gains, see lights/aiming.cl. */
inline real aimed_rival(real rival, LightRay r) { return rival / r.gain; }

/* Twin, where no light path is aimed. */
inline real aimed_rival(real rival, LightRay r) { return rival; }
