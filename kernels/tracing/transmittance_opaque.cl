/* The transmittance between two points, 0 or 1, in scenes where every surface blocks light. */
inline real trace_transmittance(TRACE_ARGS, Scene scene, vec3 o, vec3 d, real t, Wavelengths lambdas, mask active)
{
    return sel(trace_occluded(TRACE_PASSED, scene, o, d, t, active), (real)(0.0f), (real)(1.0f));
}
