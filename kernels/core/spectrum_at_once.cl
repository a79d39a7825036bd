/* For long computations: SPECTRUM_IN_TURN(F) expands F(c) for all components; SPECTRUM_AT(s, c) reads component c, and
 * SPECTRUM_PUT(s, c, v) sets it. A GPU has core/spectrum_in_turn.cl. */
#define SPECTRUM_IN_TURN(F) SPECTRUM_EACH(F)
#define SPECTRUM_AT(s, c) (s).c
#define SPECTRUM_PUT(s, c, v) (s).c = v
