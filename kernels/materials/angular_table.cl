/* A density over the cosine of an angle, tabulated for several wavelengths: linear between its cosines and between its
 * rows. `values` has from `first` on the cosines, which ascend from -1 to 1; then for each row its densities [1/sr] and
 * their integrals over directions from -1 on. */
typedef struct {
    global const float *values;
    integer first, cosines, rows;
    Spectrum row; /* which row each wavelength has, with a fraction */
} AngularTable;

/* The index of the last number up to x among the n - 1 ascending numbers from `first`; 0 if all are above x. */
inline integer angular_cell(AngularTable t, integer first, real x)
{
    integer low = 0, high = t.cosines - 2;
    while (any(low < high)) {
        integer middle = (low + high + 1) >> 1;
        mask above = gather(t.values, first + middle) > x, open = low < high;
        low = sel_i(open & !above, middle, low);
        high = sel_i(open & above, middle - 1, high);
    }
    return low;
}
inline integer angular_row(AngularTable t, real row, real *along)
{
    integer i = min_i(to_integer(row), max_i(t.rows - 2, (integer)(0)));
    *along = row - to_real(i);
    return i;
}
/* In a cell, `share` of the way along it. */
inline real angular_at(AngularTable t, integer row, integer cell, real share)
{
    integer at = t.first + t.cosines + 2 * t.cosines * row + cell;
    real a = gather(t.values, at);
    return a + share * (gather(t.values, at + 1) - a);
}
/* The densities at each wavelength [1/sr]. */
inline Spectrum angular_density(AngularTable t, real cosine)
{
    integer cell = angular_cell(t, t.first, cosine);
    real a = gather(t.values, t.first + cell), b = gather(t.values, t.first + cell + 1);
    real share = clamp_r((cosine - a) / (b - a), (real)(0.0f), (real)(1.0f));
    Spectrum r;
#define C(c)                                                                                    \
    {                                                                                           \
        real along;                                                                             \
        integer row = angular_row(t, t.row.c, &along);                                          \
        real near = angular_at(t, row, cell, share);                                            \
        r.c = near;                                                                             \
        if (any(along > 0.0f)) {                                                                \
            integer next = min_i(row + 1, t.rows - 1);                                          \
            r.c = near + along * (angular_at(t, next, cell, share) - near);                     \
        }                                                                                       \
    }
    SPECTRUM_EACH(C)
#undef C
    return r;
}
/* The cosine for a random number u in either row around `at`; the probability of a row is its nearness. */
inline real angular_sample(AngularTable t, real at, real u)
{
    real along;
    integer row = angular_row(t, at, &along);
    mask further = u < along;
    u = sel(further, u / max_r(along, (real)(1e-20f)), (u - along) / max_r(1.0f - along, (real)(1e-20f)));
    u = clamp_r(u, (real)(0.0f), (real)(0.99999994f));
    row = sel_i(further, min_i(row + 1, t.rows - 1), row);
    integer densities = t.first + t.cosines + 2 * t.cosines * row, sums = densities + t.cosines;
    integer cell = angular_cell(t, sums, u);
    real a = gather(t.values, densities + cell), b = gather(t.values, densities + cell + 1);
    real below = gather(t.values, sums + cell), above = gather(t.values, sums + cell + 1);
    real left = clamp_r((u - below) / max_r(above - below, (real)(1e-30f)), (real)(0.0f), (real)(1.0f));
    real root = sqrt_r(a * a + left * (b * b - a * a)), sum = a + root;
    real x = sel(sum > 0.0f, left * (a + b) / max_r(sum, (real)(1e-30f)), (real)(0.5f));
    real from = gather(t.values, t.first + cell), to = gather(t.values, t.first + cell + 1);
    return clamp_r(from + min_r(x, (real)(1.0f)) * (to - from), (real)(-1.0f), (real)(1.0f));
}

/* Step load: an AngularTable from its five words in `materials`: the first value in `distributions`, how many cosines
 * and rows, the wavelength of the first row [nm] and how many rows a nm has. In RGB mode the rows are three, or a
 * single row. */
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
