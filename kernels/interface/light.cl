/* The contract of a light kind: kernels/light/<kind>.cl has, for the kinds that are not on a shape,
 *
 *   LightSample <kind>_sample(<Kind> l, Scene scene, vec3 p, vec2 u, Wavelengths lambdas);
 *
 * which chooses a direction toward the light as seen from p. Those that a ray can meet (infinite ones) have
 *
 *   LightSample <kind>_sample(<Kind> l, Scene scene, vec3 hemisphere, vec2 u, Wavelengths lambdas);
 *   Spectrum <kind>_radiance(<Kind> l, Scene scene, vec3 d, Wavelengths lambdas);   along a ray that leaves the scene
 *   real     <kind>_pdf(<Kind> l, Scene scene, vec3 hemisphere, vec3 d);                  of sample, [1/sr]
 *
 * where `hemisphere` is the unit normal of the hemisphere to which the surface sends light, 0 if to the sphere.
 * The struct <Kind> is declared as a Record in clpt/render/contract/light_records.py; its rows lie in `light_params`.
 */
typedef struct {
    vec3 wi;           /* unit length, from p */
    real t;            /* distance [m]; FAR for lights at infinity */
    Spectrum radiance; /* what comes along it; for a delta light, irradiance on a shading surface */
    real pdf;          /* [1/sr]; below 0: a delta light, to be taken as it is; 0: nothing comes */
} LightSample;

/* Whether light from one hemisphere only matters. */
inline mask hemisphere_given(vec3 hemisphere) { return dot3(hemisphere, hemisphere) > 0.5f; }

inline LightSample light_nothing(void)
{
    LightSample s;
    s.wi = v3(0.0f, 0.0f, 1.0f);
    s.t = FAR;
    s.radiance = spectrum_of(0.0f);
    s.pdf = 0.0f;
    return s;
}
