/* An AngularTable from its five words in `materials`: the first value in `distributions`, how many cosines and rows,
 * the wavelength of the first row [nm] and how many rows a nm has. In RGB mode the rows are three, or a single row. */
inline AngularTable angular_load(Scene scene, integer at, Wavelengths lambdas)
{
    AngularTable t;
    t.values = scene.distributions;
    t.first = gather_i(scene.materials, at);
    t.cosines = gather_i(scene.materials, at + 1);
    t.rows = gather_i(scene.materials, at + 2);
    real last = to_real(t.rows - 1);
#if SPECTRUM_SIZE == 4
    real start = as_real(gather_i(scene.materials, at + 3)), scale = as_real(gather_i(scene.materials, at + 4));
#define C(c) t.row.c = clamp_r((lambdas.c - start) * scale, (real)(0.0f), last);
    SPECTRUM_EACH(C)
#undef C
#else
    t.row.x = (real)(0.0f);
    t.row.y = min_r(last, (real)(1.0f));
    t.row.z = last;
#endif
    return t;
}
