/* Stands for integrator/steps/dull_goes_on.cl where no first surface plays. */
#define dull_goes_on(next, null, scatter, bs, rival, beta) (next)
