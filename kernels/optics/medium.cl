/* Media that absorb, inside of dielectrics: exp(-a t) of the light is left after t metres, a [1/m]
 * (Bouguer 1729, Lambert 1760, Beer 1852). A medium is named by 1 + the first word of its coefficient in
 * `materials`; 0 is none. A path is in the medium of the dielectric that it went into last, and in none
 * once it has left one: bodies may touch what is no dielectric, but not hold each other. */

/* What is left of light after t metres, t up to FAR; medium_absorption is generated. */
inline Spectrum medium_transmittance(Scene scene, integer medium, real t, Wavelengths lambdas)
{
    Spectrum r = spectrum_of(1.0f);
    mask inside = medium != 0;
    if (any(inside)) {
        Spectrum a = medium_absorption(scene, max_i(medium - 1, (integer)(0)), texture_point_nowhere(), lambdas);
#define C(c) r.c = sel(inside, exp_r(-a.c * t), r.c);
        SPECTRUM_EACH(C)
#undef C
    }
    return r;
}

/* The medium of a ray that ends on a boundary whose inside is `own` (0: it has none). A ray that knows
 * of no medium but meets the back began inside, as the camera's may. */
inline integer medium_met(integer medium, integer own, mask front)
{
    return sel_i(!front & (medium == 0), own, medium);
}
/* The medium of the ray that goes on from there; inward: to the back of the boundary. */
inline integer medium_beyond(integer medium, integer own, mask front, mask inward)
{
    integer outside = sel_i(front, medium, (integer)(0));
    return sel_i(own == 0, medium, sel_i(inward, own, outside));
}
