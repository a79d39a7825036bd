/* In the place of bvh/no_vectorize.cl for programs of a GPU that need few registers: AMD's run as many groups as 128
 * registers a work-item allow. Left alone their compiler takes up to 156. */
#ifdef __GFX11__
#define NO_VECTORIZE __attribute__((amdgpu_waves_per_eu(12)))
#elif defined(__GFX10__)
#define NO_VECTORIZE __attribute__((amdgpu_waves_per_eu(8)))
#else
#define NO_VECTORIZE
#endif
