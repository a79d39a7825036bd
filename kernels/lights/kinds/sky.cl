/* A sky: an image of the sky's dome above an image of the ground, and the sun's disc. +y is up, z the level direction
 * toward the sun. Rows of the dome's image run from the zenith to the horizon, those of the ground's from the horizon
 * to the nadir, both dense at the horizon (their angle to it is a square); columns go around from z toward x. Both
 * halves are equal, so texels hold a single half. The disc has an image of its own: its rows run from the lower edge to
 * the upper edge, its columns from the edge to the middle by the cosine at the sun's surface. Radiance [W m^-2 sr^-1
 * nm^-1] comes from clpt/sky/skylight.py. */
#include "core/grid.cl"
#include "generated/sky_sizes.cl"

/* Four texels, and the place between them. */
typedef struct {
    integer i00, i10, i01, i11;
    vec2 at;
} SkyTexels;

/* A cell of the dome or the ground. */
typedef struct {
    integer row, column;
    vec2 at;
    real area; /* solid angle of a cell here [sr] */
    mask up;   /* above the horizon */
} SkyPoint;

inline Grid sky_grid(Sky l)
{
    return (Grid){2 * l.height, l.width, (integer)(2), l.corners, l.marginal, l.conditional, l.blocks, l.block_rows,
                  l.block_columns, l.norm};
}

inline integer sky_receiver(Sky l, vec3 n)
{
    return grid_receiver(sky_grid(l), hemisphere_given(n), v3(dot3(n, l.x), dot3(n, l.y), dot3(n, l.z)));
}

/* root: of the angle to the horizon over the whole; span: the whole [rad]; level: cosine of the elevation. */
inline real sky_area(Sky l, real root, real span, real level)
{
    return max_r(2.0f * root * span * level * (2.0f * PI) / (to_real(l.height) * to_real(l.width)), (real)(1e-12f));
}

inline SkyPoint sky_point(Sky l, vec3 d)
{
    real x = dot3(d, l.x), y = dot3(d, l.y), z = dot3(d, l.z), level = sqrt(x * x + z * z);
    real angle = atan2_r(y, level) - l.horizon, rows = to_real(l.height);
    SkyPoint p;
    p.up = angle >= 0.0f;
    real span = 0.5f * PI - sel(p.up, l.horizon, -l.horizon), root = sqrt_r(min_r(fabs(angle) / span, (real)(1.0f)));
    real row = rows * sel(p.up, 1.0f - root, root), turn = atan2_r(x, z) * INV_2PI;
    real column = (turn + sel(turn < 0.0f, (real)(1.0f), (real)(0.0f))) * to_real(l.width);
    p.row = clamp_i(to_integer(row), l.height - 1);
    p.column = clamp_i(to_integer(column), l.width - 1);
    p.at.x = column - to_real(p.column);
    p.at.y = row - to_real(p.row);
    p.row += sel_i(p.up, (integer)(0), l.height);
    p.area = sky_area(l, root, span, level);
    return p;
}

/* Columns beyond the half are those before it, mirrored. */
inline integer sky_column(Sky l, integer column) { return min_i(column, l.width - column); }

inline SkyTexels sky_texels(Sky l, SkyPoint p)
{
    integer across = l.width / 2 + 1, left = sky_column(l, p.column), right = sky_column(l, p.column + 1);
    integer first = (p.row + sel_i(p.up, (integer)(0), (integer)(1))) * across;
    return (SkyTexels){first + left, first + right, first + across + left, first + across + right, p.at};
}

/* Where a direction meets the disc: its texels, and whether it does. */
inline mask sky_disc(Sky l, vec3 d, SkyTexels *t)
{
    vec3 own = v3(dot3(d, l.x), dot3(d, l.y), dot3(d, l.z));
    real a = own.x / l.sun_radius, b = (l.sun_cos * own.y - l.sun_sin * own.z) / l.sun_radius;
    real inside = 1.0f - a * a - b * b;
    real column = sqrt_r(clamp_r(inside, (real)(0.0f), (real)(1.0f))) * (SKY_SUN_COLUMNS - 1);
    real row = clamp_r(0.5f * b + 0.5f, (real)(0.0f), (real)(1.0f)) * (SKY_SUN_ROWS - 1);
    integer i = clamp_i(to_integer(row), (integer)(SKY_SUN_ROWS - 2));
    integer j = clamp_i(to_integer(column), (integer)(SKY_SUN_COLUMNS - 2));
    t->i00 = i * SKY_SUN_COLUMNS + j;
    t->i10 = t->i00 + 1;
    t->i01 = t->i00 + SKY_SUN_COLUMNS;
    t->i11 = t->i01 + 1;
    t->at.x = column - to_real(j);
    t->at.y = row - to_real(i);
    return (inside > 0.0f) & (own.y * l.sun_sin + own.z * l.sun_cos > 0.0f);
}

