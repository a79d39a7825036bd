/* The throughput with which a sample began at a camera that weighs its rays: they are traced again. */
inline Spectrum path_start(Scene scene, Slab path, uint at, integer pixel_index, integer sample)
{
    return sample_begin(scene, path, at, mask_of(0), pixel_index, sample).beta;
}

/* Twin, where all rays count alike, or the film has no alpha. */
inline Spectrum path_start(Scene scene, Slab path, uint at, integer pixel_index, integer sample)
{
    return camera_start();
}
