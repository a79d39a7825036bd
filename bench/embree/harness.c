/* Embree's one-ray functions over arrays, for a fair comparison: one thread, one call a ray.
 *
 * A ray is 8 floats: origin, tmin, direction, tmax. Built by bench/embree/__init__.py.
 */
#define _POSIX_C_SOURCE 199309L
#include <embree3/rtcore.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

typedef struct { RTCDevice device; RTCScene scene; double seconds, wall; } Harness;

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t); /* a busy machine leaves it alone */
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

static double wall(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

Harness *harness_build(const float *vertices, size_t n_vertices, const unsigned *faces, size_t n_faces,
                       const char *config, int quality)
{
    Harness *h = calloc(1, sizeof *h);
    h->device = rtcNewDevice(config);
    h->scene = rtcNewScene(h->device);
    RTCGeometry mesh = rtcNewGeometry(h->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    memcpy(rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, n_vertices),
           vertices, 12 * n_vertices);
    memcpy(rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, n_faces), faces,
           12 * n_faces);
    rtcSetGeometryBuildQuality(mesh, (enum RTCBuildQuality)quality);
    rtcSetSceneBuildQuality(h->scene, (enum RTCBuildQuality)quality);
    rtcCommitGeometry(mesh);
    rtcAttachGeometry(h->scene, mesh);
    rtcReleaseGeometry(mesh);
    double start = now(), start_wall = wall();
    rtcCommitScene(h->scene);
    h->seconds = now() - start;
    h->wall = wall() - start_wall;
    return h;
}

double harness_build_seconds(const Harness *h) { return h->seconds; }

double harness_build_wall(const Harness *h) { return h->wall; }

/* t and primitive of every ray; primitive -1 where there is none. Returns seconds. */
double harness_closest(const Harness *h, const float *rays, size_t n, float *t, unsigned *prim)
{
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    double start = now();
    for (size_t i = 0; i < n; i++, rays += 8) {
        struct RTCRayHit r = {{rays[0], rays[1], rays[2], rays[3], rays[4], rays[5], rays[6], 0, rays[7],
                               0xffffffffu, 0, 0}};
        r.hit.geomID = r.hit.primID = RTC_INVALID_GEOMETRY_ID;
        rtcIntersect1(h->scene, &context, &r);
        t[i] = r.ray.tfar;
        prim[i] = r.hit.primID;
    }
    return now() - start;
}

/* 1 for every ray that meets something. Returns seconds. */
double harness_occluded(const Harness *h, const float *rays, size_t n, unsigned *occluded)
{
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    double start = now();
    for (size_t i = 0; i < n; i++, rays += 8) {
        struct RTCRay r = {rays[0], rays[1], rays[2], rays[3], rays[4], rays[5], rays[6], 0, rays[7],
                           0xffffffffu, 0, 0};
        rtcOccluded1(h->scene, &context, &r);
        occluded[i] = r.tfar < 0;
    }
    return now() - start;
}

void harness_free(Harness *h)
{
    rtcReleaseScene(h->scene);
    rtcReleaseDevice(h->device);
    free(h);
}
