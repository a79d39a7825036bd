/* Flights through a medium with a dye end where the dye may have given out light, also at wavelengths that it lets
 * through: there the extinction tells little of where that is. Of such flights the share DYE_SHARE ends at a distance
 * of its own, never beyond the end of the ray. A dye that takes much is lit where light comes in, so most of these are
 * near one of both ends, and some anywhere. All ways to choose are weighed by their sum. */
#define DYE_SHARE 0.5f
#define DYE_EVEN 0.2f    /* of these, share of those that are anywhere */
#define DYE_TAKES 2.0f   /* about how much more a dye takes at some wavelengths than it gives out at its highest */
#define DYE_FAINT 1e-5f  /* below this much that it gives out, none ends so */

typedef struct {
    real share, rate, whole; /* [1/m]; what of light by that rate does not pass */
    real end;                /* [m] */
} DyeFlight;

inline DyeFlight dye_flight(integer name, Medium m, real end)
{
    DyeFlight f;
    real most = spectrum_max(spectrum_sub(m.sigma_s, m.sigma_t)); /* given out and not taken here */
    mask dyed = ((name & MEDIUM_DYED) != 0) & (most * end > DYE_FAINT) & (end < 0.5f * FAR);
    f.share = sel(dyed, (real)(DYE_SHARE), (real)(0.0f));
    f.end = sel(dyed, end, (real)(1.0f));
    f.rate = sel(dyed, DYE_TAKES * most, (real)(1.0f));
    f.whole = 1.0f - exp_r(-min_r(f.rate * f.end, (real)(80.0f)));
    return f;
}

/* [m] */
inline real dye_distance(DyeFlight f, real u)
{
    mask even = u < DYE_EVEN;
    real rest = (u - DYE_EVEN) * (2.0f / (1.0f - DYE_EVEN));
    mask back = rest >= 1.0f;
    rest = clamp_r(sel(back, rest - 1.0f, rest), (real)(0.0f), (real)(0.99999994f));
    real t = min_r(-log_r(max_r(1.0f - rest * f.whole, (real)(1e-9f))) / f.rate, f.end);
    return sel(even, u * (1.0f / DYE_EVEN) * f.end, sel(back, f.end - t, t));
}

/* [1/m] */
inline real dye_pdf(DyeFlight f, real t)
{
    real front = exp_r(-min_r(f.rate * t, (real)(80.0f)));
    real back = exp_r(-min_r(f.rate * max_r(f.end - t, (real)(0.0f)), (real)(80.0f)));
    real near = 0.5f * f.rate * (front + back) / max_r(f.whole, (real)(1e-30f));
    return DYE_EVEN / f.end + (1.0f - DYE_EVEN) * near;
}
