/* Stands for media/flight_weight.cl where extinction is the same at all wavelengths. */
#define flight_weight(path, at, flies, ratio, f, pdf) spectrum_scale(f, 1.0f / max_r((pdf).x, (real)(1e-30f)))
