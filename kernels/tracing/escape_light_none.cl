/* Stands for tracing/escape_light.cl where no ray leaves a sealed medium toward a lamp. */
#define escape_waits(t) mask_of(0)
#define escape_light(trace, scene, path, at, o, d, t, active, passes) (passes)
