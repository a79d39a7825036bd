/* The macros of core/spectrum_at_once.cl, component by component: all at once need too many of a GPU's registers. */
inline real spectrum_part(Spectrum s, int number)
{
    int n = 0;
    real v = s.x;
#define C(c) v = number == n++ ? s.c : v;
    SPECTRUM_EACH(C)
#undef C
    return v;
}
inline Spectrum spectrum_with_part(Spectrum s, int number, real v)
{
    int n = 0;
#define C(c) s.c = number == n++ ? v : s.c;
    SPECTRUM_EACH(C)
#undef C
    return s;
}
#define SPECTRUM_IN_TURN(F) \
    ROLLED                  \
    for (int part = 0; part < SPECTRUM_SIZE; part++) { F(part) }
#define SPECTRUM_AT(s, c) spectrum_part(s, c)
#define SPECTRUM_PUT(s, c, v) s = spectrum_with_part(s, c, v)
