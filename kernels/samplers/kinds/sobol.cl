/* Owen-scrambled Sobol points, each pixel's its own. */
#include "core/sobol.cl"
