/* The contract of a boundary between two media, with or without thin films on it: the steps `bare`, `film` and `table`
 * have the same functions, and a program has only the step that it needs. */
typedef struct {
    Spectrum r, t; /* shares of unpolarised light that are reflected and let through; the rest is absorbed */
    real p;        /* probability to choose reflection, symmetric in the wavelengths */
} Boundary;

/* By the amplitudes: the little light that a film reflects often shows a bright light. */
inline real reflection_probability(Spectrum r, Spectrum t)
{
    Spectrum p;
#define C(c) p.c = sqrt(r.c) / max_r(sqrt(r.c) + sqrt(t.c), (real)(1e-20f));
    SPECTRUM_EACH(C)
#undef C
    return spectrum_mean(p);
}

/* Step bare: what a boundary does with light where no material of the kind has layers: Fresnel's equations alone. */
#include "materials/fresnel.cl"

typedef struct { int none; } Layers;

inline Layers layers_none(void) { Layers l = {0}; return l; }

/* Two dielectrics, at cosine cos_i, signed; eta: index of the inside over the outside. */
inline Boundary dielectric_boundary(Layers layers, real cos_i, Spectrum eta, Spectrum outside)
{
    Boundary b;
    b.r = fresnel_spectrum(cos_i, eta);
    b.t = spectrum_sub(spectrum_of(1.0f), b.r);
    b.p = spectrum_mean(b.r);
    return b;
}
/* The same with a common index for all wavelengths, which meet a facet at the same cosine. */
inline Boundary facet_boundary(Layers layers, real cos_i, real eta, Spectrum outside)
{
    Boundary b;
    b.p = fresnel_dielectric(cos_i, eta).f;
    b.r = spectrum_of(b.p);
    b.t = spectrum_of(1.0f - b.p);
    return b;
}
/* A metal's reflectance seen from vacuum, cos_i >= 0. */
inline Spectrum conductor_boundary(Layers layers, real cos_i, Spectrum eta, Spectrum k)
{
    return fresnel_conductor(cos_i, eta, k);
}

/* Step film: what a boundary with thin films does with light, wave by wave: spectral mode. The generated text before
 * this has the structs Layer and Layers, and layer_at. */
#include "materials/fresnel.cl"
#include "materials/film_stack.cl#at_once"

inline Boundary dielectric_boundary(Layers layers, real cos_i, Spectrum eta, Spectrum outside)
{
    mask outward = cos_i < 0.0f;
    Spectrum inside = spectrum_mul(eta, outside);
    Spectrum from = spectrum_sel(outward, inside, outside), to = spectrum_sel(outward, outside, inside);
    Boundary b = thin_film(layers, outward, cos_i, from, to, spectrum_of(0.0f));
    b.p = sel(layers.count > 0, reflection_probability(b.r, b.t), spectrum_mean(b.r));
    return b;
}
inline Boundary facet_boundary(Layers layers, real cos_i, real eta, Spectrum outside)
{
    return dielectric_boundary(layers, cos_i, spectrum_of(eta), outside);
}
inline Spectrum conductor_boundary(Layers layers, real cos_i, Spectrum eta, Spectrum k)
{
    return thin_film(layers, mask_of(0), cos_i, spectrum_of(1.0f), eta, k).r;
}

/* Step table: what a boundary with thin films does with light in RGB mode: the colours that it reflects and lets
 * through under D65, which the host has summed over the wavelengths (clpt/render/materials/thin_films.py). A table has
 * up to three parts: light from outside, from inside, and from the denser side beyond the critical angle. Each holds
 * six numbers, r and t in linear Rec. 709, by profile and by the cosine on the less dense side, where both sides'
 * light agrees; beyond the critical angle by that cosine's imaginary part. */
#include "materials/fresnel.cl"

/* Adds a weighted corner of the interpolation. */
inline Boundary film_corner(Layers layers, integer at, real weight, Boundary sum)
{
    Spectrum r = {gather(layers.scene.spectra, at), gather(layers.scene.spectra, at + 1),
                  gather(layers.scene.spectra, at + 2)};
    Spectrum t = {gather(layers.scene.spectra, at + 3), gather(layers.scene.spectra, at + 4),
                  gather(layers.scene.spectra, at + 5)};
    sum.r = spectrum_madd(r, weight, sum.r);
    sum.t = spectrum_madd(t, weight, sum.t);
    return sum;
}

/* Bilinear look-up; where there are no layers, garbage from valid words. eta: index of the inside over
 * the outside; of a metal 1. */
