/* Functions of analytic shapes. Lengths in metres. */
#include "core/rounding.cl"
#include "core/twofold.cl"

/* The azimuth of (x, y) over 2 pi, in [0, 1). */
inline real turn_of(real y, real x)
{
    real turn = atan2_r(y, x) * INV_2PI;
    return turn + sel(turn < 0.0f, (real)(1.0f), (real)(0.0f));
}
