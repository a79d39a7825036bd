/* The MIS weight of emission that a flight gathers in a brick at distance t, against next-event estimation; row: 1 +
 * the brick's row of `lights`. */
inline real brick_weight(Scene scene, integer row, mask active, GridOrigin origin, real t)
{
    mask sought = active & (row > 0) & (origin.pdf >= 0.0f);
    real w_met = 1.0f;
    if (any(sought)) {
        integer one = sel_i(sought, row - 1, (integer)(0));
        real pdf = brick_light_pdf(scene, one, origin.from, origin.receiver, origin.before + t);
        w_met = sel(sought, mis_weight(origin.pdf, pdf), w_met);
    }
    return w_met;
}

/* Twin, where no brick is a light. */
inline real brick_weight(Scene scene, integer row, mask active, GridOrigin origin, real t) { return (real)(1.0f); }
