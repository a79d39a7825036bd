/* Media between surfaces. The name of a medium is 1 + the first word of its row in `materials`, with bits for its kind;
 * 0 is a vacuum. The row holds absorption and scattering [1/m].
 *
 * The interior of an absorbing dielectric is a medium: its transmittance after t metres is exp(-a t) (Bouguer 1729,
 * Lambert 1760, Beer 1852). A path is in the dielectric that it entered last, and when it leaves it, in the medium
 * before: such bodies may touch other shapes, but not contain each other. Their row holds the absorption alone. A
 * boundary without media and absorption leaves a path in its medium.
 *
 * The interiors and exteriors of shapes, and the medium of the camera, have MEDIUM_FLIES in their names:
 * stage/flight.cl samples distances in them. Their rows hold sigma_a and sigma_s, and before them the word of the
 * phase function. Where some media emit, five words with the radiance of a thick body stand before that word. */
#include "generated/medium_bits.cl"
#define MEDIUM_ROW(name) (((name) & 0xffffff) - 1)

#include "generated/medium_steps.cl"

/* The interior medium of a material, by the row of its absorption; 0 without absorption. */
inline integer medium_that_absorbs(Scene scene, integer name)
{
    integer first = max_i(name - 1, (integer)(0));
    mask clear = spectrum_constant_none(row4(scene.materials, first)) & (gather_i(scene.materials, first + 4) == 0);
    return sel_i(clear, (integer)(0), name);
}

/* Transmittance of t metres, t up to FAR; medium_absorption and medium_scattering are generated. */
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

/* The incident medium of a ray at a boundary with the interior `own`, 0 without an interior. A ray without a medium
 * that hits the back began inside, as a camera's ray may. */
inline integer medium_met(integer medium, integer own, mask front)
{
    return sel_i(!front & (medium == 0), own, medium);
}
/* The medium of the ray beyond the boundary; inward: it goes to the back; outside: the exterior, if the shape names
 * it. */
inline integer medium_beyond(integer medium, integer own, integer outside, mask front, mask inward)
{
    mask boundary = (own | outside) != 0;
    return sel_i(boundary, sel_i(inward, own, sel_i(front, medium, outside)), medium);
}
