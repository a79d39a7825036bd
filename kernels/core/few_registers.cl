/* In place of bvh/no_vectorize.cl for GPU programs that fit FEW_REGISTERS registers: on AMD the number limits the
 * groups in flight. By default its compiler takes up to 156 for 92, and 172 for 154. */
#ifdef __GFX11__
#define NO_VECTORIZE __attribute__((amdgpu_waves_per_eu(1536 / FEW_REGISTERS)))
#elif defined(__GFX10__)
#define NO_VECTORIZE __attribute__((amdgpu_waves_per_eu(1024 / FEW_REGISTERS)))
#else
#define NO_VECTORIZE
#endif
