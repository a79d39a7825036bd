/* Media of MEDIUM_FLIES: interiors and exteriors of shapes, and the medium of the camera. */
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
    ShapeMedia m = {gather_i(scene.media, row), gather_i(scene.media, row + 1)};
    return m;
}

/* The medium whose transmittance a vertex still applies: none where stage/flight.cl has applied it. */
inline integer medium_left(integer medium) { return sel_i((medium & MEDIUM_FLIES) != 0, (integer)(0), medium); }

/* Twin, where dielectrics absorb and no shape has media. */
inline Spectrum medium_extinction(Scene scene, integer medium, integer row, Spectrum a, Wavelengths lambdas)
{
    return a;
}
inline integer medium_left(integer medium) { return medium; }