/* Share of samples that go to the disc, 0 where none of it shines on the hemisphere. */
inline real sky_sun_share(Sky l, vec3 hemisphere)
{
    vec3 toward = madd3(l.y, l.sun_sin, scale3(l.z, l.sun_cos));
    mask behind = hemisphere_given(hemisphere) & (dot3(hemisphere, toward) < -l.sun_radius);
    return sel(behind, (real)(0.0f), l.sun_share);
}

/* Density of points that lie evenly on the disc as it is seen [1/sr]. */
inline real sky_sun_pdf(Sky l, vec3 d)
{
    real facing = dot3(d, madd3(l.y, l.sun_sin, scale3(l.z, l.sun_cos)));
    return facing * INV_PI / (l.sun_radius * l.sun_radius);
}

inline real sky_density(Sky l, Scene scene, vec3 hemisphere, vec3 d, SkyPoint p, mask disc)
{
    real share = sky_sun_share(l, hemisphere);
    real around = grid_pdf(scene, sky_grid(l), sky_receiver(l, hemisphere), p.row, p.column, p.at) / p.area;
    return (1.0f - share) * around + sel(disc, share * sky_sun_pdf(l, d), (real)(0.0f));
}

inline Spectrum sky_of(Sky l, Scene scene, SkyPoint p, mask disc, SkyTexels sun, Wavelengths lambdas)
{
    SkyTexels t = sky_texels(l, p);
    Spectrum sum = texels_between(scene, l.texels, t.i00, t.i10, t.i01, t.i11, t.at, lambdas);
    mask shines = disc & p.up;
    if (any(shines)) {
        Spectrum s = texels_between(scene, l.sun_texels, sun.i00, sun.i10, sun.i01, sun.i11, sun.at, lambdas);
        sum = spectrum_madd(s, sel(shines, (real)(1.0f), (real)(0.0f)), sum);
    }
    return sum;
}

Spectrum sky_radiance(Sky l, Scene scene, vec3 d, Wavelengths lambdas)
{
    SkyTexels sun;
    mask disc = sky_disc(l, d, &sun);
    return sky_of(l, scene, sky_point(l, d), disc, sun, lambdas);
}

real sky_pdf(Sky l, Scene scene, vec3 hemisphere, vec3 d)
{
    SkyTexels sun;
    mask disc = sky_disc(l, d, &sun);
    return sky_density(l, scene, hemisphere, d, sky_point(l, d), disc);
}

/* A direction: on the disc, or by the grid. */
inline vec3 sky_direction(Sky l, Scene scene, vec3 hemisphere, vec2 u)
{
    real share = sky_sun_share(l, hemisphere), turn, sine, cosine;
    mask sun = u.x < share;
    u.x = min_r(sel(sun, u.x / max_r(share, (real)(1e-20f)), (u.x - share) / max_r(1.0f - share, (real)(1e-20f))),
                (real)(0.99999994f));
    sincos_2pi(u.x, &sine, &cosine);
    real radius = l.sun_radius * sqrt(u.y), a = radius * cosine, b = radius * sine;
    real c = sqrt(1.0f - radius * radius);
    vec3 disc = v3(a, b * l.sun_cos + c * l.sun_sin, c * l.sun_cos - b * l.sun_sin);
    GridPoint g = grid_sample(scene, sky_grid(l), sky_receiver(l, hemisphere), u);
    mask up = g.row < l.height;
    real row = (to_real(g.row) + g.at.y) / to_real(l.height), down = row - 1.0f, rise = 1.0f - row;
    real angle = l.horizon + sel(up, rise * rise * (0.5f * PI - l.horizon), -down * down * (0.5f * PI + l.horizon));
    sincos_2pi(angle * INV_2PI - floor(angle * INV_2PI), &sine, &cosine);
    real high = sine, level = max_r(cosine, (real)(0.0f));
    turn = (to_real(g.column) + g.at.x) / to_real(l.width);
    sincos_2pi(turn - floor(turn), &sine, &cosine);
    vec3 around = v3(level * sine, high, level * cosine), own = sel3(sun, disc, around);
    return madd3(l.x, own.x, madd3(l.y, own.y, scale3(l.z, own.z)));
}

LightSample sky_sample(Sky l, Scene scene, vec3 hemisphere, vec2 u, Wavelengths lambdas)
{
    LightSample s;
    SkyTexels sun;
    s.wi = sky_direction(l, scene, hemisphere, u);
    s.t = FAR;
    SkyPoint p = sky_point(l, s.wi);
    mask disc = sky_disc(l, s.wi, &sun);
    s.radiance = sky_of(l, scene, p, disc, sun, lambdas);
    s.pdf = sky_density(l, scene, hemisphere, s.wi, p, disc);
    return s;
}
