/* Media: what light does between surfaces. Its absorption and scattering [1/m] are those of a row in `materials`, and a
 * medium is named by 1 + the first word of that row; 0 is none.
 *
 * The inside of a dielectric that absorbs is one: exp(-a t) of the light is left after t metres (Bouguer 1729, Lambert
 * 1760, Beer 1852). A path is in the medium of the dielectric that it went into last, and in none once it has left one:
 * bodies may touch what is no dielectric, but not hold each other. Its coefficient alone is in the row.
 *
 * Media that shapes have inside and outside, or the camera around it, have MEDIUM_FLIES in their names: stage/flight.cl
 * dims what rays bring through them. Their rows hold sigma_a and sigma_s, and before them the word of their phase
 * function. Where some media emit, five words of the radiance that a thick body of each would emit stand before that.
 */
#include "generated/medium_bits.cl"
#define MEDIUM_ROW(name) (((name) & 0xffffff) - 1)

/* What is left of light after t metres, t up to FAR; medium_absorption and medium_scattering are generated. */
inline Spectrum medium_transmittance(Scene scene, integer medium, real t, Wavelengths lambdas)
{
    Spectrum r = spectrum_of(1.0f);
    mask inside = medium != 0;
    if (any(inside)) {
        integer row = max_i(MEDIUM_ROW(medium), (integer)(0));
        Spectrum a = medium_absorption(scene, row, texture_point_nowhere(), lambdas);
#if USES_MEDIA
        mask flies = (medium & MEDIUM_FLIES) != 0;
        row = sel_i(flies, row + MEDIUM_SCATTERING, (integer)(0));
        Spectrum s = medium_scattering(scene, row, texture_point_nowhere(), lambdas);
        a = spectrum_sel(flies, spectrum_add(a, s), a);
#endif
#define C(c) r.c = sel(inside, exp_r(-a.c * t), r.c);
        SPECTRUM_EACH(C)
#undef C
    }
    return r;
}

/* `value` of light after t metres of a medium. Where a ray may go through several, it is dimmed as it is traced, see
 * tracing/transmittance_media.cl. */
inline Spectrum medium_dims(Scene scene, integer medium, real t, Wavelengths lambdas, Spectrum value)
{
#if SHADOW_MEDIA
    return value;
#else
    return spectrum_mul(value, medium_transmittance(scene, medium, t, lambdas));
#endif
}

#if USES_MEDIA
typedef struct {
    Spectrum sigma_t, sigma_s; /* [1/m] */
    integer phase;             /* material word of its phase function */
} Medium;

/* A medium that flies, in the lanes that have one. */
inline Medium medium_load(Scene scene, integer name, Wavelengths lambdas)
{
    integer row = max_i(MEDIUM_ROW(name), (integer)(1));
    Medium m;
    m.sigma_s = medium_scattering(scene, row + MEDIUM_SCATTERING, texture_point_nowhere(), lambdas);
    m.sigma_t = spectrum_add(m.sigma_s, medium_absorption(scene, row, texture_point_nowhere(), lambdas));
    m.phase = gather_i(scene.materials, row - 1);
    return m;
}

#if MEDIA_EMIT
/* What t metres of a medium that is the same everywhere emit, and let through: by Kirchhoff's law a metre emits as much
 * of `light`, the radiance of a thick body, as it absorbs of any. */
inline Spectrum medium_emission(Scene scene, integer name, Medium m, real t, Wavelengths lambdas)
{
    integer row = max_i(MEDIUM_ROW(name), (integer)(MEDIUM_LIGHT)) - MEDIUM_LIGHT;
    Spectrum light = medium_light(scene, row, texture_point_nowhere(), lambdas);
    Spectrum r = spectrum_sub(m.sigma_t, m.sigma_s); /* absorbs, and so emits */
#define C(c)                                                                             \
    real depth_##c = m.sigma_t.c * t;                                                    \
    real some_##c = (1.0f - exp_r(-depth_##c)) / max_r(m.sigma_t.c, (real)(1e-30f));     \
    r.c = max_r(r.c, (real)(0.0f)) * light.c *                                           \
          sel(depth_##c > 1e-2f, some_##c, t * (1.0f - depth_##c * (0.5f - depth_##c * (1.0f / 6.0f))));
    SPECTRUM_EACH(C)
#undef C
    return r;
}
#endif

/* In `media` stand first what media/equiangular.cl reads, then, where paths start at lights, two words for each row of
 * `lights`: the bodies around the light and the name of its medium. Then come two words for each shape. */
#if LIGHT_MEDIA
#define MEDIA_OF_SHAPES (4 * MEDIUM_AIMS + 2 * scene.settings->light_count)
inline integer light_medium(Scene scene, integer row) { return gather_i(scene.media, 4 * MEDIUM_AIMS + 2 * row + 1); }
inline integer light_bodies(Scene scene, integer row) { return gather_i(scene.media, 4 * MEDIUM_AIMS + 2 * row); }
#else
#define MEDIA_OF_SHAPES (4 * MEDIUM_AIMS)
#endif

/* The names of the media behind the front of a shape and before it. */
typedef struct { integer inside, outside; } ShapeMedia;

inline ShapeMedia shape_media(Scene scene, integer shape)
{
    integer row = MEDIA_OF_SHAPES + 2 * shape;
    ShapeMedia m = {gather_i(scene.media, row), gather_i(scene.media, row + 1)};
    return m;
}

/* The medium that a surface has still to dim a ray by: none that it has flown through. */
#define MEDIUM_LEFT(medium) sel_i(((medium) & MEDIUM_FLIES) != 0, (integer)(0), medium)
#else
#define MEDIUM_LEFT(medium) (medium)
#endif

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
