/* A measured material, front side (Dupuy and Jakob 2018, section 4): a point of a square is warped by luminance,
 * then by visible normals to a halfway direction, about which light is mirrored. f cos [1/sr] is a spectrum over the
 * first square, times ndf / (4 sigma). No pdf depends on the wavelength. Values are linear between measured
 * directions, so f is as reciprocal, and keeps energy as well, as the measurement does. */
typedef struct {
    MeasurementParts parts;
    WarpSlices viewers;
    vec3 wo;     /* on the part of the azimuths that is stored */
    vec2 square; /* its point */
} MeasuredView;

inline MeasuredView measured_view(Measurement data, vec3 wo)
{
    MeasuredView v;
    v.parts = measurement_parts(data);
    v.wo = measurement_folded(v.parts, wo, wo);
    v.square = halfway_square(v.wo);
    v.viewers = measurement_viewers(v.parts, data.values, v.square);
    return v;
}

inline Spectrum measured_light(Measurement data, MeasuredView v, vec2 u, vec2 m)
{
    real density = measurement_at(data.values, v.parts.ndf, m);
    density /= 4.0f * measurement_at(data.values, v.parts.sigma, v.square);
    Spectrum s = measurement_spectrum(data, v.parts, v.viewers, u);
    return spectrum_scale(s, sel(v.parts.over_density, density, (real)(1.0f)));
}

/* The halfway direction's point of its square. */
inline vec2 measured_halfway(MeasuredView v, vec3 m)
{
    vec2 p = halfway_square(m);
    real turned = p.y - v.square.y + 0.5f;
    p.y = sel(v.parts.isotropic, turned - floor(turned), p.y);
    return p;
}

BsdfSample measured_sample(Measured m, vec3 wo, vec3 u)
{
    BsdfSample s = bsdf_nothing();
    MeasuredView v = measured_view(m.data, wo);
    vec2 uv = {u.y, u.x};
    real luminance, visible;
    uv = warp_sample(v.parts.luminance, v.viewers, uv, &luminance);
    vec2 p = warp_sample(v.parts.vndf, v.viewers, uv, &visible);
    vec3 h = halfway_direction(p, sel(v.parts.isotropic, v.square.y - 0.5f, (real)(0.0f)));
    real cos_om = dot3(v.wo, h);
    vec3 wi = sub3(scale3(h, 2.0f * cos_om), v.wo);
    s.pdf = luminance * visible / halfway_area(p.x, h, cos_om);
    mask seen = (wo.z > 0.0f) & (wi.z > 0.0f) & (cos_om > 0.0f) & (s.pdf > 0.0f);
    s.weight = spectrum_scale(measured_light(m.data, v, uv, p), 1.0f / max_r(s.pdf, (real)(1e-30f)));
    s.pdf = sel(seen, s.pdf, (real)(0.0f));
    s.wi = normalize3(measurement_folded(v.parts, wo, wi));
    return s;
}

Spectrum measured_eval(Measured m, vec3 wo, vec3 wi)
{
    MeasuredView v = measured_view(m.data, wo);
    vec3 h = normalize3(add3(v.wo, measurement_folded(v.parts, wo, wi)));
    vec2 p = measured_halfway(v, h);
    real visible;
    vec2 u = warp_invert(v.parts.vndf, v.viewers, p, &visible);
    mask front = (wo.z > 0.0f) & (wi.z > 0.0f);
    return spectrum_sel(front, measured_light(m.data, v, u, p), spectrum_of(0.0f));
}

real measured_pdf(Measured m, vec3 wo, vec3 wi)
{
    MeasuredView v = measured_view(m.data, wo);
    vec3 h = normalize3(add3(v.wo, measurement_folded(v.parts, wo, wi)));
    vec2 p = measured_halfway(v, h);
    real visible;
    vec2 u = warp_invert(v.parts.vndf, v.viewers, p, &visible);
    real luminance = warp_density(v.parts.luminance, v.viewers, u);
    real solid = halfway_area(p.x, h, dot3(v.wo, h));
    return sel((wo.z > 0.0f) & (wi.z > 0.0f), visible * luminance / solid, (real)(0.0f));
}

Spectrum measured_albedo(Measured m) { return measurement_share(m.data); }
