/* In the place of bvh/no_vectorize.cl for programs of a GPU to which FEW_REGISTERS are enough: AMD's run as many groups
 * as these allow. Left alone their compiler takes up to 156 for 92, and 172 for 154. */
#ifdef __GFX11__
#define NO_VECTORIZE __attribute__((amdgpu_waves_per_eu(1536 / FEW_REGISTERS)))
#elif defined(__GFX10__)
#define NO_VECTORIZE __attribute__((amdgpu_waves_per_eu(1024 / FEW_REGISTERS)))
#else
#define NO_VECTORIZE
#endif
