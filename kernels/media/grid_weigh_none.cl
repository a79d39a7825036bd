/* Stands for media/grid_weigh.cl where extinction is the same at all wavelengths. */
inline void grid_weigh(Medium m, real thickness, Spectrum value, Spectrum pdf, mask active, GridFlight *f)
{
    Spectrum weight = spectrum_scale(value, 1.0f / max_r(pdf.x, (real)(1e-30f)));
    f->weight = spectrum_sel(active, spectrum_mul(f->weight, weight), f->weight);
}
#define grid_hero(bits) ((real)(0.0f))
#define grid_weigh_end(m, thickness, active, f)
