/* Shading that several kinds of materials share, as a part of the loop (stage/loop.cl) that is compiled
 * once for all of them: clpt/render/flow/vertices.py. No kind's flags reach it. */
#include "core/base.cl"
#include "generated/sampler.cl"
#include "shapes/shape.cl"
#include "lights/light.cl"
#include "generated/textures.cl"
#include "generated/shapes.cl"
#include "generated/lights.cl"
#include "shapes/surface.cl"
#include "lights/light.cl#begins"

#define COMMON(type, name) __attribute__((noinline)) type loop_##name
#include "generated/common_part.cl"
