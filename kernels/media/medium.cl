/* Media: what light does between surfaces. Its absorption and scattering [1/m] are those of a row in `materials`, and a
 * medium is named by 1 + the first word of that row; 0 is none.
 *
 * The inside of a dielectric that absorbs is one: exp(-a t) of the light is left after t metres (Bouguer 1729, Lambert
 * 1760, Beer 1852). A path is in the medium of the dielectric that it went into last, and in what it came from once it
 * has left that: bodies may touch what is no dielectric, but not hold each other. Its coefficient alone is in the row.
 * What names no media and absorbs nothing leaves a path in the medium where it is.
 *
 * Media that shapes have inside and outside, or the camera around it, have MEDIUM_FLIES in their names: stage/flight.cl
 * dims what rays bring through them. Their rows hold sigma_a and sigma_s, and before them the word of their phase
 * function. Where some media emit, five words of the radiance that a thick body of each would emit stand before that.
 */
#include "generated/medium_bits.cl"
#define MEDIUM_ROW(name) (((name) & 0xffffff) - 1)

#include "generated/medium_steps.cl"

/* The inside of a material, whose absorption stands in the row that it names; 0 where that is 0. */
inline integer medium_that_absorbs(Scene scene, integer name)
{
    integer first = max_i(name - 1, (integer)(0));
    mask clear = spectrum_constant_none(row4(scene.materials, first)) & (gather_i(scene.materials, first + 4) == 0);
    return sel_i(clear, (integer)(0), name);
}

/* What is left of light after t metres, t up to FAR; medium_absorption and medium_scattering are generated. */
inline Spectrum medium_transmittance(Scene scene, integer medium, real t, Wavelengths lambdas)
{
    Spectrum r = spectrum_of(1.0f);
    mask inside = medium != 0;
    if (any(inside)) {
        integer row = max_i(MEDIUM_ROW(medium), (integer)(0));
        Spectrum a = medium_absorption(scene, row, texture_point_nowhere(), lambdas);
        a = medium_extinction(scene, medium, row, a, lambdas);
#define C(c) r.c = sel(inside, exp_r(-a.c * t), r.c);
        SPECTRUM_EACH(C)
#undef C
    }
    return r;
}

#include "generated/medium_dims.cl"

/* The medium of a ray that ends on a boundary whose inside is `own` (0: it has none). A ray that knows
 * of no medium but meets the back began inside, as the camera's may. */
inline integer medium_met(integer medium, integer own, mask front)
{
    return sel_i(!front & (medium == 0), own, medium);
}
/* The medium of the ray that goes on from there; inward: to the back of the boundary; outside: what is before its
 * front, where a shape says so. */
inline integer medium_beyond(integer medium, integer own, integer outside, mask front, mask inward)
{
    mask boundary = (own | outside) != 0;
    return sel_i(boundary, sel_i(inward, own, sel_i(front, medium, outside)), medium);
}
