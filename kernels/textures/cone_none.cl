/* Stands for textures/cone.cl where no image has levels to choose among. */
typedef integer Cone;
#define cone_after(word, t) (word)
#define cone_footprint(c, d, n, dpdu, dpdv) ((real)(0.0f))