inline Boundary film_look_up(Layers layers, real cos_i, real eta)
{
    integer rows = max_i(layers.rows, (integer)(1));
    real ratio2 = sqr(max_r(eta, 1.0f / eta)), c2 = min_r(cos_i * cos_i, (real)(1.0f));
    mask dense = (eta < 1.0f) == (cos_i >= 0.0f);
    c2 = sel(dense, 1.0f - (1.0f - c2) * ratio2, c2);
    mask total = dense & (c2 < 0.0f);
    real x = sqrt(fabs(c2) / sel(total, max_r(ratio2 - 1.0f, (real)(1e-6f)), (real)(1.0f)));
    x = clamp_r(x, (real)(0.0f), (real)(1.0f)) * (FILM_COSINES - 1.0f);
    real y = clamp_r(layers.profile, (real)(0.0f), (real)(1.0f)) * to_real(rows - 1);
    integer i = min_i(to_integer(x), (integer)(FILM_COSINES - 2)), j = to_integer(y), next = min_i(j + 1, rows - 1);
    real u = x - to_real(i), v = y - to_real(j);
    integer part = sel_i(total, 2 * rows, sel_i(cos_i < 0.0f, rows, (integer)(0)));
    integer here = layers.table + ((part + j) * FILM_COSINES + i) * 6;
    integer there = layers.table + ((part + next) * FILM_COSINES + i) * 6;
    mask coated = layers.count > 0;
    here = sel_i(coated, here, (integer)(0));
    there = sel_i(coated, there, (integer)(0));
    Boundary b = {spectrum_of(0.0f), spectrum_of(0.0f), (real)(0.0f)};
    b = film_corner(layers, here, (1.0f - u) * (1.0f - v), b);
    b = film_corner(layers, here + 6, u * (1.0f - v), b);
    b = film_corner(layers, there, (1.0f - u) * v, b);
    b = film_corner(layers, there + 6, u * v, b);
    return b;
}

inline Boundary dielectric_boundary(Layers layers, real cos_i, Spectrum eta, Spectrum outside)
{
    mask coated = layers.count > 0;
    Spectrum f = fresnel_spectrum(cos_i, eta);
    Boundary b = film_look_up(layers, cos_i, eta.x);
    b.r = spectrum_sel(coated, b.r, f);
    b.t = spectrum_sel(coated, b.t, spectrum_sub(spectrum_of(1.0f), f));
    b.p = sel(coated, reflection_probability(b.r, b.t), spectrum_mean(b.r));
    return b;
}
inline Boundary facet_boundary(Layers layers, real cos_i, real eta, Spectrum outside)
{
    return dielectric_boundary(layers, cos_i, spectrum_of(eta), outside);
}
inline Spectrum conductor_boundary(Layers layers, real cos_i, Spectrum eta, Spectrum k)
{
    return spectrum_sel(layers.count > 0, film_look_up(layers, cos_i, (real)(1.0f)).r,
                        fresnel_conductor(cos_i, eta, k));
}

/* Step film_layers: the layers of a coated material in spectral mode: LAYER_WORDS words of `materials` each, read in
 * turn at the path's wavelengths. The generated `Layer` and `layer_load` stand before this. */
typedef struct {
    Scene scene;
    integer first, count; /* rows in `materials` */
    TexturePoint point;
    Wavelengths lambdas;
} Layers;
inline Layers layers_load(Scene scene, integer at, TexturePoint point, Wavelengths lambdas)
{
    integer first = gather_i(scene.materials, at), count = gather_i(scene.materials, at + 1);
    return (Layers){scene, first, count, point, lambdas};
}
inline Layer layer_at(Layers l, integer i)
{
    return layer_load(l.scene, l.first + i * LAYER_WORDS, l.point, l.lambdas);
}

/* Step table_layers: the layers of a coated material in RGB mode: where their colours lie in `spectra`, and which
 * share of their thickness is there. The generated `film_profile` stands before this. */
typedef struct {
    Scene scene;
    integer count, table, rows; /* layers; first number in `spectra`; how many profiles it has */
    real profile;
} Layers;
inline Layers layers_load(Scene scene, integer at, TexturePoint point, Wavelengths lambdas)
{
    integer row = gather_i(scene.materials, at);
    return (Layers){scene, gather_i(scene.materials, at + 1), gather_i(scene.materials, row),
                    gather_i(scene.materials, row + 1), film_profile(scene, row + 2, point, lambdas)};
}
