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

/* Step. */
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

/* Step dims: `value` times the transmittance of t metres of a medium. */
inline Spectrum medium_dims(Scene scene, integer medium, real t, Wavelengths lambdas, Spectrum value)
{
    return spectrum_mul(value, medium_transmittance(scene, medium, t, lambdas));
}

/* Twin, where a shadow ray may go through several media: tracing/transmittance.cl multiplies as it is traced. */
inline Spectrum medium_dims(Scene scene, integer medium, real t, Wavelengths lambdas, Spectrum value) { return value; }

/* Step lights: the table `media`: first the aims of media/equiangular.cl; then, with light paths, three words for each
 * row of `lights`: the bodies around the light, the name of its medium, and Path.around; then two words for each
 * shape. */
#define MEDIA_OF_SHAPES (4 * MEDIUM_AIMS + 3 * scene.settings->light_count)
#define LIGHT_MEDIA(row, word) gather_i(scene.media, 4 * MEDIUM_AIMS + 3 * (row) + (word))
inline integer light_bodies(Scene scene, integer row) { return LIGHT_MEDIA(row, 0); }
inline integer light_medium(Scene scene, integer row) { return LIGHT_MEDIA(row, 1); }
inline integer light_around(Scene scene, integer row) { return LIGHT_MEDIA(row, 2); }

/* Twin, where no path starts at lights. */
#define MEDIA_OF_SHAPES (4 * MEDIUM_AIMS)
inline integer light_medium(Scene scene, integer row) { return (integer)(0); }

/* Step flies: media of MEDIUM_FLIES: interiors and exteriors of shapes, and the medium of the camera. */
#include "generated/light_media.cl"

/* Extinction: absorption `a`, plus the scattering of such a medium. */
inline Spectrum medium_extinction(Scene scene, integer medium, integer row, Spectrum a, Wavelengths lambdas)
{
    mask flies = (medium & MEDIUM_FLIES) != 0;
    row = sel_i(flies, row + MEDIUM_SCATTERING, (integer)(0));
    Spectrum s = medium_scattering(scene, row, texture_point_nowhere(), lambdas);
    return spectrum_sel(flies, spectrum_add(a, s), a);
}

typedef struct {
    Spectrum sigma_t, sigma_s; /* [1/m] */
    integer phase;             /* material word of its phase function */
} Medium;

/* The coefficients of a medium, in the lanes with MEDIUM_FLIES. */
inline Medium medium_load(Scene scene, integer name, Wavelengths lambdas)
{
    integer row = max_i(MEDIUM_ROW(name), (integer)(1));
    Medium m;
    m.sigma_s = medium_scattering(scene, row + MEDIUM_SCATTERING, texture_point_nowhere(), lambdas);
    m.sigma_t = spectrum_add(m.sigma_s, medium_absorption(scene, row, texture_point_nowhere(), lambdas));
    m.phase = gather_i(scene.materials, row - 1);
    return m;
}

/* 1 + the row of a homogeneous medium in `lights`, 0 if it is no light. */
inline integer medium_light_row(Scene scene, integer name)
{
    integer row = max_i(MEDIUM_ROW(name), (integer)(MEDIUM_LIGHT + 1));
    return sel_i(name != 0, gather_i(scene.materials, row - MEDIUM_LIGHT - 1), (integer)(0));
}

/* Emission of a homogeneous medium [W m^-3 sr^-1 nm^-1]: by Kirchhoff's law its absorption times `light`, the
 * radiance of a thick body. */
inline Spectrum medium_metre(Scene scene, integer name, Medium m, Wavelengths lambdas)
{
    integer row = max_i(MEDIUM_ROW(name), (integer)(MEDIUM_LIGHT)) - MEDIUM_LIGHT;
    Spectrum light = medium_light(scene, row, texture_point_nowhere(), lambdas);
    Spectrum absorbs = spectrum_sub(m.sigma_t, m.sigma_s);
#define C(c) light.c *= max_r(absorbs.c, (real)(0.0f));
    SPECTRUM_EACH(C)
#undef C
    return light;
}

/* Radiance that t metres of a homogeneous medium emit, after their own extinction. */
inline Spectrum medium_emission(Scene scene, integer name, Medium m, real t, Wavelengths lambdas)
{
    Spectrum r = medium_metre(scene, name, m, lambdas);
#define C(c)                                                                             \
    real depth_##c = m.sigma_t.c * t;                                                    \
    real some_##c = (1.0f - exp_r(-depth_##c)) / max_r(m.sigma_t.c, (real)(1e-30f));     \
    r.c *= sel(depth_##c > 1e-2f, some_##c, t * (1.0f - depth_##c * (0.5f - depth_##c * (1.0f / 6.0f))));
    SPECTRUM_EACH(C)
#undef C
    return r;
}

/* The names of the interior and exterior media of a shape. */
typedef struct { integer inside, outside; } ShapeMedia;

inline ShapeMedia shape_media(Scene scene, integer shape)
{
    integer row = MEDIA_OF_SHAPES + 2 * shape;
    return (ShapeMedia){gather_i(scene.media, row), gather_i(scene.media, row + 1)};
}

/* The medium whose transmittance a vertex still applies: none where stage/flight.cl has applied it. */
inline integer medium_left(integer medium) { return sel_i((medium & MEDIUM_FLIES) != 0, (integer)(0), medium); }

/* Twin, where dielectrics absorb and no shape has media. */
#include "generated/light_media.cl"
inline Spectrum medium_extinction(Scene scene, integer medium, integer row, Spectrum a, Wavelengths lambdas)
{
    return a;
}
inline integer medium_left(integer medium) { return medium; }
