/* Counts calls of the OpenCL library, in front of it: built as a shared object for LD_PRELOAD.
 * Every argument fits a register, so all of them pass as long; count_<function> is how many. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <link.h>
#include <string.h>

static int find(struct dl_phdr_info *library, size_t size, void *handle)
{
    (void)size;
    if (!strstr(library->dlpi_name, "libOpenCL")) return 0;
    *(void **)handle = dlopen(library->dlpi_name, RTLD_LAZY | RTLD_NOLOAD);
    return 1;
}

static void *real(const char *name)
{
    static void *library;
    if (!library) dl_iterate_phdr(find, &library);
    return dlsym(library, name);
}

#define COUNTED(name, parameters, arguments)                \
    long count_##name;                                      \
    long name parameters                                    \
    {                                                       \
        static long (*next) parameters;                     \
        if (!next) next = (long (*) parameters)real(#name); \
        __sync_fetch_and_add(&count_##name, 1);             \
        return next arguments;                              \
    }
#define COUNTED_1(n) COUNTED(n, (long a), (a))
#define COUNTED_2(n) COUNTED(n, (long a, long b), (a, b))
#define COUNTED_3(n) COUNTED(n, (long a, long b, long c), (a, b, c))
#define COUNTED_4(n) COUNTED(n, (long a, long b, long c, long d), (a, b, c, d))
#define COUNTED_5(n) COUNTED(n, (long a, long b, long c, long d, long e), (a, b, c, d, e))
#define COUNTED_6(n) \
    COUNTED(n, (long a, long b, long c, long d, long e, long f), (a, b, c, d, e, f))
#define COUNTED_9(n)                                                                     \
    COUNTED(n, (long a, long b, long c, long d, long e, long f, long g, long h, long i), \
            (a, b, c, d, e, f, g, h, i))
#define COUNTED_10(n)                                                                            \
    COUNTED(n, (long a, long b, long c, long d, long e, long f, long g, long h, long i, long j), \
            (a, b, c, d, e, f, g, h, i, j))

COUNTED_1(clFinish)
COUNTED_2(clWaitForEvents)
COUNTED_9(clEnqueueReadBuffer)
COUNTED_10(clEnqueueMapBuffer)
COUNTED_9(clEnqueueNDRangeKernel)
COUNTED_3(clGetPlatformIDs)
COUNTED_6(clCreateContext)
COUNTED_4(clCreateCommandQueue)
COUNTED_4(clCreateCommandQueueWithProperties)
COUNTED_6(clBuildProgram)
COUNTED_5(clCreateBuffer)
COUNTED_1(clRetainMemObject)
COUNTED_1(clReleaseMemObject)
